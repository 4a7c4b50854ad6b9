"""How a hand brings the connector that it holds into a clip."""

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
from regrasp.motion.scene.planning_scene import PlanningScene


@counts_as("planning")
def poses_before(
    scene: PlanningScene, arm: str, held: RigidTransform, *, distance: float, rolls: int, margin: float, step: float
) -> list[RigidTransform]:
    """Hand poses (world_from_tool) `distance` m in front of the clip from which a straight path in is free.

    `held` is tool_from_connector. So many `rolls` about the connector's axis are tried; those that turn the hand least
    come first. `margin` m of clearance is kept, at waypoints of the straight path every `step` m.
    """
    model, near = scene.model(arm, held=held), scene.model(arm, clip=False)
    kin = scene.kinematics[arm]
    goals = []
    for seated in _seated_poses(scene.known.cable.clip, held, np.linspace(-np.pi, np.pi, rolls, endpoint=False)):
        before = seated.copy()
        before[:3, 3] -= distance * seated[:3, 0]
        starts = (q for q in kin.ik(before) if model.free(q, margin))
        if any(_straight_in(kin, near, q, seated, margin, step) for q in starts):
            goals.append(before)
    if not goals:
        return []
    now = kin.tool_matrix(scene.joints(arm))
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


def pose_in_hand(seen: RigidTransform, held: RigidTransform, *, whole: bool) -> RigidTransform:
    """tool_from_connector of a connector that was `held` so and is now `seen` so, the `whole` of it or a part."""
    if connector_axis(seen) @ connector_axis(held) < 0:  # a finger was taken for the cable: none turns round in a jaw
        seen = seen * RigidTransform.from_rotation(Rotation.from_euler("z", 180, degrees=True))
    return seen if whole else _turned_in_the_jaw(held, seen)


def _turned_in_the_jaw(held: RigidTransform, seen: RigidTransform) -> RigidTransform:
    """tool_from_connector when only a part of the connector is `seen`: its axis is known, its centre on it is not.

    A cable turns the connector between the pads and does not draw it through. So the pads stay at the place along the
    connector where they are by `held`.
    """
    axis = connector_axis(seen)
    nearest = seen.translation - (seen.translation @ axis) * axis
    pads_at = -float(held.translation @ connector_axis(held))
    return RigidTransform.from_components(nearest - pads_at * axis, seen.rotation)


def connector_axis(pose: RigidTransform) -> FloatArray:
    """The connector's axis (3,), from cable to tip, in the pose's target frame."""
    return np.asarray(pose.rotation.apply([1.0, 0.0, 0.0]))
