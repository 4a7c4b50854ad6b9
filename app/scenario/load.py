"""Reads and checks scenario files with all their cases, their cells and their trees."""

import contextlib
from collections.abc import Callable, Collection, Hashable, Iterable, Sequence
from copy import deepcopy
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, ParamSpec, TypeVar

from regrasp.app.files.findings import Finding, Findings, catch_findings, shown
from regrasp.app.files.overrides import Assignment, apply_assignments, parse_overrides, path_of, was_typed
from regrasp.app.files.resources import read_text, resolve
from regrasp.app.files.schema_nodes import value_at
from regrasp.app.files.validation import Error, read_as
from regrasp.app.files.yaml_lines import Document, parse
from regrasp.app.files.yaml_lines import Path as KeyPath
from regrasp.app.records.result import DEFAULT_CASE
from regrasp.app.scenario import vary
from regrasp.app.scenario.cell_file import load_cell, tasks_of
from regrasp.app.scenario.old_words import warn_of_old_words
from regrasp.app.scenario.other_tasks import words_of_others
from regrasp.app.scenario.placement import check_obstacles
from regrasp.app.scenario.references import check_names, check_tree_inputs, tree_text
from regrasp.app.scenario.schema import ScenarioFile, scenario_model, unknown_task_model
from regrasp.app.scenario.tree_file import check_tree_for
from regrasp.app.task import find
from regrasp.interfaces.cell import Cell
from regrasp.interfaces.quote import MAX_QUOTE, cut, nearest, quoted
from regrasp.trees.leaf_sets import task_of

if TYPE_CHECKING:
    from regrasp.app.task.task import Task

P = ParamSpec("P")
T = TypeVar("T")
_REQUIRED = {  # valid values, to check other keys by themselves
    name: field.examples[0]
    for name, field in ScenarioFile.model_fields.items()
    if field.is_required() and field.examples
}


@dataclass(frozen=True)
class Scenario:
    """A checked case of a scenario: the file with the case's values, the cell, and the path of the tree file."""

    name: str
    path: Path
    file: ScenarioFile
    cell: Cell
    tree: Path
    overrides: tuple[str, ...] = ()
    case: str = DEFAULT_CASE

    @property
    def task(self) -> "Task":
        """The job."""
        return find.task_named(self.file.TASK)

    @property
    def title(self) -> str:
        """Name and case, as messages show them."""
        return self.name if self.case == DEFAULT_CASE else f"{self.name} {self.case}"

    @property
    def lit_cell(self) -> Cell:
        """The cell with the scenario's light."""
        spec, hidden = self.file.light, self.cell.hidden
        given = spec.model_dump(include={"direction", "ambient", "diffuse"}, exclude_none=True)
        light = hidden.light.model_copy(update=given)
        factor = {"ambient": light.ambient * spec.brightness, "diffuse": light.diffuse * spec.brightness}
        lit = hidden.model_copy(update={"light": light.model_copy(update=factor)})
        return self.cell.model_copy(update={"hidden": lit})

    @property
    def inputs(self) -> dict[str, str]:
        """The tree's inputs as texts, in the form of a tree file."""
        return {key: tree_text(value) for key, value in self.file.inputs.items()}


def load_scenario(name_or_path: str, overrides: Sequence[str] = (), case: str | None = None) -> Scenario:
    """Read and check one case of a scenario, its cell and its tree; without `case` the one of the first values.

    `overrides` are "key.path=value" with YAML values; those that start with "cell." change the cell. Raises `Findings`
    with all that is wrong in any of the three files.
    """
    source = _Source(name_or_path, overrides)
    names = [name for name, _ in source.cases]
    if case is not None and case not in names and not source.found:
        fixed = bool(overrides) and case in (name for name, _ in _Source(name_or_path, ()).cases)
        right = "--set fixes what makes this case; leave one of them out" if fixed else nearest(case, names)
        source.note([Finding("--case", 0, f"no case {quoted(case)}; {right}")])
    wanted = names.index(case) if case in names else 0
    return source.checked(source.cases[wanted : wanted + 1])[0]


