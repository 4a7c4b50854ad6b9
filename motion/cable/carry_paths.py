"""Joint paths that carry a held connector to a goal, the preferred first."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import chain, product

import numpy as np
from scipy.spatial.transform import RigidTransform

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cable.cell import CableKnown
from regrasp.motion.cable.cable_path import CablePathParameters, natural_paths
from regrasp.motion.planning.straight import straight_lines
from regrasp.motion.robots.kinematics import ArmKinematics
from regrasp.motion.robots.poses import inverse, multiply, poses_between
from regrasp.motion.scene.collision import CollisionModel


@dataclass(frozen=True)
class CarryPathParameters:
    """Which paths are tried."""

    lifts: tuple[float, ...] = (0.0, 0.04, 0.08)  # m that a straight path's middle is raised: obstacles stand on floors
    step: float = 0.02  # m between waypoints; choice: the collision check interpolates between them
    # Paths by search where no other is free, the shortest of which is taken: a long way round winds the cable about the
    # arm. Of eight the shortest took half the way of the first, where the first jammed the arm.
    searched: int = 8
    cable: CablePathParameters = field(default_factory=CablePathParameters)


def carry_paths(
    known: CableKnown,
    kin: ArmKinematics,
    q: FloatArray,
    goals: Sequence[RigidTransform],
    held: RigidTransform,
    parameters: CarryPathParameters = CarryPathParameters(),
) -> Iterator[FloatArray]:
    """Joint paths (k, 6) rad from `q` (6,) to the goals (world_from_tool); `held` is tool_from_connector.

    First along the natural shapes of the cable, then straight or in a flat arch. Whether a path is free is not checked.
    """
    tool, tool_from_connector, ends = kin.tool_matrix(q), held.as_matrix(), [goal.as_matrix() for goal in goals]
    connector_from_tool, connector = inverse(tool_from_connector), multiply(tool, tool_from_connector)
    natural = (
        path @ connector_from_tool
        for end in ends
        for path in natural_paths(known, connector, multiply(end, tool_from_connector), parameters.cable)
    )
    direct = (_arch(tool, end, lift) for end in ends for lift in parameters.lifts)
    for poses in chain(natural, direct):
        path = straight_lines(kin, q, poses, parameters.step)
        if path is not None:
            yield path


def first_free(
    models: Sequence[CollisionModel], margins: Sequence[float], paths: Iterable[FloatArray]
) -> FloatArray | None:
    """The first path that is free in the first model by the first margin (m), else by the next; None if there is none.

    Where a path begins is not checked. Later paths are only taken from `paths` when they are needed.
    """
    taken: list[FloatArray] = []
    source = iter(paths)

    def take() -> Iterator[FloatArray]:
        for path in source:
            taken.append(path)
            yield path

    for model, margin in product(models, margins):
        for path in chain(list(taken), take()):
            if model.path_free(path[1:], margin):
                return path
    return None


def _arch(start: FloatArray, goal: FloatArray, lift: float) -> list[FloatArray]:
    """Poses (4, 4) from start (left out) to goal, through the middle raised by `lift` m if there is any."""
    if not lift:
        return [goal]
    middle = poses_between(start, goal, np.inf, np.inf, 2)[0]
    middle[2, 3] += lift
    return [middle, goal]
