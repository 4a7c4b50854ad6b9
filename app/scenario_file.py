"""Scenario files: which cell, which tree, what goes wrong, and what must come out."""

from collections.abc import Callable, Collection, Hashable, Iterator, Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal, ParamSpec, TypeVar

from app import vary
from app.findings import Finding, Findings, nearest, shown
from app.overrides import Assignment, apply, read
from app.placement import misplaced
from app.resources import read_text, resolve
from app.scenario_schema import ScenarioFile, TreeInput
from app.schema import validated
from app.yaml_lines import Document, Place, parse
from interfaces.cell import Cell
from interfaces.fault import ObstacleMovesIn

P = ParamSpec("P")
T = TypeVar("T")


@dataclass(frozen=True)
class Scenario:
    """One case of a scenario, checked: the file with the case's values, and the cell and the tree that it names."""

    name: str
    path: Path
    file: ScenarioFile
    cell: Cell
    tree: Path
    overrides: tuple[str, ...] = ()
    case: str = vary.DEFAULT

    @property
    def title(self) -> str:
        """Name and case, for a person."""
        return self.name if self.case == vary.DEFAULT else f"{self.name} {self.case}"

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
        source.found[Finding("--case", 1, f"no case {case!r}; {nearest(case, names)}")] = ""
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

    What cases share (a cell, a tree, where the obstacles stand) is read and checked once.
    """

    def __init__(self, name_or_path: str, overrides: Sequence[str]) -> None:
        self.found: dict[Finding, str] = {}  # with the case that showed it first, '' for the file itself
        self._done: dict[Hashable, Any] = {}
        self.path = resolve("scenario", name_or_path, Path())
        self.overrides = tuple(overrides)
        self._document = parse(read_text(self.path), shown(self.path))
        assignments, wrong = read(overrides)
        self.found |= dict.fromkeys(wrong, "")
        of_vary = [a for a in assignments if f"{a.key}.".startswith("vary.")]
        self._fixed = [a for a in assignments if a not in of_vary]
        self._attempt("", apply, self._document, of_vary)
        axes = self._attempt("", vary.axes, self._document, self._fixed)
        self.cases = list(vary.expand(axes or []))
        if isinstance(self._document.value, dict):
            self._document.value.pop("vary", None)

    def checked(self, chosen: Sequence[tuple[str, list[Assignment]]]) -> list[Scenario]:
        """The scenarios of these cases. Raises `Findings`; one that the first of them has not names its case."""
        made = [self._scenario(*case) for case in chosen]
        if self.found:
            shared = ("", chosen[0][0])
            raise Findings(f if case in shared else _of_case(f, case) for f, case in self.found.items())
        return [scenario for scenario in made if scenario]

    def _attempt(self, case: str, make: Callable[P, T], *args: P.args, **kwargs: P.kwargs) -> T | None:
        """What `make` returns; None when it raises findings, which are noted."""
        try:
            return make(*args, **kwargs)
        except Findings as error:
            for finding in error.items:
                self.found.setdefault(finding, case)
            return None

    def _once(self, case: str, make: Callable[..., T], key: Hashable, *args: Any) -> T | None:
        """As `_attempt`, but only for the first case with this key; the others get the same."""
        if (make, key) not in self._done:
            self._done[make, key] = self._attempt(case, make, *args)
        done: T | None = self._done[make, key]
        return done

    def _scenario(self, case: str, assignments: Sequence[Assignment]) -> Scenario | None:
        given = self._document
        document = Document(deepcopy(given.value), dict(given.places), given.findings, set(given.unread))
        every = [*assignments, *self._fixed]
        of_cell = [replace(a, key=a.key[5:]) for a in every if a.key.startswith("cell.")]
        self._attempt(case, apply, document, [a for a in every if not a.key.startswith("cell.")])
        file = self._attempt(case, validated, document, ScenarioFile)
        names = document.value if isinstance(document.value, dict) else {}
        laid = repr([(a.key, a.new.value) for a in of_cell])
        cell = self._once(case, _cell, (repr(names.get("cell")), laid), document, self.path.parent, of_cell)
        tree = self._once(case, _tree, (repr(names.get("tree")), id(cell)), document, self.path.parent, cell)
        if file and cell:
            self._once(case, misplaced, (file.obstacles, id(cell)), document, file.obstacles, cell.known)
        if file and tree:
            self._once(case, _check_names, (tree, file.faults, file.obstacles), document, file, tree)
        if file and tree and cell:
            self._once(case, _check_inputs, (tree, repr(file.inputs), id(cell)), document, tree, file, cell)
        if not (file and cell and tree):
            return None
        name = self.path.name.removesuffix(".yaml").removesuffix(".scenario")
        return Scenario(name, self.path, file, cell, tree, self.overrides, case)


def _of_case(finding: Finding, case: str) -> Finding:
    return replace(finding, message=f"{finding.message} (case {case})")


def _named(document: Document, key: Literal["cell", "tree"], folder: Path) -> Path | None:
    """The file that the scenario names under `key`; None when the check of the scenario has found no name there."""
    name = document.value.get(key) if isinstance(document.value, dict) else None
    return resolve(key, name, folder, document.place((key,))) if isinstance(name, str) else None


def _cell(document: Document, folder: Path, assignments: Sequence[Assignment]) -> Cell | None:
    path = _named(document, "cell", folder)
    return load_cell(path, assignments, document.place(("cell",))) if path else None


def _tree(document: Document, folder: Path, cell: Cell | None) -> Path | None:
    path = _named(document, "tree", folder)
    if path is not None:
        check_tree_file(path, document.place(("tree",)), _names(cell) if cell else None)
    return path


def _names(cell: Cell) -> dict[str, list[str]]:
    """What a tree may name of the cell, by kind."""
    return {"socket": [socket.name for socket in cell.known.sockets]}


def _check_inputs(document: Document, tree: Path, file: ScenarioFile, cell: Cell) -> None:
    from trees import check_inputs  # late, as below

    given = {key: tree_text(value) for key, value in file.inputs.items()}
    if found := [
        Finding(*document.place(("inputs", key)), f"inputs.{key}: {message}")
        for key, message in check_inputs(tree, given, names=_names(cell))
    ]:
        raise Findings(found)


def tree_text(value: TreeInput) -> str:
    """An input's value as a tree file would state it."""
    return str(value).lower() if isinstance(value, bool) else str(value)