def cases(name_or_path: str, overrides: Sequence[str] = ()) -> list[Scenario]:
    """Every case of a scenario, read and checked as `load_scenario` does, in the order of its `vary`.

    Raises `Findings` with all that is wrong in any case.
    """
    source = _Source(name_or_path, overrides)
    return source.checked(source.cases)


def case_names(name_or_path: str, overrides: Sequence[str] = ()) -> list[str]:
    """The names of a scenario's cases; the rest is not checked. Raises `Findings`."""
    source = _Source(name_or_path, overrides)
    if source.found:
        raise Findings(source.found)
    return [name for name, _ in source.cases]


class _Source:
    """A scenario's file, its cases, and the findings so far.

    The file must be valid without its `vary`, too, except for keys that only `vary` gives. What cases share (a cell, a
    tree, the obstacles' places) is read and checked once.
    """

    def __init__(self, name_or_path: str, overrides: Sequence[str]) -> None:
        self.found: dict[Finding, dict[str, None]] = {}  # with the cases that have it, '' for the file itself
        self._wrong: list[KeyPath] = []  # where the file itself is wrong
        self._done: dict[Hashable, tuple[Any, list[Finding]]] = {}
        self.overrides = tuple(overrides)
        assignments, wrong = parse_overrides(overrides)
        self.note(wrong)
        try:
            self.path = resolve("scenario", name_or_path, Path())
            self._document = parse(read_text(self.path), shown(self.path))
        except Findings as error:
            raise Findings([*wrong, *error.items]) from None
        self.note(self._document.findings)
        _, errors = read_as(self._document, self._model(self._first_task()))  # gives misspelt keys their right names
        self.note(error.finding for error in errors if error.is_misspelt)
        of_vary = [a for a in assignments if f"{a.key}.".startswith("vary.")]
        self._fixed = [a for a in assignments if a not in of_vary]
        self.note(catch_findings(apply_assignments, self._document, of_vary)[1])
        axes, wrong = vary.axes(self._document, self._fixed)
        self.note(wrong)
        self.cases = list(vary.expand(axes))
        self._varied = [path_of(key) for key in vary.keys(self._document)]
        if isinstance(self._document.value, dict):
            self._document.value.pop("vary", None)

    def note(self, findings: Iterable[Finding], case: str = "") -> None:
        """Add findings of a case, or of the file itself."""
        for finding in findings:
            self.found.setdefault(finding, {})[case] = None

    def checked(self, chosen: Sequence[tuple[str, list[Assignment]]]) -> list[Scenario]:
        """The scenarios of these cases. Raises `Findings`; one that only some cases have names the first of them."""
        self._scenario("", [a for a in self._fixed if not any(_holds(k, a.path) for k in self._varied)])
        wrong, made = self._wrong, []
        for name, given in chosen:
            placed = [a for a in given if not any(_holds(path, a.path) and path != a.path for path in wrong)]
            made.append(self._scenario(name, [*placed, *self._fixed]))
        if self.found:
            raise Findings(_of_cases(finding, list(where), len(chosen)) for finding, where in self.found.items())
        return [scenario for scenario in made if scenario]

    def _once(self, case: str, make: Callable[..., T], key: Hashable, *args: Any) -> T | None:
        """What `make` returns; its findings are noted for the case. It is called once for each key."""
        if (make, key) not in self._done:
            self._done[make, key] = catch_findings(make, *args)
        done: T | None
        done, findings = self._done[make, key]
        self.note(findings, case)
        return done

    def _scenario(self, case: str, assignments: Sequence[Assignment]) -> Scenario | None:
        """The scenario with the assignments applied; None if something is wrong."""
        given = self._document
        document = Document(deepcopy(given.value), dict(given.places), unread=set(given.unread))
        of_cell = [replace(a, key=a.key[5:]) for a in assignments if a.key.startswith("cell.")]
        self.note(
            catch_findings(apply_assignments, document, [a for a in assignments if not a.key.startswith("cell.")])[1],
            case,
        )
        task = self._task(case, document, of_cell)
        warn_of_old_words(document, task.old_outcomes if task else {})
        file = self._read(case, document, {a.path[0] for a in assignments}, self._model(task))
        cell, tree = self._cell_and_tree(case, document, of_cell, task)
        inputs, obstacles, faults, draw = (
            repr(value_at(document.value, (key,))) for key in ("inputs", "obstacles", "faults", "draw")
        )
        self._once(case, check_tree_inputs, (tree, inputs, id(cell)), document, tree, cell, task)
        self._once(case, check_names, (tree, obstacles, faults, id(cell), task), document, tree, cell, task)
        gravity = repr(value_at(document.value, ("gravity",)))
        self._once(case, check_obstacles, (obstacles, draw, gravity, id(cell)), document, cell, task)
        if not (file and cell and tree):
            return None
        name = self.path.name.removesuffix(".yaml").removesuffix(".scenario")
        return Scenario(name, self.path, file, cell, tree, self.overrides, case)

    def _task(self, case: str, document: Document, of_cell: Sequence[Assignment]) -> "Task | None":
        """The task that the scenario names, or the only one whose section its cell holds; None if that is wrong."""
        place = document.place(("task",))
        name = value_at(document.value, ("task",))
        if case == "" and ("task",) in self._varied:
            return None
        if isinstance(name, str):
            return self._once(case, find.task_named, (name, place), name, place)
        cell, laid = repr(value_at(document.value, ("cell",))), repr([(a.key, a.new.value) for a in of_cell])
        args = (document, self.path.parent, of_cell)
        return self._once(case, _task_of_cell, (cell, document.place(("cell",)), laid), *args)

    def _first_task(self) -> "Task | None":
        """The task of the file as it is written, or of the first values of `vary`; None if that is wrong."""
        names: dict[str, Any] = {}
        for key in ("task", "cell"):
            varied = value_at(self._document.value, ("vary", key))
            names[key] = value_at(self._document.value, (key,)) or (varied[0] if isinstance(varied, list) else None)
        with contextlib.suppress(Findings):
            if isinstance(names["task"], str):
                return find.task_named(names["task"])
            if isinstance(names["cell"], str):
                tasks = tasks_of(resolve("cell", names["cell"], self.path.parent))
                return find.task_named(tasks[0]) if len(tasks) == 1 else None
        return None

    def _model(self, task: "Task | None") -> type[ScenarioFile]:
        """The model of the task's files; while that is not known, that of its tree's task, or of any task."""
        if task is None:
            found = [*find.tasks()]
            task = found[0] if len(found) == 1 else self._trees_task()
        return unknown_task_model() if task is None else scenario_model(task)

    def _trees_task(self) -> "Task | None":
        """The task whose leaves the file's tree names; None if it names another's, too, or is no tree."""
        name = value_at(self._document.value, ("tree",))
        if not isinstance(name, str):
            return None
        with contextlib.suppress(Findings, OSError, ValueError):
            task = task_of(resolve("tree", name, self.path.parent))
            return None if task is None else find.task_named(task)
        return None

    def _read(
        self, case: str, document: Document, changed: Collection[str | int], model: type[ScenarioFile]
    ) -> ScenarioFile | None:
        """Validate the file by itself. If it is wrong without its cases, they check only the keys that they change."""
        if self._wrong and isinstance(document.value, dict):
            value = _REQUIRED | {key: value for key, value in document.value.items() if key in changed}
            document = replace(document, value=value)
        file, errors = read_as(document, model)
        told = words_of_others(document, find.task_named(model.TASK)) if errors and model.TASK else {}
        errors = [_retold(error, told.get(error.path)) for error in errors]
        errors = [error for error in errors if not self._is_for_cases(case, error)]
        self.note((self._told(error) for error in errors), case)
        if not case:
            self._wrong = [error.path for error in errors]
        return None if self._wrong else file

    def _cell_and_tree(
        self, case: str, document: Document, of_cell: Sequence[Assignment], task: "Task | None"
    ) -> tuple[Cell | None, Path | None]:
        """The cell with these assignments, and the tree's path; None for what is invalid."""
        folder = self.path.parent
        cell_at, tree_at = (document.place((key,)) for key in ("cell", "tree"))
        laid = repr([(a.key, a.new.value, a.place) for a in of_cell])
        cell = None
        if task is not None:
            named = repr(value_at(document.value, ("cell",)))
            cell = self._once(case, _cell, (named, cell_at, laid, task), document, folder, of_cell, task)
        name = repr(value_at(document.value, ("tree",)))
        tree = self._once(case, _named, (name, tree_at), document, "tree", folder)
        if tree:
            self._once(case, check_tree_for, (tree, tree_at, id(cell), task), tree, tree_at, cell, task)
        return cell, tree

    def _told(self, error: Error) -> Finding:
        if error.is_missing and error.path in self._varied:
            return replace(error.finding, message=f"{error.finding.message}; vary changes only what is there")
        return error.finding

    def _is_for_cases(self, case: str, error: Error) -> bool:
        """Whether the error is left to the cases: the key stands only in `vary`, or `vary` changes the values."""
        if error.is_missing and len(error.path) == 1:
            return error.path in self._varied
        return error.is_of_several and case == "" and any(_holds(error.path, key) for key in self._varied)


