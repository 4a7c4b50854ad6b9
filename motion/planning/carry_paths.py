"""Joint paths that carry a held connector to a goal, the preferred first."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import chain, product

from scipy.spatial.transform import RigidTransform, Rotation, Slerp

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cell import KnownCell
from regrasp.motion.planning.cable_path import CablePathParameters, natural_paths
from regrasp.motion.planning.straight import straight_lines
from regrasp.motion.robots.kinematics import ArmKinematics
from regrasp.motion.scene.collision import CollisionModel


@dataclass(frozen=True)
class CarryPathParameters:
    """Which paths are tried."""

    lifts: tuple[float, ...] = (0.0, 0.04, 0.08)  # m that a straight path's middle is raised: obstacles stand on floors
    step: float = 0.02  # m between waypoints; choice: the collision check interpolates between them
    cable: CablePathParameters = field(default_factory=CablePathParameters)


def carry_paths(
    known: KnownCell,
    kin: ArmKinematics,
    q: FloatArray,
    goals: Sequence[RigidTransform],
    held: RigidTransform,
    parameters: CarryPathParameters = CarryPathParameters(),
) -> Iterator[FloatArray]:
    """Joint paths (k, 6) rad from `q` (6,) to the goals (world_from_tool); `held` is tool_from_connector.

    First along the natural shapes of the cable, then straight or in a flat arch. Whether a path is free is not checked.
    """
    tool, connector_from_tool = kin.tool(q), held.inv()
    natural = (
        [pose * connector_from_tool for pose in path]
        for goal in goals
        for path in natural_paths(known, tool * held, goal * held, parameters.cable)
    )
    direct = (_arch(tool, goal, lift) for goal in goals for lift in parameters.lifts)
    for poses in chain(natural, direct):
        path = straight_lines(kin, q, poses, parameters.step)
        if path is not None:
            yield path


def can_continue(kin: ArmKinematics, q: FloatArray, onward: Sequence[RigidTransform], step: float = 0.02) -> bool:
    """Whether the tool at joints (6,) can go on in straight lines to the poses `onward`, given in its own frame."""
    tool = kin.tool(q)
    return straight_lines(kin, q, [tool * pose for pose in onward], step) is not None


def first_free(
    models: Sequence[CollisionModel], margins: Sequence[float], paths: Sequence[FloatArray]
) -> FloatArray | None:
    """The first path that is free in the first model by the first margin (m), else by the next; None if there is none.

    Where a path begins is not checked.
    """
    for model, margin in product(models, margins):
        for path in paths:
            if model.path_free(path[1:], margin):
                return path
    return None


def _arch(start: RigidTransform, goal: RigidTransform, lift: float) -> list[RigidTransform]:
    """Poses from start (left out) to goal, through the middle raised by `lift` m if there is any."""
    if not lift:
        return [goal]
    middle = 0.5 * (start.translation + goal.translation) + [0.0, 0.0, lift]
    turn = Slerp([0.0, 1.0], Rotation.concatenate([start.rotation, goal.rotation]))(0.5)
    return [RigidTransform.from_components(middle, turn), goal]
