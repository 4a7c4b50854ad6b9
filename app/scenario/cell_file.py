"""Reads and checks cell files, each for the task that is to be done in the cell."""

import warnings
from collections import Counter
from collections.abc import Iterator, Sequence
from copy import deepcopy
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from regrasp.app.files.findings import Finding, Findings, catch_findings, shown
from regrasp.app.files.overrides import Assignment, apply_assignments, merge_into, was_typed
from regrasp.app.files.resources import read_text, resolve, shipped
from regrasp.app.files.schema_nodes import value_at
from regrasp.app.files.validation import validated
from regrasp.app.files.yaml_lines import Document, Place, parse
from regrasp.app.files.yaml_lines import Path as KeyPath
from regrasp.app.robots.robot_file import DEFAULT_ROBOT, robot_named
from regrasp.app.scenario.old_words import OldWordWarning
from regrasp.app.task import find
from regrasp.interfaces.cell import Cell, WristMount
from regrasp.interfaces.quote import nearest, quoted

if TYPE_CHECKING:
    from regrasp.app.task.task import Task

_HALVES = ("known", "hidden")  # of a cell file; a task may have a section in each


def load_cell(
    path: Path,
    assignments: Sequence[Assignment] = (),
    where: Place | None = None,
    *,
    task: "Task | None" = None,
    laid_out: bool = True,
) -> Cell:
    """Read and check a cell file, with the assignments applied.

    The cell is read for this task; without one for the task whose section it holds. Sections of other tasks are left
    out. A cell may name another as its `base` and give only what differs; the base itself has no base. Raises
    `Findings`; if there is no such file, the finding stands at `where`, the place that names the cell. Without
    `laid_out` it is not checked whether the parts leave one another room and the robot can reach them, for those who
    only look at pictures.
    """
    document = _read(path, where)
    assignments = [_with_new_key(assignment) for assignment in assignments]
    if not isinstance(document.value, dict):  # only that is told, not the assignments
        validated(document, Cell)
    asleep: dict[int, Any] = {}
    robots = _put_robots(document, path.parent, asleep)
    _, found = catch_findings(apply_assignments, document, assignments)
    found = [*robots, *found, *_put_robots(document, path.parent, asleep)]
    if task is None:
        task = find.task_named(_only_task(document, shown(path)))
    model = task.cell()
    found += [*_left_out(document, model, task)]
    cell, wrong = catch_findings(validated, document, model)
    found += wrong if not found else [finding for finding in wrong if not _is_missing_section(finding, task)]
    if cell:
        unusable = [*_misnamed(document, cell), *_without_spheres(document, cell)]
        found += unusable
        if not unusable:
            found += _task_findings(document, cell, task, laid_out)
    if found or not cell:
        raise Findings(found)
    return cell


def tasks_of(path: Path, assignments: Sequence[Assignment] = (), where: Place | None = None) -> list[str]:
    """The tasks whose sections a cell file holds. Raises `Findings` if it cannot be read."""
    document = _read(path, where)
    if not isinstance(document.value, dict):
        validated(document, Cell)
    catch_findings(apply_assignments, document, [_with_new_key(assignment) for assignment in assignments])
    return _sections(document)


def _put_robots(document: Document, folder: Path, asleep: dict[int, Any]) -> list[Finding]:
    """Put the content of robot files in the place of their names; findings of files that cannot be read.

    A path is relative to `folder`; one from the command line, to where that runs.
    An arm without a sleep pose gets its robot's, which is noted in `asleep`, and another when the robot is changed.
    """
    found: list[Finding] = []
    arms = value_at(document.value, ("known", "arms"))
    for i, arm in enumerate(arms if isinstance(arms, list) else []):
        if not isinstance(arm, dict) or not isinstance(name := arm.get("robot", DEFAULT_ROBOT), str):
            continue
        key = ("known", "arms", i, "robot")
        place = document.place(key if "robot" in arm else key[:-1])
        content, wrong = catch_findings(robot_named, name, Path() if was_typed(place) else folder, place)
        found += wrong
        robot = arm["robot"] = deepcopy(content or robot_named(DEFAULT_ROBOT, folder, place))
        if arm.get("sleep") == asleep.get(i):
            arm["sleep"] = asleep[i] = deepcopy(robot.get("sleep"))
    return found


def _task_findings(document: Document, cell: Cell, task: "Task", laid_out: bool) -> list[Finding]:
    found = [] if task.cell_findings is None else [*task.cell_findings()(document, cell, False)]
    if found or not laid_out:
        return found
    from regrasp.app.scenario.cell_layout import bases_in_one_place, layout_findings  # late: they bring the optimiser

    if found := [*bases_in_one_place(document, cell.known)]:
        return found
    found = [*layout_findings(document, cell.known)]
    return found if task.cell_findings is None else [*found, *task.cell_findings()(document, cell, True)]


def _read(path: Path, where: Place | None) -> Document:
    document = parse(read_text(path, where), shown(path))
    _take_old_keys(document)
    if isinstance(document.value, dict) and "base" in document.value:
        document = _on_base(document, path.parent)
    return document


