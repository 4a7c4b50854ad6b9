"""How a hand brings the connector that it holds into a clip."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cable.cell import Clip
from regrasp.interfaces.wall_time import counts_as
from regrasp.motion.failure import PlanningError
from regrasp.motion.planning.straight import straight_line
from regrasp.motion.robots.kinematics import ArmKinematics
from regrasp.motion.robots.poses import angle_between
from regrasp.motion.scene.collision import CollisionModel


@dataclass(frozen=True)
class SeatingParameters:
    """Where the hand stops in front of the clip, and how it goes in."""

    # m in front of the clip along the hand's own axis, from where it goes straight in; more would press the cable
    distance: float = 0.025
    margin: float = 0.0  # m of clearance in front of the clip and on the straight path in; choice
    rolls: int = 36  # angles about the connector's axis that are tried; choice: every 10 degrees
    line_step: float = 0.01  # m between the waypoints of the straight path in that is checked; choice
    fine_rolls: int = 361  # angles about the axis from which the roll in the clip is chosen; choice: every degree
    speed_to: float = 0.5  # share of the joints' speed on the way there; choice
    speed_in: float = 0.2  # share of the joints' speed on the way in; choice


@counts_as("planning")
def poses_before(
    models: tuple[CollisionModel, CollisionModel],
    q: FloatArray,
    clip: Clip,
    held: RigidTransform,
    parameters: SeatingParameters = SeatingParameters(),
) -> list[RigidTransform]:
    """Hand poses (world_from_tool) in front of the clip from which a straight path in is free, the best first.

    `models` are the hand's collision models on the way there, with what it holds, and on the way in. It stands at
    joints `q` (6,) rad and holds the connector so (`held`: tool_from_connector). Those poses come first that turn it
    least.
    """
    model, near = models
    kin, margin = model.kinematics, parameters.margin
    goals = []
    for seated in _seated_poses(clip, held, np.linspace(-np.pi, np.pi, parameters.rolls, endpoint=False)):
        before = seated.copy()
        before[:3, 3] -= parameters.distance * seated[:3, 0]
        starts = (start for start in kin.ik(before, q) if model.free(start, margin))
        if any(_straight_in(kin, near, start, seated, margin, parameters.line_step) for start in starts):
            goals.append(before)
    if not goals:
        return []
    now = kin.tool_matrix(q)
    goals.sort(key=lambda pose: angle_between(now, pose))
    return [RigidTransform.from_matrix(pose) for pose in goals]


def _straight_in(
    kin: ArmKinematics, near: CollisionModel, q: FloatArray, seated: FloatArray, margin: float, step: float
) -> bool:
    """Whether a free straight path leads from joints (6,) to the pose (4, 4) that seats the connector."""
    try:
        return near.path_free(straight_line(kin, q, seated, step), margin)
    except PlanningError:
        return False


@counts_as("planning")
def seated_pose(tool: RigidTransform, clip: Clip, held: RigidTransform, rolls: int) -> RigidTransform:
    """world_from_tool that seats the held connector, with the one of so many `rolls` that turns the hand least.

    `tool` is world_from_tool now, `held` is tool_from_connector.
    """
    now = tool.as_matrix()
    poses = _seated_poses(clip, held, np.linspace(-np.pi, np.pi, rolls))
    return RigidTransform.from_matrix(min(poses, key=lambda pose: angle_between(now, pose)))


def _seated_poses(clip: Clip, held: RigidTransform, rolls: FloatArray) -> FloatArray:
    """world_from_tool (n, 4, 4) that seat the connector, `held` (tool_from_connector), turned by `rolls` (n,) rad."""
    turns = np.zeros((len(rolls), 4, 4))
    turns[:, :3, :3] = Rotation.from_euler("x", rolls[:, None]).as_matrix()
    turns[:, 3, 3] = 1.0
    return np.asarray(clip.world_from_seat.as_matrix() @ turns @ held.inv().as_matrix())
