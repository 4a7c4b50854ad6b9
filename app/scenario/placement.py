"""Whether an obstacle, anywhere in its jitter, overlaps something else: boxes, arms, cameras, things of the task."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from pydantic import TypeAdapter

from regrasp.app.files.findings import Finding, Findings
from regrasp.app.files.schema_nodes import value_at
from regrasp.app.files.validation import validated_part
from regrasp.app.files.yaml_lines import Document, Path
from regrasp.app.scenario.sampling import StandParameters
from regrasp.app.scenario.schema import Jitter, ObstacleSize, Yaw
from regrasp.app.scenario.shapes import (
    JitteredBox,
    arm_base,
    cube_depths,
    fixed_cameras,
    half_edges,
    penetration_depth,
    sleeping_arm_cubes,
)
from regrasp.interfaces.cell import Cell, KnownCell
from regrasp.interfaces.fields import Size, Vector
from regrasp.interfaces.quote import cut, quoted
from regrasp.interfaces.scene import GRAVITIES, Gravity

if TYPE_CHECKING:
    from regrasp.app.task.task import Task

_LIST, _TEXT, _YAW = TypeAdapter(list[Any]), TypeAdapter(str), TypeAdapter[float](Yaw)
_SIZE, _JITTER, _POINT = TypeAdapter[Size](ObstacleSize), TypeAdapter[Vector](Jitter), TypeAdapter[Vector](Vector)


@dataclass(frozen=True)
class PlacementParameters:
    """How deep an obstacle may reach into something, metres."""

    rounding: float = 1e-6  # overlap that is rounding


def check_obstacles(
    document: Document,
    cell: Cell | None,
    task: "Task | None",
    parameters: PlacementParameters = PlacementParameters(),
    stands: StandParameters = StandParameters(),  # noqa: B008 - it does not change
) -> None:
    """Raises `Findings`: obstacles that share a name, reach below the floor, or overlap what is in the cell.

    Where a value of an obstacle is wrong, which is a finding elsewhere, the others are still checked.
    """
    if found := list(_misplaced(document, cell, task, parameters, stands)):
        raise Findings(found)


def _misplaced(
    document: Document,
    cell: Cell | None,
    task: "Task | None",
    parameters: PlacementParameters,
    stands: StandParameters,
) -> Iterator[Finding]:
    obstacles = validated_part(document, ("obstacles",), _LIST)
    seen = set()
    drawn = validated_part(document, ("draw", "obstacles"), _LIST) or ()
    kinds = {f"{kind.get('name')}_" for kind in drawn if isinstance(kind, dict)}
    for i in range(len(obstacles or [])):
        here: Path = ("obstacles", i)
        name = validated_part(document, (*here, "name"), _TEXT)
        if name is not None and name in seen:
            yield Finding(*document.place((*here, "name")), f"two obstacles {quoted(name)}; rename one")
        seen.add(name)
        if name is not None and name.rstrip("0123456789") in kinds:
            message = f"obstacle {quoted(name)} bears the name of a drawn one; rename one"
            yield Finding(*document.place((*here, "name")), message)
        who = "obstacle" + (f" {quoted(name)}" if name is not None else "")
        jitter = validated_part(document, (*here, "jitter"), _JITTER) or (0.0, 0.0, 0.0)  # none if it is wrong
        size = validated_part(document, (*here, "size"), _SIZE)
        yaw_deg = validated_part(document, (*here, "yaw_deg"), _YAW, 0.0)
        for path, spot, gravity in _spots(document, here):
            place = document.place(path)
            if (deep := jitter[2] - spot[2]) > parameters.rounding:
                yield Finding(*place, f"{who} reaches {deep:.3f} m below the floor; raise it to 0")
            if size is not None and yaw_deg is not None and cell is not None:
                bottom = JitteredBox(np.array(spot), size, yaw_deg, jitter)
                for what, body, depth in entered(cell, task, gravity, with_stand(bottom, stands), parameters):
                    message = f"{who}{what} reaches {depth:.3f} m into {cut(body)}; move it, or jitter it less"
                    yield Finding(*place, message)


def _spots(document: Document, obstacle: Path) -> Iterator[tuple[Path, Vector, Gravity | None]]:
    """Where an obstacle may stand: the path of the value, the point, and the gravity (None: unknown) that it is for."""
    either = (*obstacle, "position")
    if (spot := validated_part(document, either, _POINT)) is not None:
        gravity = value_at(document.value, ("gravity",))
        yield either, spot, gravity if gravity in ("zero", "earth") else None  # type: ignore[misc]
    for gravity in GRAVITIES:
        if (spot := validated_part(document, (*either, gravity), _POINT)) is not None:
            yield (*either, gravity), spot, gravity


def with_stand(
    piece: JitteredBox,
    stands: StandParameters = StandParameters(),  # noqa: B008 - it does not change
) -> dict[str, JitteredBox]:
    """A piece, whose `center` is here that of its bottom, and its stand if it has one, by what messages call them."""
    x, y, bottom = piece.center.tolist()
    boxes = {"": replace(piece, center=np.array([x, y, bottom + 0.5 * piece.size[2]]))}
    if bottom > stands.min_height:
        post = (stands.edge, stands.edge, bottom)
        boxes[" on its stand"] = replace(piece, center=np.array([x, y, 0.5 * bottom]), size=post)
    return boxes


def entered(
    cell: Cell,
    task: "Task | None",
    gravity: Gravity | None,
    boxes: Mapping[str, JitteredBox],
    parameters: PlacementParameters = PlacementParameters(),
) -> Iterator[tuple[str, str, float]]:
    """Which of the boxes (by name) reaches into which other body, and how deep (m); each body once.

    Without a known gravity (None) what hangs is left out.
    """
    told = set()
    for what, box in boxes.items():
        for body, depth in [
            *overlaps(cell.known, box, parameters),
            *(task.obstacle_overlaps()(cell, box, gravity) if task and task.obstacle_overlaps else ()),
        ]:
            if body not in told:
                yield what, body, depth
            told.add(body)


def overlaps(
    cell: KnownCell, box: JitteredBox, parameters: PlacementParameters = PlacementParameters()
) -> list[tuple[str, float]]:
    """Name and depth (m) of each piece of the cell that the box overlaps, at the place where it does so most."""
    found: dict[str, float] = {}
    boxes = [b for b in cell.boxes if b.center[2] + 0.5 * b.size[2] > 0]  # all that rises above z = 0: not the floor
    pieces = [(b.name, np.array(b.center), half_edges(np.eye(3), b.size)) for b in boxes]
    cameras = [(f"the {name} camera", place, np.zeros((3, 3))) for name, place in fixed_cameras(cell)]  # points
    for name, place, halves in [*pieces, *map(arm_base, cell.arms), *cameras]:
        found[name] = penetration_depth(np.vstack([box.generators, halves]), box.center - place)
    for arm in cell.arms:
        places, halves = sleeping_arm_cubes(arm)
        depths = cube_depths(box.generators, box.center - places, halves)
        found[f"the {arm.name} arm asleep"] = float(depths.max())
    return [(name, depth) for name, depth in found.items() if depth > parameters.rounding]