def _on_base(top: Document, folder: Path) -> Document:
    assert isinstance(top.value, dict)
    name, place = top.value.pop("base"), top.place(("base",))
    if not isinstance(name, str):
        raise Findings([Finding(*place, f"base is {quoted(name)}; expected the name of a cell or a path to its file")])
    path = resolve("cell", name, folder, place)
    document = parse(read_text(path, place), shown(path))
    _take_old_keys(document)
    if isinstance(document.value, dict) and "base" in document.value:
        raise Findings(
            [Finding(*place, f"{quoted(shown(path))} has a base itself; name that one, and give here what it adds")]
        )
    merge_into(document, top)
    return document


def _take_old_keys(document: Document) -> None:
    """Move what stood elsewhere before cells had sections, with a warning; what cannot move is a finding."""
    for old, new in find.old_cell_keys().items():
        path, target = tuple(old.split(".")), tuple(new.split("."))
        if value_at(document.value, path[:-1]) is None or path not in document.places:
            continue
        if target in document.places or not isinstance(value_at(document.value, target[:-1]) or {}, dict):
            found = Finding(
                *document.place(path), f"{old} is an old key, and {new} cannot take it; write it there alone"
            )
            document.findings.append(found)
            continue
        _warn(document.place(path), old, new)
        document.move(path, target)


def _with_new_key(assignment: Assignment) -> Assignment:
    for old, new in find.old_cell_keys().items():
        if f"{assignment.key}.".startswith(f"{old}."):
            if not was_typed(assignment.place):
                _warn(assignment.place, f"cell.{old}", f"cell.{new}")
            return replace(assignment, key=new + assignment.key[len(old) :])
    return assignment


def _warn(place: Place, old: str, new: str) -> None:
    warnings.warn(str(Finding(*place, f"{old} is an old key; write {new}")), OldWordWarning, stacklevel=2)


def _sections(document: Document) -> list[str]:
    """The tasks that have a section in the file."""
    value: Any = document.value
    halves = [value[half] for half in _HALVES if isinstance(value, dict) and isinstance(value.get(half), dict)]
    return [name for name in find.names() if any(name in half for half in halves)]


def _only_task(document: Document, file: str) -> str:
    """The task whose section the file holds. Raises `Findings` if there is none, or more than one."""
    sections = _sections(document)
    if len(sections) == 1:
        return sections[0]
    many = f"has sections of the tasks {' and '.join(sections)}" if sections else "has no task's section"
    message = f"{many}; name the task"
    raise Findings([Finding(file, 0, message)])


def _left_out(document: Document, model: type[Cell], task: "Task") -> Iterator[Finding]:
    """Take sections of other tasks out of the document; findings of the task's own that are missing."""
    value: Any = document.value
    for half in _HALVES:
        held = value.get(half) if isinstance(value, dict) else None
        if not isinstance(held, dict):
            continue
        kind: Any = model.model_fields[half].annotation
        for name in find.names():
            if name != task.name and name in held:
                held.pop(name)
        section = kind.model_fields.get(task.name)
        if section is not None and section.is_required() and task.name not in held:
            cells = " or ".join(quoted(cell) for cell in _cells_with(task.name))
            right = f"take the cell {cells}, or add it" if cells else "add it"
            message = f"the task {task.name} needs a section {half}.{task.name}, and this cell has none; {right}"
            yield Finding(*document.place((half,)), message)


def _is_missing_section(finding: Finding, task: "Task") -> bool:
    return finding.message.startswith(f"key {task.name!r} is missing in ")


def _cells_with(task: str) -> list[str]:
    """The shipped cells that have a section of the task, and no base."""
    found = []
    for name, path in shipped("cell").items():
        value: Any = parse(read_text(path), shown(path)).value
        if isinstance(value, dict) and "base" not in value and task in value.get("known", {}):
            found.append(name)
    return found


def _without_spheres(document: Document, cell: Cell) -> Iterator[Finding]:
    """Arms that nothing would keep from what is around them."""
    for i, arm in enumerate(cell.known.arms):
        if not arm.robot.spheres:
            message = f"known.arms.{i}.robot: {arm.robot.title} has no spheres; `regrasp robots spheres` fits them"
            yield Finding(*document.place(("known", "arms", i, "robot")), message)


def _misnamed(document: Document, cell: Cell) -> Iterator[Finding]:
    """Names in a cell that are taken twice, or refer to nothing."""
    known = cell.known
    groups: dict[str, list[str]] = {
        "boxes": [box.name for box in known.solids()],
        "arms": [arm.name for arm in known.arms],
        "cameras": [camera.name for camera in known.cameras],
    }
    for key, names in groups.items():
        for name, count in Counter(names).items():
            if count > 1:
                message = f"{count} {key} are named {quoted(name)}; rename them"
                yield Finding(*document.place(("known", key)), message)
    for i, camera in enumerate(known.cameras):
        if isinstance(camera.mount, WristMount) and camera.mount.arm not in groups["arms"]:
            path: KeyPath = ("known", "cameras", i, "mount", "arm")
            arms, arm = groups["arms"], camera.mount.arm
            right = nearest(arm, arms) if arms else "this cell has none"
            yield Finding(*document.place(path), f"known.cameras.{i}.mount.arm: no arm {quoted(arm)}; {right}")
