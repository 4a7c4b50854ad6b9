"""What the robot of any task knows, as plain values for the record."""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from scipy.spatial.transform import RigidTransform

    from regrasp.behaviors.services import Services


def belief(services: "Services") -> dict[str, Any]:
    """Its arms by their readings, and the obstacles that it has mapped; lengths are rounded to 0.1 mm."""
    motion, names = services.motion, [arm.name for arm in services.known.arms]
    arms = {name: {"joints": motion.joints(name).round(4).tolist(), "tool": pose(motion.tool(name))} for name in names}
    mapped = services.perception.obstacles()
    return {"arms": arms, "occupied_voxels": len(mapped.points) + len(mapped.unseen)}


def pose(value: "RigidTransform") -> dict[str, Any]:
    """A position in metres and a quaternion x, y, z, w."""
    turn = value.rotation.as_quat(canonical=True).round(4).tolist()
    return {"position": value.translation.round(4).tolist(), "quaternion": turn}
