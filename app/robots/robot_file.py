"""Reads and checks robot files."""

from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

from regrasp.app.files.findings import Finding, Findings, shown
from regrasp.app.files.overrides import merge_into
from regrasp.app.files.resources import read_text, resolve
from regrasp.app.files.validation import validated
from regrasp.app.files.yaml_lines import Document, Place, parse
from regrasp.app.robots.meshes import missing_meshes
from regrasp.interfaces.quote import quoted
from regrasp.interfaces.robot.consistency import inconsistencies
from regrasp.interfaces.robot.robot import Robot
from regrasp.interfaces.robot.urdf import RobotError

DEFAULT_ROBOT = "vx300s"  # of a cell's arm that names none: the only one when cells named none


def load_robot(path: Path, where: Place | None = None) -> Robot:
    """Read and check a robot file, and the URDF that it names. It may name another as its `base` and add to it.

    Raises `Findings`; if there is no such file, the finding stands at `where`, the place that names the robot.
    """
    return read_robot(path, where)[0]


def read_robot(path: Path, where: Place | None = None) -> tuple[Robot, Document]:
    """As `load_robot`, with the document, which knows the lines."""
    document = _read(path, where)
    robot = validated(document, Robot)
    _check(document, robot)
    return robot, document


def robot_named(name: str, beside: Path, where: Place) -> dict[str, Any]:
    """The content of the robot file that a cell in the folder `beside` names. Raises `Findings`, as `load_robot`."""
    path = resolve("robot", name, beside, where).resolve()
    return _content(path, path.stat().st_mtime_ns if path.exists() else 0, where)


@cache
def _content(path: Path, changed: int, where: Place) -> dict[str, Any]:
    return load_robot(path, where).model_dump(mode="json", exclude_unset=True)


def _missing_meshes(document: Document, robot: Robot) -> Iterator[Finding]:
    missing = [*missing_meshes(robot.element())]
    if missing:
        link, message = missing[0]
        attached = robot.attached is not None and link.startswith(robot.attached.prefix or "\0")
        more = f" ({len(missing) - 1} more are missing)" if missing[1:] else ""
        yield Finding(*document.place(("attached", "urdf", "path") if attached else ("urdf", "path")), message + more)


def _read(path: Path, where: Place | None, above: tuple[Path, ...] = ()) -> Document:
    """The document, on top of the robot that it names as its `base`; the files `above` stand on this one."""
    document = parse(read_text(path, where), shown(path))
    value = document.value
    if isinstance(value, dict) and "folder" in value:
        message = "unknown key 'folder'; leave it out: paths are those from the robot file's folder"
        document.findings.append(Finding(*document.place(("folder",)), message))
    if isinstance(value, dict) and _is_beside(value):
        value["folder"] = str(path.resolve().parent)
    if not isinstance(value, dict) or "base" not in value:
        return document
    name, place = value.pop("base"), document.place(("base",))
    if not isinstance(name, str):
        raise Findings([Finding(*place, f"base is {quoted(name)}; expected the name of a robot or a path to its file")])
    base = resolve("robot", name, path.parent, place).resolve()
    if base in (path.resolve(), *above):
        raise Findings([Finding(*place, f"base is {quoted(name)}, which stands on this robot itself; name another")])
    below = _read(base, place, (path.resolve(), *above))
    merge_into(below, document)
    below.places[()] = document.place(())  # what neither file has is missing in this one
    return below


def _is_beside(value: dict[str, Any]) -> bool:
    """Whether a source of the URDF is no file of a package."""
    attached = value.get("attached")
    sources = [value.get("urdf"), attached.get("urdf") if isinstance(attached, dict) else None]
    return any(isinstance(source, dict) and source.get("package") is None for source in sources)


def _check(document: Document, robot: Robot) -> None:
    """Whether the file agrees with itself and the URDF. Raises `Findings`."""
    try:
        found = [Finding(*document.place(path), message) for path, message in inconsistencies(robot)]
    except RobotError as error:
        raise Findings([Finding(*document.place(error.path), str(error))]) from None
    if found:
        raise Findings(found)
    found, count = [*_missing_meshes(document, robot)], len(robot.chain)
    poses = enumerate(robot.calibration.poses)
    rows = [(("sleep",), robot.sleep), *((("calibration", "poses", i), pose) for i, pose in poses)]
    for path, row in rows:
        if len(row) != count:
            message = f"{len(row)} values; the robot has {count} joints: {', '.join(robot.joint_names)}"
            found.append(Finding(*document.place(path), message))
    if found:
        raise Findings(found)
