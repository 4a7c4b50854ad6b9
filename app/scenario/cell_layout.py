"""Checks of any cell's layout: parts that overlap, joints past their limits."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import NamedTuple

import numpy as np

from regrasp.app.files.findings import Finding
from regrasp.app.files.yaml_lines import Document, Path
from regrasp.app.scenario.shapes import (
    arm_base,
    cube_depths,
    fixed_cameras,
    half_edges,
    penetration_depth,
    sleeping_arm_cubes,
)
from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cell import ArmSpec, Box, KnownCell
from regrasp.interfaces.quote import cut


@dataclass(frozen=True)
class CellLayoutParameters:
    """How deep the parts of a cell may reach into one another, metres."""

    overlap: float = 0.005  # the spheres that fill an arm stand out of it by less


class Part(NamedTuple):
    """A body that does not move: where the file says so, name, centre (3,) and half edges (3, 3), metres."""

    path: Path
    name: str
    center: FloatArray
    halves: FloatArray


def bases_in_one_place(
    document: Document, known: KnownCell, parameters: CellLayoutParameters = CellLayoutParameters()
) -> Iterator[Finding]:
    """Arms whose bases stand in each other: a line a pair. Much else that seems wrong then follows from it."""
    for below, part in combinations(arm_bases(known), 2):
        depth = _base_depth(part, below)
        if depth > parameters.overlap:
            yield reaches(document, part, depth, below.name)


def layout_findings(
    document: Document, known: KnownCell, parameters: CellLayoutParameters = CellLayoutParameters()
) -> list[Finding]:
    """What is wrong with a cell although each of its values is right by itself, but for `bases_in_one_place`."""
    bases = arm_bases(known)
    found = [
        *_joints(document, known),
        *overlap_findings(document, known, [*box_parts(("known", "boxes"), known.boxes), *bases], parameters),
    ]
    if (depth := _between_the_arms(known)) > parameters.overlap:
        message = f"the arms asleep reach {depth:.3f} m into each other; change their sleep or their bases"
        found.append(Finding(*document.place(("known", "arms")), message))
    return found


def overlap_findings(
    document: Document,
    known: KnownCell,
    parts: Sequence[Part],
    parameters: CellLayoutParameters = CellLayoutParameters(),
) -> Iterator[Finding]:
    """Arms and cameras in these parts of the cell."""
    asleep = [sleeping_arm_cubes(arm) for arm in known.arms]
    for part in parts:
        for name, depth in _inside(known, part, asleep):
            if depth > parameters.overlap:
                yield reaches(document, part, depth, name)
    for name, place in fixed_cameras(known):
        for part in parts:
            if penetration_depth(part.halves, place - part.center) > 0:
                message = f"the {name} camera is inside {cut(part.name)}; move one of them"
                yield Finding(*document.place(part.path), message)


def reaches(document: Document, part: Part, depth: float, name: str) -> Finding:
    """The finding that a part reaches `depth` m into the body of that name."""
    return Finding(*document.place(part.path), f"{cut(part.name)} reaches {depth:.3f} m into {name}; move one of them")


def _joints(document: Document, known: KnownCell) -> Iterator[Finding]:
    for i, arm in enumerate(known.arms):
        chain = arm.robot.chain
        for j, (angle, low, high) in enumerate(zip(arm.sleep, chain.lower, chain.upper, strict=True)):
            if not low <= angle <= high:
                unit = "m" if chain.slides[j] else "rad"
                told = f"{angle:g} {unit} is past the limits of the {arm.name} arm's {chain.names[j]}; "
                inside = f"write one from {np.ceil(100 * low) / 100:.2f} to {np.floor(100 * high) / 100:.2f}"
                yield Finding(*document.place(("known", "arms", i, "sleep", j)), told + inside)


def _between_the_arms(known: KnownCell) -> float:
    """How deep (m) the arms asleep reach into each other, by the spheres that fill their moving links."""
    bodies = [(centers, np.sqrt(3) * halves) for centers, halves in map(sleeping_arm_cubes, known.arms)]
    deepest = [
        float((r[:, None] + s[None] - np.linalg.norm(a[:, None] - b[None], axis=2)).max(initial=0.0))
        for (a, r), (b, s) in combinations(bodies, 2)
    ]
    return max(deepest, default=0.0)


def _inside(
    known: KnownCell, part: Part, asleep: Sequence[tuple[FloatArray, FloatArray]]
) -> Iterator[tuple[str, float]]:
    """The arms that a part may stand in, with the depth (m) that it reaches into each.

    `asleep` are the cubes of `sleeping_arm_cubes` for each arm.
    """
    for arm, base, (centers, halves) in zip(known.arms, arm_bases(known), asleep, strict=True):
        if part.path == base.path:
            continue
        if part.path[1] != "arms":
            yield base.name, _base_depth(part, base)
        yield f"the {arm.name} arm asleep", float(cube_depths(part.halves, part.center - centers, halves).max())


def _base_depth(part: Part, base: Part) -> float:
    return penetration_depth(np.vstack([part.halves, base.halves]), part.center - base.center)


def arm_bases(known: KnownCell) -> list[Part]:
    """The arms' bases."""
    return [Part(("known", "arms", i), *arm_base(arm)) for i, arm in enumerate(known.arms)]


def box_parts(path: Path, boxes: Sequence[Box]) -> list[Part]:
    """Boxes that the file holds as a list at `path`."""
    return [
        Part((*path, i), box.name, np.array(box.center), half_edges(np.eye(3), box.size)) for i, box in enumerate(boxes)
    ]


def out_of_reach(arm: ArmSpec, place: FloatArray) -> str | None:
    """How far a place (3,) m is from an arm's shoulder, in words, if that is further than its links; None if not.

    The shoulder of an arm on a rail is where the rail brings it nearest.
    """
    chain, rail = arm.robot.chain, arm.robot.rail
    first = int(rail is not None)
    shoulder = arm.world_from_base.apply(chain.origins[: first + 2].sum(axis=0))
    if rail is not None:
        axis = arm.world_from_base.rotation.apply(np.eye(3)["xyz".index(rail.axis)])
        shoulder = shoulder + axis * np.clip((place - shoulder) @ axis, rail.lower, rail.upper)
    reach = float(
        np.linalg.norm(chain.origins[first + 2 :], axis=1).sum() + np.linalg.norm(chain.last_from_tool[:3, 3])
    )
    way = float(np.linalg.norm(place - shoulder))
    if way <= reach:
        return None
    return f"{way:.2f} m from the {arm.name} arm's shoulder, which reaches {reach:.2f} m"
