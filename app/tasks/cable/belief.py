"""The robot's belief as plain values, for the record."""

from scipy.spatial.transform import RigidTransform

from regrasp.app.records.result import ArmState, BeliefState, Pose, Sighting
from regrasp.behaviors.services import Services
from regrasp.perception.pose.estimate import Estimate


def belief_state(services: Services) -> BeliefState:
    """What the robot knows now from its cameras and joint readings; lengths are rounded to 0.1 mm."""
    belief, last = services.belief, services.perception.track.last
    return BeliefState(
        held=_pose(belief.held),
        connector=_pose(belief.connector),
        sure=belief.sure,
        found_by=belief.found_by,
        last_seen=None if last is None else _sighting(last),
        arms={name: _arm(services, name) for name in services.motion.arms},
        occupied_voxels=len(services.perception.occupancy.occupied_points()),
        vain_searches=belief.vain_searches,
        notices=tuple((round(notice.at, 6), notice.by) for notice in belief.notices),
    )


def _sighting(seen: Estimate) -> Sighting:
    return Sighting(round(seen.stamp, 3), seen.camera, tuple(seen.position.round(4).tolist()))


def _arm(services: Services, name: str) -> ArmState:
    tool = _pose(services.motion.tool(name))
    assert tool is not None
    return ArmState(tuple(services.motion.joints(name).round(4).tolist()), tool)


def _pose(pose: RigidTransform | None) -> Pose | None:
    if pose is None:
        return None
    turn = pose.rotation.as_quat(canonical=True).round(4).tolist()
    return Pose(tuple(pose.translation.round(4).tolist()), tuple(turn))