def load_cell(path: Path, assignments: Sequence[Assignment] = (), where: Place | None = None) -> Cell:
    """Read and check a cell file with values laid over it.

    Raises `Findings`, at `where` (the place that names the cell) when there is no such file.
    """
    document = parse(read_text(path, where), shown(path))
    apply(document, assignments)
    cell = validated(document, Cell)
    found = list(_inconsistent(document, cell))
    if found:
        raise Findings(found)
    return cell


def _inconsistent(document: Document, cell: Cell) -> Iterator[Finding]:
    """What no single value of a cell shows."""
    known = cell.known
    sockets = [s.name for s in known.sockets]
    if known.plugged_into not in sockets:
        message = f"no socket {known.plugged_into!r}; {nearest(known.plugged_into, sockets)}"
        yield Finding(*document.place(("known", "plugged_into")), message)
    arms: list[str] = [a.name for a in known.arms]
    cameras: list[str] = [c.name for c in known.cameras]
    groups = {"sockets": (sockets, sockets), "arms": (arms, ["left", "right"]), "cameras": (cameras, ["rear", "wrist"])}
    for key, (names, needed) in groups.items():
        if sorted(names) != sorted(set(needed)):
            message = f"{key} are {', '.join(names)}; give one each of {', '.join(sorted(set(needed)))}"
            yield Finding(*document.place(("known", key)), message)


def check_tree_file(path: Path, where: Place | None = None, names: Mapping[str, Collection[str]] | None = None) -> None:
    """Raises `Findings` for all that is wrong in a tree file; at `where`, which names it, when there is none.

    `names` are those that the cell has, by kind; without them the tree's are not checked.
    """
    read_text(path, where)
    from trees import check_tree  # the leaves bring the planner and the compiler with them: seconds

    found = [Finding(shown(path), line, message) for line, message in check_tree(path, names=names)]
    if found:
        raise Findings(found)


def description(path: Path) -> str:
    """The sentence that a scenario file gives of itself, without a check of the rest."""
    value = parse(read_text(path), shown(path)).value
    return str(value.get("description", "")) if isinstance(value, dict) else ""


def _check_names(document: Document, file: ScenarioFile, tree: Path) -> None:
    """Raises `Findings` for obstacles and nodes of the tree that faults name and that are not there."""
    found = []
    obstacles = [o.name for o in file.obstacles]
    for i, fault in enumerate(file.faults):
        if isinstance(fault, ObstacleMovesIn) and fault.obstacle not in obstacles:
            message = f"no obstacle {fault.obstacle!r}; {nearest(fault.obstacle, obstacles)}"
            found.append(Finding(*document.place(("faults", i, "obstacle")), message))
        if fault.when.node is not None and fault.when.node not in (names := _node_names(tree)):
            message = f"no node {fault.when.node!r} in {tree.name}; {nearest(fault.when.node, names)}"
            found.append(Finding(*document.place(("faults", i, "when", "node")), message))
    if found:
        raise Findings(found)


def _node_names(tree: Path) -> set[str]:
    """Every way to name a node of the tree: its path, and the last names of it."""
    from behaviors import LEAVES
    from trees import load_tree, node_paths

    steps = [path.split("/") for path in node_paths(load_tree(tree, LEAVES)).values()]
    return {"/".join(names[i:]) for names in steps for i in range(len(names))}
