"""Scenario files: which cell, which tree, what goes wrong, and what must come out."""

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, ParamSpec, TypeVar

import numpy as np

from app import overrides as set_
from app.findings import Finding, Findings, nearest, shown
from app.placement import TOUCHING, overlaps
from app.resources import read_text, resolve
from app.scenario_schema import ScenarioFile
from app.schema import validated
from app.yaml_lines import Document, Place, parse
from interfaces.cell import Cell

P = ParamSpec("P")
T = TypeVar("T")


@dataclass(frozen=True)
class Scenario:
    """A scenario, checked, with the cell and the tree that it names."""

    name: str
    path: Path
    file: ScenarioFile
    cell: Cell
    tree: Path
    overrides: tuple[str, ...] = ()


def load_scenario(name_or_path: str, overrides: Sequence[str] = ()) -> Scenario:
    """Read and check a scenario, its cell and its tree.

    `overrides` are "key.path=value" with YAML values; those that start with "cell." change the cell. Raises `Findings`
    with all that is wrong in any of the three files.
    """
    numbered = list(enumerate(overrides, 1))
    of_cell = [(n, text.removeprefix("cell.")) for n, text in numbered if text.startswith("cell.")]
    path = resolve("scenario", name_or_path, Path())
    found: list[Finding] = []
    document = parse(read_text(path), shown(path))
    _attempt(found, set_.apply, document, [(n, text) for n, text in numbered if not text.startswith("cell.")])
    file = _attempt(found, validated, document, ScenarioFile)
    cell = _attempt(found, _cell, document, path.parent, of_cell)
    tree = _attempt(found, _tree, document, path.parent, cell)
    if file and cell:
        found += _misplaced(document, file, cell)
    if found or not (file and cell and tree):
        raise Findings(found)
    return Scenario(path.stem, path, file, cell, tree, tuple(overrides))


def _attempt(found: list[Finding], make: Callable[P, T], *args: P.args, **kwargs: P.kwargs) -> T | None:
    """What `make` returns; None when it raises findings, which are added to `found`."""
    try:
        return make(*args, **kwargs)
    except Findings as error:
        found += error.items
        return None


def _named(document: Document, key: Literal["cell", "tree"], folder: Path) -> Path | None:
    """The file that the scenario names under `key`; None when the check of the scenario has found no name there."""
    name = document.value.get(key) if isinstance(document.value, dict) else None
    return resolve(key, name, folder, document.place((key,))) if isinstance(name, str) else None


def _cell(document: Document, folder: Path, overrides: list[tuple[int, str]]) -> Cell | None:
    path = _named(document, "cell", folder)
    return load_cell(path, overrides, document.place(("cell",))) if path else None


def load_cell(path: Path, overrides: Sequence[tuple[int, str]] = (), where: Place | None = None) -> Cell:
    """Read and check a cell file under (number, "key.path=value") overrides.

    Raises `Findings`, at `where` (the place that names the cell) when there is no such file.
    """
    document = parse(read_text(path, where), shown(path))
    set_.apply(document, overrides)
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


def _tree(document: Document, folder: Path, cell: Cell | None) -> Path | None:
    path = _named(document, "tree", folder)
    if path is not None:
        names = {"socket": [socket.name for socket in cell.known.sockets]} if cell else None
        check_tree_file(path, document.place(("tree",)), names)
    return path


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


def _misplaced(document: Document, file: ScenarioFile, cell: Cell) -> Iterator[Finding]:
    """Obstacles that share a name, reach below the floor or stand in a piece of the cell."""
    names = [o.name for o in file.obstacles]
    for i, obstacle in enumerate(file.obstacles):
        if names.index(obstacle.name) < i:
            yield Finding(*document.place(("obstacles", i, "name")), f"two obstacles {obstacle.name!r}; rename one")
        for gravity, (x, y, bottom) in (("zero", obstacle.position.zero), ("earth", obstacle.position.earth)):
            place = document.place(("obstacles", i, "position", gravity))
            if bottom - obstacle.jitter[2] < -TOUCHING:
                deep = obstacle.jitter[2] - bottom
                yield Finding(*place, f"obstacle {obstacle.name!r} reaches {deep:.3f} m below the floor; raise it to 0")
            center = np.array([x, y, bottom + 0.5 * obstacle.size[2]])
            for name, depth in overlaps(cell.known, center, obstacle.size, obstacle.yaw_deg, obstacle.jitter):
                message = f"obstacle {obstacle.name!r} reaches {depth:.3f} m into {name}; move it, or jitter it less"
                yield Finding(*place, message)