def _retold(error: Error, message: str | None) -> Error:
    """The error, with this message in place of its own."""
    return error if message is None else error._replace(finding=replace(error.finding, message=message))


def _holds(outer: KeyPath, inner: KeyPath) -> bool:
    """Whether `outer` is the path `inner` or the beginning of it."""
    return inner[: len(outer)] == outer


def _of_cases(finding: Finding, cases: Sequence[str], of: int) -> Finding:
    """The finding; if not all cases have it, the message names the first that does."""
    if "" in cases or len(cases) == of:
        return finding
    more = f" and {len(cases) - 1} more" if cases[1:] else ""
    return replace(finding, message=f"{finding.message} (case {cut(cases[0], 3 * MAX_QUOTE)}{more})")


def _named(document: Document, key: Literal["cell", "tree"], folder: Path) -> Path | None:
    """The file that the scenario names under `key`; None if there is no name, which is a finding elsewhere.

    A relative path starts at `folder`, the scenario's; one from the command line starts at the current folder.
    """
    name, place = value_at(document.value, (key,)), document.place((key,))
    if not isinstance(name, str):
        return None
    return resolve(key, name, Path() if was_typed(place) else folder, place)


def _cell(document: Document, folder: Path, assignments: Sequence[Assignment], task: "Task") -> Cell | None:
    path = _named(document, "cell", folder)
    return load_cell(path, assignments, document.place(("cell",)), task=task) if path else None


def _task_of_cell(document: Document, folder: Path, assignments: Sequence[Assignment]) -> "Task | None":
    """The task whose section the scenario's cell holds; None if it names no cell, which is a finding elsewhere.

    Raises `Findings` if the cell cannot be read, or holds no section of a task or several.
    """
    path, place = _named(document, "cell", folder), document.place(("cell",))
    if path is None:
        return None
    tasks, known = tasks_of(path, assignments, place), find.names()
    if len(tasks) == 1:
        return find.task_named(tasks[0])
    if tasks:
        message = f"the cell {shown(path)} has sections of the tasks {' and '.join(tasks)}; write one of them as task:"
    else:
        right = f"add that of your task, known.NAME, or write task: with one of {', '.join(known)}"
        message = f"the cell {shown(path)} has no task's section; {right}"
    raise Findings([Finding(*place, message)])


def description(path: Path) -> str:
    """The `description` of a scenario file; the rest is not checked."""
    value = parse(read_text(path), shown(path)).value
    return str(value.get("description", "")) if isinstance(value, dict) else ""
