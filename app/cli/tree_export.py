"""Checks what `regrasp trees export` is asked for, and writes it."""

import sys
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from regrasp.app.files.findings import Finding, Findings, shown
from regrasp.app.files.resources import read_text, resolve
from regrasp.app.files.whole_file import write_whole
from regrasp.app.records.folders import FILES, file_findings
from regrasp.interfaces.quote import nearest, quoted

if TYPE_CHECKING:
    from regrasp.app.records.reader import RunRecord
    from regrasp.trees import Node

MAX_MISSING_NAMED = 3  # missing nodes that a finding names


@dataclass(frozen=True)
class Request:
    """The command's arguments and options as they were typed; None where they were left out."""

    tree: str | None
    form: str | None
    out: Path | None
    depth: int | None
    theme: str
    run: Path | None


def exported(request: Request) -> bytes:
    """The tree in the format asked for, also written to `out` if there is one. Raises `Findings`."""
    from regrasp.app.records.reader import read_record
    from regrasp.trees import collapsed
    from regrasp.trees.export import export_tree

    form = _form(request)
    record = read_record(request.run) if request.run else None
    path = _tree_file(request, record)
    node = _read(path, record)
    if request.depth is not None:
        node = collapsed(node, request.depth)
    content = export_tree(node, form, request.theme)
    if request.out:
        _write(request.out, content, path)
    return content


def _form(request: Request) -> str:
    """The format's name. Raises `Findings` of all that is wrong with the request itself."""
    from regrasp.trees.export import THEMES

    out = request.out
    form = request.form or (_named(out) if out else "ascii")
    found = [*_wrong_form(request.form, out)] if request.form else []
    found += [*_wrong_out(out, form)] if out else []
    if request.theme not in THEMES:
        found.append(Finding("--theme", 0, f"no theme {quoted(request.theme)}; {nearest(request.theme, THEMES)}"))
    if form == "groot" and request.depth is not None:
        found.append(
            Finding("--depth", 0, "Groot2 opens whole trees only; leave --depth out, or take another --format")
        )
    if form == "png" and out is None and sys.stdout.isatty():
        found.append(Finding("--format", 0, "a terminal shows no png; name a file with -o"))
    if request.tree is None and request.run is None:
        found.append(Finding("TREE", 0, "is missing; name a tree (`regrasp trees list`), or a run with --run"))
    if found:
        raise Findings(found)
    return form


def _named(out: Path) -> str:
    """The format of a file's suffix, '' for none."""
    from regrasp.trees.export import FORMAT_OF_SUFFIX

    return FORMAT_OF_SUFFIX.get(out.suffix.lower(), "")


def _wrong_form(form: str, out: Path | None) -> Iterator[Finding]:
    from regrasp.trees.export import FORMAT_OF_SUFFIX, FORMATS

    if form not in FORMATS:
        yield Finding("--format", 0, f"no format {quoted(form)}; {nearest(form, FORMATS)}")
    elif out and _named(out) not in ("", form):
        other = out.with_suffix(next(suffix for suffix, name in FORMAT_OF_SUFFIX.items() if name == form))
        wrong = f"is a name of {_named(out)}, not of {form}; write {shown(other)}, or leave --format out"
        yield Finding(shown(out), 0, wrong)


def _wrong_out(out: Path, form: str) -> Iterator[Finding]:
    from regrasp.trees.export import FORMAT_OF_SUFFIX

    if not form:
        yield Finding(
            shown(out), 0, f"the name ends in none of {', '.join(FORMAT_OF_SUFFIX)}; rename it, or name a --format"
        )
    if not out.absolute().parent.is_dir():
        wrong = f"there is no folder {quoted(shown(out.absolute().parent))}; name a file in a folder that exists"
        yield Finding(shown(out), 0, wrong)
    else:
        yield from file_findings(out)


def _tree_file(request: Request, record: "RunRecord | None") -> Path:
    """The file of the named tree, else the run's own copy."""
    if request.tree is not None:
        return resolve("tree", request.tree, Path())
    assert record is not None  # _form saw to it
    copy = record.folder / "tree.xml"
    if not copy.is_file():
        wrong = "is no file" if copy.exists() else "is missing"
        raise Findings(
            [Finding(shown(copy), 0, f"{wrong}; name the tree that ran: regrasp trees export TREE --run DIR")]
        )
    return copy


def _read(path: Path, record: "RunRecord | None") -> "Node":
    from regrasp.app.scenario.tree_file import check_tree_file
    from regrasp.trees import read_graph

    if record is None:
        check_tree_file(path)
        return read_graph(path)
    return _with_run(path, record)


def _with_run(path: Path, record: "RunRecord") -> "Node":
    """The tree with its run. It is not checked in full: it may have leaves that no longer exist."""
    from regrasp.app.scenario.references import tree_text
    from regrasp.trees import TreeSyntaxError, read_graph, recorded, run_stats

    read_text(path)  # its findings are ours
    inputs = record.begin.get("inputs")
    given = {key: tree_text(value) for key, value in inputs.items()} if isinstance(inputs, dict) else {}
    try:
        node = read_graph(path, inputs=given)
    except TreeSyntaxError as error:
        raise Findings([Finding(shown(path), error.line, str(error))]) from None
    except (OSError, ValueError) as error:
        raise Findings([Finding(shown(path), 0, str(error))]) from None
    stats = run_stats((tick.t, tick.path, tick.status) for tick in record.ticks)
    _check_paths(path, record, {n.path for n in node.walk() if n.kind != "subtree"})
    chain = (record.result.chain if record.result else None) or ()
    return recorded(node, stats, {link.path for link in chain})


def _check_paths(path: Path, record: "RunRecord", known: Collection[str]) -> None:
    missing: dict[str, int] = {}  # the line on which each came first
    for number, tick in enumerate(record.ticks, 1):
        if tick.path not in known:
            missing.setdefault(tick.path, number)
    if missing:
        first, more = [*missing][:MAX_MISSING_NAMED], len(missing) - MAX_MISSING_NAMED
        names = ", ".join(map(quoted, first)) + (f" and {more} more nodes" if more > 0 else "")
        wrong = f"{shown(path)} is not the tree that ran: it has no {names}; name that tree, or leave TREE out"
        raise Findings([Finding(shown(record.folder / "ticks.jsonl"), missing[first[0]], wrong)])


def _write(out: Path, content: bytes, tree: Path) -> None:
    if out.exists() and out.samefile(tree):
        raise Findings([Finding(shown(out), 0, "is the tree itself; name another file")])
    if out.is_file() and out.name in FILES and (out.parent / "events.jsonl").exists():
        raise Findings([Finding(shown(out), 0, "belongs to a run's record; name another file")])
    try:
        write_whole(out, content)
    except OSError as error:
        raise Findings([Finding(shown(out), 0, f"cannot be written ({error.strerror}); name another file")]) from None
