"""Finds scenarios, cells, robots and trees: shipped ones and those of packages by name, others by path."""

import os
from importlib.resources import files
from pathlib import Path
from typing import Literal

from regrasp.app.files.findings import Finding, Findings, shown, why_no_file
from regrasp.interfaces.plugins import PluginError, installed, load
from regrasp.interfaces.quote import closest, cut, quoted

ResourceKind = Literal["scenario", "cell", "robot", "tree", "network"]
_SUFFIX: dict[ResourceKind, str] = {
    "scenario": ".yaml",
    "cell": ".yaml",
    "robot": ".yaml",
    "tree": ".xml",
    "network": ".yaml",
}
# Entry points by which packages put in files: each is the path of one, such as Path(__file__).with_name("mine.yaml")
GROUPS: dict[ResourceKind, str] = {"robot": "regrasp.robots"}
MAX_NAMED = 5  # shipped names that are listed after an unknown one
MAX_BYTES = 256 * 1024  # of a file that a person writes


def shipped(kind: ResourceKind) -> dict[str, Path]:
    """The files of this kind that come with Regrasp, by name and sorted; scenarios of faults come last."""
    folders = {
        "scenario": "scenarios",
        "cell": "scenarios/cells",
        "robot": "scenarios/robots",
        "tree": "trees",
        "network": "trees/networks",
    }
    folder = Path(str(files("regrasp"))) / folders[kind]
    names = {path.stem: path for path in sorted(folder.glob("*" + _SUFFIX[kind]))}
    if kind == "scenario":
        names |= {f"faults/{path.stem}": path for path in sorted((folder / "faults").glob("*" + _SUFFIX[kind]))}
    return names


def named(kind: ResourceKind) -> list[str]:
    """The names of this kind that `resolve` knows: those that are shipped, then those that packages put in."""
    return list(dict.fromkeys([*shipped(kind), *_put_in(kind)]))


def _put_in(kind: ResourceKind) -> list[str]:
    return [*installed(GROUPS[kind])] if kind in GROUPS else []


def resolve(kind: ResourceKind, name: str, beside: Path, where: tuple[str, int] | None = None) -> Path:
    """The file that `name` means: a path, relative to `beside`, if it has the suffix of its kind, else a known name.

    Raises `Findings`, at the place `where` (source, line) that holds the name; without one, at the name itself.
    """
    path = beside / name
    known = named(kind)
    if name.endswith(_SUFFIX[kind]):
        return path
    if name in known:
        return _known(kind, name, where or (name, 0))
    name = cut(name)
    what = "a folder" if os.path.isdir(path) else f"no {_SUFFIX[kind]} file" if os.path.exists(path) else ""
    wrong = f"{quoted(name)} is {what}" if name and what else f"no {kind} named {quoted(name)}"
    close = closest(name, known)
    hint = f"did you mean {quoted(close)}?" if close else _those_known(kind, known)
    raise Findings([Finding(*(where or (name or kind, 0)), f"{wrong}; {hint} (a path ends in {_SUFFIX[kind]})")])


def _known(kind: ResourceKind, name: str, where: tuple[str, int]) -> Path:
    """The file of that known name. Raises `Findings` at `where` if a package's cannot be had, or both have one."""
    of_regrasp = shipped(kind).get(name)
    if name not in _put_in(kind) and of_regrasp is not None:
        return of_regrasp
    if of_regrasp is not None:
        wrong = f"a package puts in a {kind} with the name of a shipped one, {name}; rename its entry point"
    elif isinstance(file := _loaded(kind, name), Path):
        return file
    else:
        wrong = f"the {kind} {name} cannot be loaded: {file}; mend its package, or remove it"
    raise Findings([Finding(*where, wrong)])


def _loaded(kind: ResourceKind, name: str) -> Path | str:
    """The path that a package gives, or why there is none."""
    try:
        value = load(GROUPS[kind], name)
    except PluginError as error:
        return str(error)
    if not isinstance(value, Path) or not value.is_absolute():
        return f"{quoted(str(value))} is no absolute path, such as Path(__file__).with_name('{name}{_SUFFIX[kind]}')"
    return value


def _those_known(kind: ResourceKind, names: list[str]) -> str:
    """The names in words; of many only the first ones, and how to list all."""
    own = "the shipped ones are" if names == [*shipped(kind)] else "there are"
    if len(names) <= MAX_NAMED:
        return f"{own} {', '.join(names)}"
    more = f"regrasp {kind}s list shows {len(names) - MAX_NAMED} more"
    return f"{own} {', '.join(names[:MAX_NAMED])}; {more}"


def read_text(path: Path, where: tuple[str, int] | None = None) -> str:
    """The text of a UTF-8 file that a person wrote. Raises `Findings` if there is none, or if it is no such text."""
    source, line = where or (shown(path), 0)
    if not os.path.isfile(path):
        raise Findings([Finding(source, line, f"{quoted(shown(path))} {why_no_file(path)}; name a file")])
    try:
        with path.open("rb") as stream:
            data = stream.read(MAX_BYTES + 1)
    except OSError as error:
        raise Findings([Finding(source, line, f"cannot read {quoted(shown(path))}: {error.strerror}")]) from None
    if len(data) > MAX_BYTES:
        raise Findings([Finding(shown(path), 0, f"longer than {MAX_BYTES} bytes; name a file written by hand")])
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        at = data.count(b"\n", 0, error.start) + 1
        message = f"byte {data[error.start]:#04x} is not UTF-8; save the file as UTF-8 text"
        raise Findings([Finding(shown(path), at, message)]) from None
