"""Grasps of the connector: candidates round its axis, and the first that the arm can reach freely."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import RigidTransform

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cause import CauseCode
from regrasp.motion.failure import PlanningError
from regrasp.motion.planning.straight import straight_lines
from regrasp.motion.robots.kinematics import ArmKinematics
from regrasp.motion.robots.poses import multiply, rotation_matrix
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
    """A pose (4, 4) of the tool at which the jaws close on the connector; `cost` is in rad off the preferred yaw."""

    pose: FloatArray
    cost: float

    @property
    def world_from_tool(self) -> RigidTransform:
        """The pose as a transform."""
        return RigidTransform.from_matrix(self.pose)


@dataclass(frozen=True, eq=False)
class GraspChoice:
    """A grasp and the joint paths (k, n) straight in from its standoff.

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
    opening: float = np.inf,
) -> list[Grasp]:
    """Grasps of a connector of `length` and `radius` metres (frame at its centre, x from cable to tip), cheapest first.

    The fingers close across the axis, `grip_offset` metres along it from the centre; negative is towards the cable,
    where the tip stays in sight. A yaw (rad) tilts the approach from square to the axis, positive with the palm on the
    cable's side. A roll (rad) turns it about the axis; 0 comes from the arms (along world x as far as the axis lets
    it). The connector lies `shallow` metres nearer to the finger tips than the tool's centre does. The jaws open by
    `opening` metres at most.

    Raises ValueError if the grip lies off the connector, it does not fit the jaws, or a yaw exceeds `max_yaw`.
    """
    _check_fit(length, radius, grip_offset, parameters, opening)
    axis = world_from_connector.rotation.apply([1.0, 0.0, 0.0])
    centre = world_from_connector.translation + grip_offset * axis
    forward = _perpendicular(axis)
    squares = np.array([rotation_matrix(roll * axis) @ forward for roll in parameters.rolls])
    yaws, rolls = np.array(parameters.yaws)[:, None, None], np.array(parameters.rolls)[:, None]
    flips = np.array([1.0, -1.0])
    shape = len(parameters.yaws), len(parameters.rolls), len(flips)
    x = np.broadcast_to((np.cos(yaws) * squares + np.sin(yaws) * axis)[:, :, None], (*shape, 3))
    y = np.broadcast_to(np.cross(axis, squares)[:, None] * flips[:, None], (*shape, 3))
    poses = np.zeros((*shape, 4, 4))
    poses[..., :3, :3] = np.stack([x, y, np.cross(x, y)], axis=-1)
    poses[..., :3, 3] = centre - shallow * x
    poses[..., 3, 3] = 1.0
    costs = np.abs(yaws - parameters.preferred_yaw) + parameters.roll_cost * np.abs(rolls)
    costs = np.broadcast_to(costs + parameters.flip_cost * (flips < 0), shape).ravel()
    flat = poses.reshape(-1, 4, 4)
    return [Grasp(flat[i], float(costs[i])) for i in np.argsort(costs, kind="stable")]


