"""Grasps of the connector: candidates round its axis, and the first that the arm can reach freely."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cause import CauseCode
from regrasp.motion.failure import PlanningError
from regrasp.motion.planning.straight import straight_line
from regrasp.motion.robots.kinematics import ArmKinematics
from regrasp.motion.robots.spheres import JAW_OPENING
from regrasp.motion.scene.collision import CollisionModel

_OUT_OF_REACH = "out of reach"


@dataclass(frozen=True)
class GraspParameters:
    """The grasp candidates and what they cost."""

    # rad. With a yaw the palm stands on the cable's side and leaves the tip in sight; at 40 degrees, where most of it
    # shows, the cable touches the gripper's bar, 0.04 m behind the pads, as soon as it bends that way.
    preferred_yaw: float = float(np.deg2rad(20.0))
    yaws: tuple[float, ...] = tuple(np.deg2rad([20.0, 10.0, 30.0, 0.0, 40.0, -10.0, -25.0, -40.0]).tolist())  # rad
    rolls: tuple[float, ...] = tuple(np.deg2rad(np.arange(-165, 181, 15)).tolist())  # rad
    max_yaw: float = float(np.deg2rad(50.0))  # rad; beyond, the cable runs into the palm
    roll_cost: float = 0.3  # of a rad of roll, in rad of yaw; choice
    flip_cost: float = 0.01  # rad; choice: orders the two equal halves of a gripper


@dataclass(frozen=True)
class ApproachParameters:
    """The straight approach to a grasp."""

    standoff: float = 0.08  # m back along the tool, where the approach begins; choice
    margin: float = 0.01  # m of clearance at the standoff
    near_margin: float = 0.002  # m of clearance on the way from the standoff to the grasp


@dataclass(frozen=True, eq=False)
class Grasp:
    """A pose of the tool at which the jaws close on the connector; `cost` is in rad off the preferred yaw."""

    world_from_tool: RigidTransform
    cost: float


@dataclass(frozen=True, eq=False)
class GraspChoice:
    """A grasp and the joint paths (k, 6) rad straight in from its standoff.

    There is one path for each branch of the inverse kinematics that works, the nearest to the arm first.
    """

    grasp: Grasp
    paths: tuple[FloatArray, ...]


def grasp_candidates(
    world_from_connector: RigidTransform,
    length: float,
    radius: float,
    grip_offset: float = -0.02,
    shallow: float = 0.0,
    parameters: GraspParameters = GraspParameters(),
) -> list[Grasp]:
    """Grasps of a connector of `length` and `radius` metres (frame at its centre, x from cable to tip), cheapest first.

    The fingers close across the axis, `grip_offset` metres along it from the centre; negative is towards the cable,
    where the tip stays in sight. A yaw (rad) tilts the approach from square to the axis, positive with the palm on the
    cable's side. A roll (rad) turns it about the axis; 0 comes from the arms (along world x as far as the axis lets
    it). The connector lies `shallow` metres nearer to the finger tips than the tool's centre does.

    Raises ValueError if the grip lies off the connector, it does not fit the jaws, or a yaw exceeds `max_yaw`.
    """
    _check_fit(length, radius, grip_offset, parameters)
    axis = world_from_connector.rotation.apply([1.0, 0.0, 0.0])
    centre = world_from_connector.translation + grip_offset * axis
    forward = _perpendicular(axis)
    grasps = []
    for yaw in parameters.yaws:
        for roll in parameters.rolls:
            square = Rotation.from_rotvec(roll * axis).apply(forward)
            x = np.cos(yaw) * square + np.sin(yaw) * axis
            for flip in (1.0, -1.0):
                y = flip * np.cross(axis, square)
                rotation = Rotation.from_matrix(np.column_stack([x, y, np.cross(x, y)]))
                cost = abs(yaw - parameters.preferred_yaw) + parameters.roll_cost * abs(roll)
                cost = cost + parameters.flip_cost * (flip < 0)
                grasps.append(Grasp(RigidTransform.from_components(centre - shallow * x, rotation), cost))
    return sorted(grasps, key=lambda g: g.cost)


def _check_fit(length: float, radius: float, grip_offset: float, parameters: GraspParameters) -> None:
    if abs(grip_offset) > 0.5 * length:
        raise ValueError(f"grip {grip_offset:.3f} m from the centre is off a connector of {length:.3f} m")
    if 2 * radius > JAW_OPENING:
        raise ValueError(f"a connector {2 * radius:.3f} m thick does not fit jaws that open {JAW_OPENING:.3f} m")
    if max(abs(yaw) for yaw in parameters.yaws) > parameters.max_yaw + 1e-9:
        limit, asked = np.rad2deg(parameters.max_yaw), np.rad2deg(parameters.yaws).round(1).tolist()
        raise ValueError(f"yaws go to {limit:.0f} degrees, asked for {asked}")


def choose_grasp(
    kin: ArmKinematics,
    model: CollisionModel,
    q_now: FloatArray,
    candidates: Sequence[Grasp],
    near: CollisionModel | None = None,
    parameters: ApproachParameters = ApproachParameters(),
) -> GraspChoice:
    """The first of the candidates that works: plan to one of its standoffs, then follow the path that begins there.

    `model` must be free at the standoff, and `near` (without the target's own surface; default: `model`) on the
    straight path in. `q_now` (6,) rad orders the branches. Raises PlanningError with a tally of what was wrong with the
    candidates: OUT_OF_REACH when all were, else NO_COLLISION_FREE_GOAL.
    """
    troubles: Counter[str] = Counter()
    for grasp in candidates:
        paths, trouble = _approaches(kin, model, near or model, grasp, parameters)
        if paths:
            paths.sort(key=lambda path: float(np.abs(path[0] - q_now).max()))
            return GraspChoice(grasp, tuple(paths))
        troubles[trouble] += 1
    code = CauseCode.OUT_OF_REACH if set(troubles) <= {_OUT_OF_REACH} else CauseCode.NO_COLLISION_FREE_GOAL
    tally = ", ".join(f"{n} {trouble}" for trouble, n in troubles.most_common())
    raise PlanningError(code, f"{len(candidates)} grasp candidates: {tally}")


def _approaches(
    kin: ArmKinematics, model: CollisionModel, near: CollisionModel, grasp: Grasp, parameters: ApproachParameters
) -> tuple[list[FloatArray], str]:
    """Joint paths from standoff to grasp, one for each branch that works, and what was wrong with the last other."""
    back = grasp.world_from_tool * RigidTransform.from_translation([-parameters.standoff, 0.0, 0.0])
    paths, trouble = [], _OUT_OF_REACH
    for q in kin.ik(grasp.world_from_tool):
        if not near.free(q, parameters.near_margin):
            trouble = f"in collision with {near.nearest(q)[1]}"
            continue
        try:
            path = straight_line(kin, q, back)[::-1]
        except PlanningError:
            trouble = "without a straight way in"
            continue
        if not model.free(path[0], parameters.margin):
            trouble = f"with a standoff too near to {model.nearest(path[0])[1]}"
        elif not near.path_free(path, parameters.near_margin):
            trouble = "with something in the straight way in"
        else:
            paths.append(path)
    return paths, trouble


def _perpendicular(axis: FloatArray) -> FloatArray:
    """Unit vector perpendicular to the axis, the nearest to world x; to world -z for an axis along x."""
    wish = np.array([1.0, 0.0, 0.0]) if abs(axis[0]) < 0.95 else np.array([0.0, 0.0, -1.0])
    across = wish - (wish @ axis) * axis
    unit: FloatArray = across / np.linalg.norm(across)
    return unit
