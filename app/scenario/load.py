"""Scenario files: which cell, which tree, what goes wrong, and what must come out."""

from collections.abc import Callable, Collection, Hashable, Iterable, Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal, ParamSpec, TypeVar

from regrasp.app.files.findings import Finding, Findings, attempt, nearest, shown
from regrasp.app.files.overrides import Assignment, apply, path_of, read, was_typed
from regrasp.app.files.resources import read_text, resolve
from regrasp.app.files.schema_nodes import at
from regrasp.app.files.validation import Error, read_as
from regrasp.app.files.yaml_lines import Document, Place, parse
from regrasp.app.files.yaml_lines import Path as KeyPath
from regrasp.app.records.result import DEFAULT_CASE
from regrasp.app.scenario import vary
from regrasp.app.scenario.cell_file import load_cell
from regrasp.app.scenario.placement import misplaced
from regrasp.app.scenario.references import check_inputs, check_names, names_of, tree_text
from regrasp.app.scenario.schema import ScenarioFile
from regrasp.interfaces.cell import Cell
from regrasp.interfaces.quote import MAX_QUOTE, cut, quoted

P = ParamSpec("P")
T = TypeVar("T")
_REQUIRED = {  # right values, for a look at other keys alone
    name: field.examples[0]
    for name, field in ScenarioFile.model_fields.items()
    if field.is_required() and field.examples
}


@dataclass(frozen=True)
class Scenario:
    """One case of a scenario, checked: the file with the case's values, and the cell and the tree that it names."""

    name: str
    path: Path
    file: ScenarioFile
    cell: Cell
    tree: Path
    overrides: tuple[str, ...] = ()
    case: str = DEFAULT_CASE

    @property
    def title(self) -> str:
        """Name and case, for a person."""
        return self.name if self.case == DEFAULT_CASE else f"{self.name} {self.case}"

    @property
    def lit_cell(self) -> Cell:
        """The cell in the scenario's light."""
        spec, hidden = self.file.light, self.cell.hidden
        given = spec.model_dump(include={"direction", "ambient", "diffuse"}, exclude_none=True)
        light = hidden.light.model_copy(update=given)
        factor = {"ambient": light.ambient * spec.brightness, "diffuse": light.diffuse * spec.brightness}
        lit = hidden.model_copy(update={"light": light.model_copy(update=factor)})
        return self.cell.model_copy(update={"hidden": lit})

    @property
    def inputs(self) -> dict[str, str]:
        """The tree's inputs as a tree file would state them."""
        return {key: tree_text(value) for key, value in self.file.inputs.items()}


def load_scenario(name_or_path: str, overrides: Sequence[str] = (), case: str | None = None) -> Scenario:
    """Read and check one case of a scenario, its cell and its tree; the case of the first values if none is named.

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
    """The names of a scenario's cases, without a check of the rest. Raises `Findings`."""
    source = _Source(name_or_path, overrides)
    if source.found:
        raise Findings(source.found)
    return [name for name, _ in source.cases]


