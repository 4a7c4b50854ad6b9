"""How to take hold of the connector: candidates round its axis, and the first that the arm can reach freely."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation

from regrasp.interfaces.cause import CauseCode
from regrasp.motion.failure import PlanningError
from regrasp.motion.planning.straight import straight_line
from regrasp.motion.robots.kinematics import ArmKinematics, FloatArray
from regrasp.motion.robots.spheres import JAW_OPENING
from regrasp.motion.scene.collision import CollisionModel

# The palm off the cross direction, on the cable's side, leaves the tip in sight; at 40 degrees, where most of it shows,
# the cable touches the gripper's bar, 0.04 behind the pads, as soon as it bends that way.
PREFERRED_YAW = float(np.deg2rad(20.0))
YAWS = tuple(np.deg2rad([20.0, 10.0, 30.0, 0.0, 40.0, -10.0, -25.0, -40.0]).tolist())
ROLLS = tuple(np.deg2rad(np.arange(-165, 181, 15)).tolist())
_MOST_YAW = np.deg2rad(50.0)  # beyond, the cable runs into the palm
GRIP_OFFSET = -0.02  # metres from the connector's centre: on the cable's side, the tip stays in sight
_ROLL_COST = 0.3  # of a rad of roll, in rad of yaw
_FAR = "out of reach"
_FLIP_COST = 0.01  # orders the two equal halves of a gripper


@dataclass(frozen=True, eq=False)
class Grasp:
    """A pose of the tool at which the jaws close on the connector; `cost` in rad off the preferred yaw."""

    world_from_tool: RigidTransform
    cost: float


@dataclass(frozen=True, eq=False)
class GraspChoice:
    """A grasp and joint paths (k, 6) rad to it, one a branch, nearest first: straight in from the standoff."""

    grasp: Grasp
    paths: tuple[FloatArray, ...]

    @property
    def standoffs(self) -> FloatArray:
        """Where the paths begin, (n, 6) rad: goals for a planner."""
        return np.array([path[0] for path in self.paths])


def grasp_candidates(
    world_from_connector: RigidTransform,
    length: float,
    radius: float,
    grip_offset: float = GRIP_OFFSET,
    yaws: Sequence[float] = YAWS,
    rolls: Sequence[float] = ROLLS,
    shallow: float = 0.0,
) -> list[Grasp]:
    """Grasps of a connector of `length` and `radius` metres (frame at its centre, x from cable to tip), cheapest first.

    The fingers close across the axis, `grip_offset` metres along it from the centre (negative: towards the cable).
    `yaws` rad tilt the approach from square to the axis, positive with the palm on the cable's side. `rolls` rad turn
    it about the axis; 0 comes from the arms (along world x as far as the axis lets it). `shallow` metres is by how much
    the connector lies nearer to the finger tips than the tool's centre.

    Raises ValueError if the grip lies off the connector, it does not fit the jaws, or a yaw exceeds 50 degrees.
    """
    if abs(grip_offset) > 0.5 * length:
        raise ValueError(f"grip {grip_offset:.3f} m from the centre is off a connector of {length:.3f} m")
    if 2 * radius > JAW_OPENING:
        raise ValueError(f"a connector {2 * radius:.3f} m thick does not fit jaws that open {JAW_OPENING:.3f} m")
    if max(abs(yaw) for yaw in yaws) > _MOST_YAW + 1e-9:
        raise ValueError(
            f"yaws go to {np.rad2deg(_MOST_YAW):.0f} degrees, asked for {np.rad2deg(yaws).round(1).tolist()}"
        )
    axis = world_from_connector.rotation.apply([1.0, 0.0, 0.0])
    centre = world_from_connector.translation + grip_offset * axis
    forward = _square_to(axis)
    grasps = []
    for yaw in yaws:
        for roll in rolls:
            square = Rotation.from_rotvec(roll * axis).apply(forward)
            x = np.cos(yaw) * square + np.sin(yaw) * axis
            for flip in (1.0, -1.0):
                y = flip * np.cross(axis, square)
                rotation = Rotation.from_matrix(np.column_stack([x, y, np.cross(x, y)]))
                cost = abs(yaw - PREFERRED_YAW) + _ROLL_COST * abs(roll) + _FLIP_COST * (flip < 0)
                grasps.append(Grasp(RigidTransform.from_components(centre - shallow * x, rotation), cost))
    return sorted(grasps, key=lambda g: g.cost)


def choose_grasp(
    kin: ArmKinematics,
    model: CollisionModel,
    q_now: FloatArray,
    candidates: Sequence[Grasp],
    standoff: float = 0.08,
    margin: float = 0.01,
    near: CollisionModel | None = None,
    near_margin: float = 0.002,
) -> GraspChoice:
    """The cheapest candidate that works: plan to one of its standoffs, then follow the path that begins there.

    At the standoff, `standoff` metres back along the tool, `model` must be free by `margin` metres; on the straight way
    in, `near` (without the target's own surface; default: `model`) by `near_margin`. `q_now` (6,) rad orders the
    branches. Raises PlanningError with a tally of what was wrong with the candidates.
    """
    troubles: Counter[str] = Counter()
    for grasp in candidates:
        paths, trouble = _ways_in(kin, model, near or model, grasp, standoff, margin, near_margin)
        if paths:
            paths.sort(key=lambda path: float(np.abs(path[0] - q_now).max()))
            return GraspChoice(grasp, tuple(paths))
        troubles[trouble] += 1
    code = CauseCode.OUT_OF_REACH if set(troubles) <= {_FAR} else CauseCode.NO_COLLISION_FREE_GOAL
    tally = ", ".join(f"{n} {trouble}" for trouble, n in troubles.most_common())
    raise PlanningError(code, f"{len(candidates)} grasp candidates: {tally}")


def _ways_in(
    kin: ArmKinematics,
    model: CollisionModel,
    near: CollisionModel,
    grasp: Grasp,
    standoff: float,
    margin: float,
    near_margin: float,
) -> tuple[list[FloatArray], str]:
    """Joint paths from standoff to grasp, one for each branch that works, and what was wrong with the last other."""
    back = grasp.world_from_tool * RigidTransform.from_translation([-standoff, 0.0, 0.0])
    paths, trouble = [], _FAR
    for q in kin.ik(grasp.world_from_tool):
        if not near.free(q, near_margin):
            trouble = f"in collision with {near.nearest(q)[1]}"
            continue
        try:
            path = straight_line(kin, q, back)[::-1]
        except PlanningError:
            trouble = "without a straight way in"
            continue
        if not model.free(path[0], margin):
            trouble = f"with a standoff too near to {model.nearest(path[0])[1]}"
        elif not near.path_free(path, near_margin):
            trouble = "with something in the straight way in"
        else:
            paths.append(path)
    return paths, trouble


def _square_to(axis: FloatArray) -> FloatArray:
    """Unit vector square to the axis and nearest to world x; nearest to world -z for an axis along x."""
    wish = np.array([1.0, 0.0, 0.0]) if abs(axis[0]) < 0.95 else np.array([0.0, 0.0, -1.0])
    square = wish - (wish @ axis) * axis
    unit: FloatArray = square / np.linalg.norm(square)
    return unit
