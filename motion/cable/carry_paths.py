"""Joint paths that carry a held connector to a goal, the preferred first."""

from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import chain, product

import numpy as np
from scipy.spatial.transform import RigidTransform

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cable.cell import CableKnown
from regrasp.motion.cable.cable_path import (
    CablePathParameters,
    deflection,
    lifted,
    natural_path,
    natural_paths,
    natural_poses,
)
from regrasp.motion.cable.natural_routes import NaturalRouteParameters, NaturalRoutes
from regrasp.motion.planning.straight import straight_lines
from regrasp.motion.robots.kinematics import ArmKinematics
from regrasp.motion.robots.poses import inverse, multiply, poses_between
from regrasp.motion.scene.collision import Clearances, CollisionModel


@dataclass(frozen=True)
class CarryPathParameters:
    """Which paths are tried."""

    lifts: tuple[float, ...] = (0.0, 0.04, 0.08)  # m that a straight path's middle is raised: obstacles stand on floors
    step: float = 0.02  # m between waypoints; choice: the collision check interpolates between them
    # Paths by search where no other is free, the shortest of which is taken: a long way round winds the cable about the
    # arm. Of eight the shortest took half the way of the first, where the first jammed the arm.
    searched: int = 8
    # m by which the connector is first taken back the way that the hand came, without turning it; choice
    lifted: tuple[float, ...] = (0.0, 0.03, 0.06)
    # m of the tool's way in which it may be as near to things as where it begins: a hand that took hold beside an
    # obstacle first goes away from it; choice
    leaving: float = 0.03
    per_step: int = 16  # paths tried in a tick; choice: 50 ms
    routed: int = 3  # goals, the first, to which routes are searched on the grid of natural shapes; choice
    routes: NaturalRouteParameters = field(default_factory=NaturalRouteParameters)
    cable: CablePathParameters = field(default_factory=CablePathParameters)


def carry_paths(
    known: CableKnown,
    kin: ArmKinematics,
    q: FloatArray,
    goals: Sequence[RigidTransform],
    held: RigidTransform,
    routes: NaturalRoutes,
    arm_free: Callable[[FloatArray], bool],
    parameters: CarryPathParameters = CarryPathParameters(),
) -> Iterator[FloatArray | None]:
    """Joint paths (k, n) from `q` (n,) to the goals (world_from_tool); `held` is tool_from_connector.

    First along the natural shapes of the cable, at once or when the connector is lifted: directly, in a plain detour,
    or by the `routes`. Then straight or in a flat arch. `arm_free`: whether the arm is free with its tool at a pose
    (4, 4). Whether a path is free is not checked. None comes after as much work as a tick should wait for.
    """
    tool, tool_from_connector, ends = kin.tool_matrix(q), held.as_matrix(), [goal.as_matrix() for goal in goals]
    connector_from_tool, connector = inverse(tool_from_connector), multiply(tool, tool_from_connector)
    goals_of = [multiply(end, tool_from_connector) for end in ends]
    starts = [
        lifted(known, connector, -distance * tool[:3, 0], parameters=parameters.cable) for distance in parameters.lifted
    ]
    natural = (
        np.concatenate([lift, path]) @ connector_from_tool
        for lift in starts
        for goal in goals_of
        for path in natural_paths(known, lift[-1], goal, parameters.cable)
    )
    routed = (
        None if path is None else np.concatenate([lift, path]) @ connector_from_tool
        for lift in starts
        for goal in goals_of[: parameters.routed]
        for path in chain(
            _routed(known, lift[-1], goal, connector_from_tool, routes, arm_free, parameters.cable), [None]
        )
    )
    direct = (_arch(tool, end, lift) for end in ends for lift in parameters.lifts)
    for tried, poses in enumerate(chain(natural, routed, direct), 1):
        path = None if poses is None else straight_lines(kin, q, poses, parameters.step)
        if path is not None:
            yield path
        if poses is None or tried % parameters.per_step == 0:
            yield None


def first_free(
    models: Sequence[CollisionModel], clearances: Clearances, leaving: float, paths: Iterable[FloatArray | None]
) -> Generator[None, None, FloatArray | None]:
    """Steps that find the first path that is free in the first model by the first near margin, else by the next.

    They return None where there is none. In the first `leaving` m of the tool's way a path may be as near to things as
    where it begins. Later paths are only taken from `paths` when they are needed; a step ends at each None among them,
    and when all were tried with a margin.
    """
    taken: list[FloatArray] = []
    source = iter(paths)
    for model, margin in product(models, clearances.near_margins):
        for path in taken:
            if _keeps(model, path, margin, clearances.nearer, leaving):
                return path
        for new in source:
            if new is None:
                yield
                continue
            if _keeps(model, new, margin, clearances.nearer, leaving):
                return new
            taken.append(new)
        yield
    return None


def _keeps(model: CollisionModel, path: FloatArray, margin: float, nearer: float, leaving: float) -> bool:
    """Whether a joint path (k, n) keeps the margin, or at first what it has where it begins, less `nearer`."""
    begins = model.clearance(path[0]) - nearer
    left = 0 if begins >= margin else _left(model.kinematics, path, leaving)
    return model.path_free(path[left:], margin) and model.path_free(path[: left + 1], min(begins, margin))


def _left(kin: ArmKinematics, path: FloatArray, distance: float) -> int:
    """The first row of a joint path (k, n) where the tool is `distance` m from where it begins, or the last row."""
    places = np.array([kin.tool_matrix(q)[:3, 3] for q in path])
    return int(np.argmax(np.linalg.norm(places - places[0], axis=1) >= distance)) or len(path) - 1


def _routed(
    known: CableKnown,
    start: FloatArray,
    goal: FloatArray,
    connector_from_tool: FloatArray,
    routes: NaturalRoutes,
    arm_free: Callable[[FloatArray], bool],
    parameters: CablePathParameters,
) -> Iterator[FloatArray]:
    """Paths (n, 4, 4) of the connector from `start` to `goal` (4, 4) by the routes."""
    begin, end = deflection(known, start), deflection(known, goal)
    turned = []
    for natural, pose in zip(natural_poses(known, np.array([begin, end])), (start, goal), strict=True):
        turn = np.eye(4)
        turn[:3, :3] = natural[:3, :3].T @ pose[:3, :3]
        turned.append(turn @ connector_from_tool)

    def connector_free(pose: FloatArray) -> bool:
        return any(arm_free(pose @ tool) for tool in turned)

    for route in routes.routes(begin, end, connector_free):
        yield natural_path(known, start, goal, route, parameters)


def _arch(start: FloatArray, goal: FloatArray, lift: float) -> list[FloatArray]:
    """Poses (4, 4) from start (left out) to goal, through the middle raised by `lift` m if there is any."""
    if not lift:
        return [goal]
    middle = poses_between(start, goal, np.inf, np.inf, 2)[0]
    middle[2, 3] += lift
    return [middle, goal]