class _Source:
    """A scenario's file, its cases, and what was found wrong so far.

    The file must be right also without its `vary`, but for keys that only `vary` gives. What cases share (a cell, a
    tree, where the obstacles stand) is read and checked once.
    """

    def __init__(self, name_or_path: str, overrides: Sequence[str]) -> None:
        self.found: dict[Finding, dict[str, None]] = {}  # with the cases that show it, '' for the file itself
        self._wrong: list[KeyPath] = []  # where the file itself is wrong
        self._done: dict[Hashable, tuple[Any, list[Finding]]] = {}
        self.overrides = tuple(overrides)
        assignments, wrong = read(overrides)
        self.note(wrong)
        try:
            self.path = resolve("scenario", name_or_path, Path())
            self._document = parse(read_text(self.path), shown(self.path))
        except Findings as error:
            raise Findings([*wrong, *error.items]) from None
        self.note(self._document.findings)
        _, errors = read_as(self._document, ScenarioFile)  # gives misspelt keys their right names
        self.note(error.finding for error in errors if error.is_misspelt)
        of_vary = [a for a in assignments if f"{a.key}.".startswith("vary.")]
        self._fixed = [a for a in assignments if a not in of_vary]
        self.note(attempt(apply, self._document, of_vary)[1])
        axes, wrong = vary.axes(self._document, self._fixed)
        self.note(wrong)
        self.cases = list(vary.expand(axes))
        self._varied = [path_of(key) for key in vary.keys(self._document)]
        if isinstance(self._document.value, dict):
            self._document.value.pop("vary", None)

    def note(self, findings: Iterable[Finding], case: str = "") -> None:
        """Add what a case shows, or the file itself."""
        for finding in findings:
            self.found.setdefault(finding, {})[case] = None

    def checked(self, chosen: Sequence[tuple[str, list[Assignment]]]) -> list[Scenario]:
        """The scenarios of these cases. Raises `Findings`; one that only some of them show names the first."""
        self._scenario("", [a for a in self._fixed if not any(_holds(k, a.path) for k in self._varied)])
        wrong, made = self._wrong, []
        for name, given in chosen:
            placed = [a for a in given if not any(_holds(path, a.path) and path != a.path for path in wrong)]
            made.append(self._scenario(name, [*placed, *self._fixed]))
        if self.found:
            raise Findings(_of_cases(finding, list(where), len(chosen)) for finding, where in self.found.items())
        return [scenario for scenario in made if scenario]

    def _once(self, case: str, make: Callable[..., T], key: Hashable, *args: Any) -> T | None:
        """What `make` returns, and for the case its findings; called for the first case with this key only."""
        if (make, key) not in self._done:
            self._done[make, key] = attempt(make, *args)
        done: T | None
        done, findings = self._done[make, key]
        self.note(findings, case)
        return done

    def _scenario(self, case: str, assignments: Sequence[Assignment]) -> Scenario | None:
        """The file with values laid over it; None where it is wrong."""
        given = self._document
        document = Document(deepcopy(given.value), dict(given.places), unread=set(given.unread))
        of_cell = [replace(a, key=a.key[5:]) for a in assignments if a.key.startswith("cell.")]
        self.note(attempt(apply, document, [a for a in assignments if not a.key.startswith("cell.")])[1], case)
        file = self._read(case, document, {a.path[0] for a in assignments})
        cell, tree = self._cell_and_tree(case, document, of_cell)
        inputs, obstacles, faults = (repr(at(document.value, (key,))) for key in ("inputs", "obstacles", "faults"))
        self._once(case, check_inputs, (tree, inputs, id(cell)), document, tree, cell)
        self._once(case, check_names, (tree, obstacles, faults), document, tree)
        gravity = repr(at(document.value, ("gravity",)))
        self._once(case, misplaced, (obstacles, gravity, id(cell)), document, cell)
        if not (file and cell and tree):
            return None
        name = self.path.name.removesuffix(".yaml").removesuffix(".scenario")
        return Scenario(name, self.path, file, cell, tree, self.overrides, case)

    def _read(self, case: str, document: Document, changed: Collection[str | int]) -> ScenarioFile | None:
        """The file by itself. Of one that is wrong already the cases look again only at what they change."""
        if self._wrong and isinstance(document.value, dict):
            value = _REQUIRED | {key: value for key, value in document.value.items() if key in changed}
            document = replace(document, value=value)
        file, errors = read_as(document, ScenarioFile)
        errors = [error for error in errors if not self._is_for_cases(case, error)]
        self.note((self._told(error) for error in errors), case)
        if not case:
            self._wrong = [error.path for error in errors]
        return None if self._wrong else file

    def _cell_and_tree(
        self, case: str, document: Document, of_cell: Sequence[Assignment]
    ) -> tuple[Cell | None, Path | None]:
        """The cell with these values, and the tree's file; None for what cannot be read."""
        folder = self.path.parent
        cell_at, tree_at = (document.place((key,)) for key in ("cell", "tree"))
        laid = repr([(a.key, a.new.value, a.place) for a in of_cell])
        cell = self._once(case, _cell, (repr(at(document.value, ("cell",))), cell_at, laid), document, folder, of_cell)
        name = repr(at(document.value, ("tree",)))
        tree = self._once(case, _named, (name, tree_at), document, "tree", folder)
        if tree:
            self._once(case, check_tree_file, (tree, tree_at, id(cell)), tree, tree_at, names_of(cell))
        return cell, tree

    def _told(self, error: Error) -> Finding:
        if error.is_missing and error.path in self._varied:
            return replace(error.finding, message=f"{error.finding.message}; vary changes only what is there")
        return error.finding

    def _is_for_cases(self, case: str, error: Error) -> bool:
        """Whether the cases say more of it: of a key that stands in `vary` alone, of values that `vary` changes."""
        if error.is_missing and len(error.path) == 1:
            return error.path in self._varied
        return error.is_of_several and case == "" and any(_holds(error.path, key) for key in self._varied)


def _holds(outer: KeyPath, inner: KeyPath) -> bool:
    """Whether one path is the other, or leads to it."""
    return inner[: len(outer)] == outer


def _of_cases(finding: Finding, cases: Sequence[str], of: int) -> Finding:
    """The finding with the first of the cases that show it, if not all do."""
    if "" in cases or len(cases) == of:
        return finding
    more = f" and {len(cases) - 1} more" if cases[1:] else ""
    return replace(finding, message=f"{finding.message} (case {cut(cases[0], 3 * MAX_QUOTE)}{more})")


def _named(document: Document, key: Literal["cell", "tree"], folder: Path) -> Path | None:
    """The file that the scenario names under `key`; None when the check of the scenario has found no name there.

    A path is taken from `folder`, the scenario's, but one of the command line from the current folder.
    """
    name, place = at(document.value, (key,)), document.place((key,))
    if not isinstance(name, str):
        return None
    return resolve(key, name, Path() if was_typed(place) else folder, place)


def _cell(document: Document, folder: Path, assignments: Sequence[Assignment]) -> Cell | None:
    path = _named(document, "cell", folder)
    return load_cell(path, assignments, document.place(("cell",))) if path else None


def check_tree_file(path: Path, where: Place | None = None, names: Mapping[str, Collection[str]] | None = None) -> None:
    """Raises `Findings` for all that is wrong in a tree file; at `where`, which names it, when there is none.

    `names` are those that the cell has, by kind; without them the tree's are not checked.
    """
    read_text(path, where)
    from regrasp.trees import check_tree  # the leaves bring the planner and the compiler with them: seconds

    found = [Finding(shown(path), line, message) for line, message in check_tree(path, names=names)]
    if found:
        raise Findings(found)


def description(path: Path) -> str:
    """The sentence that a scenario file gives of itself, without a check of the rest."""
    value = parse(read_text(path), shown(path)).value
    return str(value.get("description", "")) if isinstance(value, dict) else ""