def _check_fit(length: float, radius: float, grip_offset: float, parameters: GraspParameters, opening: float) -> None:
    if abs(grip_offset) > 0.5 * length:
        raise ValueError(f"grip {grip_offset:.3f} m from the centre is off a connector of {length:.3f} m")
    if 2 * radius > opening:
        raise ValueError(f"a connector {2 * radius:.3f} m thick does not fit jaws that open {opening:.3f} m")
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
    straight path in. `q_now` (n,) orders the branches. Raises PlanningError with a tally of what was wrong with the
    candidates: OUT_OF_REACH when all were, else NO_COLLISION_FREE_GOAL.
    """
    ways = WaysIn(kin, parameters.standoff, q_now)
    choice, troubles = first_grasp(ways, model, q_now, candidates, near or model, parameters)
    if choice is None:
        raise no_grasp(troubles)
    return choice


class WaysIn:
    """The joint paths to grasps from their standoffs, each worked out once: they are tried with several margins."""

    def __init__(self, kin: ArmKinematics, standoff: float, near: FloatArray | None) -> None:
        """`near` (n,) is where the arm stands now, see `ArmKinematics.ik`."""
        self._kin, self._standoff, self._near = kin, standoff, near
        self._joints: dict[Grasp, FloatArray] = {}
        self._paths: dict[tuple[Grasp, int], FloatArray | None] = {}

    def joints(self, grasp: Grasp) -> FloatArray:
        """The joints (m, n) at the grasp, one row for each branch of the inverse kinematics."""
        if grasp not in self._joints:
            self._joints[grasp] = self._kin.ik(grasp.pose, self._near)
        return self._joints[grasp]

    def path(self, grasp: Grasp, branch: int) -> FloatArray | None:
        """The path (k, n) straight in to row `branch` of `joints`, None if there is none."""
        if (grasp, branch) not in self._paths:
            back = np.eye(4)
            back[0, 3] = -self._standoff
            path = straight_lines(self._kin, self.joints(grasp)[branch], [multiply(grasp.pose, back)])
            self._paths[grasp, branch] = None if path is None else path[::-1]
        return self._paths[grasp, branch]


class Trouble(NamedTuple):
    """What is wrong with a candidate: a phrase with a place for what stands at `q` (n,) too near in `model`."""

    phrase: str
    model: CollisionModel | None = None
    q: FloatArray | None = None

    def __str__(self) -> str:
        known = self.model is not None and self.q is not None
        return self.phrase.format(self.model.nearest(self.q)[1]) if known else self.phrase  # type: ignore[union-attr,arg-type]


def first_grasp(
    ways: WaysIn,
    model: CollisionModel,
    q_now: FloatArray,
    candidates: Sequence[Grasp],
    near: CollisionModel,
    parameters: ApproachParameters,
) -> tuple[GraspChoice | None, list[Trouble]]:
    """`choose_grasp` without an exception: the first candidate that works, and what was wrong with those before it."""
    troubles: list[Trouble] = []
    for grasp in candidates:
        paths, trouble = _approaches(ways, model, near, grasp, parameters)
        if paths:
            paths.sort(key=lambda path: float(np.abs(path[0] - q_now).max()))
            return GraspChoice(grasp, tuple(paths)), troubles
        troubles.append(trouble)
    return None, troubles


def no_grasp(troubles: Sequence[Trouble]) -> PlanningError:
    """The error with a tally of what was wrong with all candidates."""
    tally = Counter(map(str, troubles))
    code = CauseCode.OUT_OF_REACH if set(tally) <= {_OUT_OF_REACH} else CauseCode.NO_COLLISION_FREE_GOAL
    said = ", ".join(f"{n} {trouble}" for trouble, n in tally.most_common())
    return PlanningError(code, f"{len(troubles)} grasp candidates: {said}")


def _approaches(
    ways: WaysIn, model: CollisionModel, near: CollisionModel, grasp: Grasp, parameters: ApproachParameters
) -> tuple[list[FloatArray], Trouble]:
    """Joint paths from standoff to grasp, one for each branch that works, and what was wrong with the last other."""
    paths, trouble = [], Trouble(_OUT_OF_REACH)
    for branch, q in enumerate(ways.joints(grasp)):
        if not near.free(q, parameters.near_margin):
            trouble = Trouble("in collision with {}", near, q)
            continue
        path = ways.path(grasp, branch)
        if path is None:
            trouble = Trouble("without a straight way in")
        elif not model.free(path[0], parameters.margin):
            trouble = Trouble("with a standoff too near to {}", model, path[0])
        elif not near.path_free(path, parameters.near_margin):
            trouble = Trouble("with something in the straight way in")
        else:
            paths.append(path)
    return paths, trouble


def _perpendicular(axis: FloatArray) -> FloatArray:
    """Unit vector perpendicular to the axis, the nearest to world x; to world -z for an axis along x."""
    wish = np.array([1.0, 0.0, 0.0]) if abs(axis[0]) < 0.95 else np.array([0.0, 0.0, -1.0])
    across = wish - (wish @ axis) * axis
    unit: FloatArray = across / np.linalg.norm(across)
    return unit
