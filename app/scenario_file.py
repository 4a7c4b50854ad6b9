"""Scenario files: which cell, which tree, what goes wrong, and what must come out."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal, ParamSpec, Self, TypeVar

import numpy as np
from pydantic import Field, model_validator

from app import overrides as set_
from app.findings import Finding, Findings, nearest, shown
from app.placement import TOUCHING, overlaps
from app.resources import read_text, resolve
from app.schema import validated
from app.yaml_lines import Document, Place, parse
from interfaces.cause import CauseCode
from interfaces.cell import Cell, Color, Fraction, Model, NotNegative, Vector
from interfaces.scene import Gravity

P = ParamSpec("P")
T = TypeVar("T")
Outcome = Literal["stowed", "safe_stop"]
Edge = Annotated[float, Field(gt=0, le=3)]  # metres
Reach = Annotated[float, Field(ge=0, le=1)]  # metres


class ByGravity(Model):
    """A point (m, world frame) for each gravity: the loose end settles elsewhere when it hangs."""

    zero: Vector
    earth: Vector


class ObstacleSpec(Model):
    """A foam block that the robot is not told about; one that does not stand on the floor is held by a thin stand."""

    name: str
    size: tuple[Edge, Edge, Edge]  # along x, y, z before it is turned
    color: Color = (0.5, 0.2, 0.6)
    position: ByGravity  # centre in x and y, bottom in z
    yaw_deg: Annotated[float, Field(ge=-360, le=360)] = 0.0
    jitter: tuple[Reach, Reach, Reach] = (0.0, 0.0, 0.0)  # uniform, to both sides, drawn from the seed


class JawOpensSpec(Model):
    """The jaw opens for `seconds` at a share of the way from socket to clip, drawn from the seed within `carried`."""

    type: Literal["jaw_opens"]
    carried: tuple[Fraction, Fraction]
    seconds: Annotated[float, Field(gt=0, le=60)] = 1.0

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        if self.carried[0] > self.carried[1]:
            raise ValueError("carried runs backwards; put the smaller share first, such as [0.3, 0.8]")
        return self


class Limits(Model):
    """What ends a run that does not end by itself."""

    sim_seconds: Annotated[float, Field(gt=0, le=3600)] = 600.0
    tries: Annotated[int, Field(ge=1, le=20)] = 5  # deliveries, each after a recovery where the hand is empty


class Expect(Model):
    """What must come out; None is not looked at."""

    outcome: Outcome = "stowed"
    slips: Annotated[int, Field(ge=0, le=20)] | None = None  # real losses that were noticed
    hidden: bool | None = None  # settled out of the rear camera's sight and found by the wrist camera
    unintended_force: NotNegative | None = None  # newtons at most
    cause: CauseCode | None = None

    @model_validator(mode="after")
    def _cause_of_a_stop(self) -> Self:
        if self.cause is not None and self.outcome == "stowed":
            raise ValueError("a run that ends stowed has no cause; write outcome: safe_stop beside cause")
        return self


class ScenarioFile(Model):
    """A scenario file as written."""

    description: str
    cell: str  # a shipped cell's name, or a path from this file's folder
    tree: str  # likewise
    gravity: Gravity
    obstacles: tuple[ObstacleSpec, ...] = ()
    faults: tuple[JawOpensSpec, ...] = ()
    limits: Limits = Limits()
    expect: Expect = Expect()


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
    tree = _attempt(found, _tree, document, path.parent)
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


def _tree(document: Document, folder: Path) -> Path | None:
    path = _named(document, "tree", folder)
    if path is not None:
        check_tree_file(path, document.place(("tree",)))
    return path


def check_tree_file(path: Path, where: Place | None = None) -> None:
    """Raises `Findings` for all that is wrong in a tree file; at `where`, which names it, when there is none."""
    read_text(path, where)
    from trees import check_tree  # the leaves bring the planner and the compiler with them: seconds

    found = [Finding(shown(path), line, message) for line, message in check_tree(path)]
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
