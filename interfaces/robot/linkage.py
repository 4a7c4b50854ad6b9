"""How the fingers of a linkage gripper open with its driven joint."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.quote import nearest, quoted
from regrasp.interfaces.robot.parts import LinkageGripper
from regrasp.interfaces.robot.urdf import RobotError, UrdfTree

_OPENINGS = 201  # places at which a linkage's opening is worked out; between them it is interpolated


@dataclass(frozen=True, eq=False)
class Linkage:
    """A linkage gripper's `openings` (k,) m, falling, over its driven joint's `driven` positions (k,) rad."""

    driven: FloatArray
    openings: FloatArray
    followers: dict[str, tuple[float, float]]  # multiplier and offset of each joint, the driven one with (1, 0)

    @classmethod
    def of(cls, tree: UrdfTree, gripper: LinkageGripper) -> "Linkage":
        """Raises RobotError: the URDF lacks the joint or a pad, or the jaw does not close."""
        if gripper.joint not in tree.joints:
            right = nearest(gripper.joint, list(tree.joints))
            raise RobotError(("gripper", "joint"), f"the URDF has no joint {quoted(gripper.joint)}; {right}")
        for side, pad in enumerate(gripper.pads):
            if pad not in tree.links:
                right = nearest(pad, tree.links)
                raise RobotError(("gripper", "pads", side), f"the URDF has no link {quoted(pad)}; {right}")
        followers = {
            name: joint.mimic[1:]
            for name, joint in tree.joints.items()
            if joint.mimic is not None and joint.mimic[0] == gripper.joint
        }
        followers[gripper.joint] = (1.0, 0.0)
        limits = tree.joints[gripper.joint].limits
        driven = np.linspace(limits.get("lower", 0.0), limits.get("upper", 0.0), _OPENINGS)
        openings = np.array([_pad_gap(tree, gripper, followers, q) for q in driven])
        falling = int(np.argmin(openings)) + 1
        if falling < 2 or np.any(np.diff(openings[:falling]) >= 0):
            message = f"the pads do not come nearer to each other while {gripper.joint} rises; name the joint that does"
            raise RobotError(("gripper", "joint"), message)
        return cls(driven[:falling], openings[:falling], followers)

    def position(self, opening: float) -> float:
        """The driven joint's position, rad, with the pads `opening` m apart."""
        return float(np.interp(-opening, -self.openings, self.driven))

    def opening(self, position: float) -> float:
        """The pads' distance, m, with the driven joint at `position` rad."""
        return float(np.interp(position, self.driven, self.openings))

    def positions(self, opening: float) -> dict[str, float]:
        """The positions of all its joints, rad."""
        driven = self.position(opening)
        return {name: multiplier * driven + offset for name, (multiplier, offset) in self.followers.items()}


def _pad_gap(
    tree: UrdfTree, gripper: LinkageGripper, followers: Mapping[str, tuple[float, float]], driven: float
) -> float:
    positions = {name: multiplier * driven + offset for name, (multiplier, offset) in followers.items()}
    left, right = (tree.frame(pad, positions)[:3, 3] for pad in gripper.pads)
    return float(np.linalg.norm(left - right)) - gripper.thickness
