"""How the fingers of a parallel gripper slide, and where their pads are."""

from dataclasses import dataclass

import numpy as np

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.quote import nearest, quoted
from regrasp.interfaces.robot.parts import ParallelGripper, Placed
from regrasp.interfaces.robot.urdf import DECIMALS, RobotError, UrdfJoint, UrdfTree, pose_of, snapped

_ONE_LINE = 1e-3  # rad by which the fingers' axes may differ
_ASIDE = (
    0.5  # sine of the angle between the tool's x and the way the fingers close, at least: else it is not along them
)


@dataclass(frozen=True, eq=False)
class ParallelJaw:
    """Two sliding fingers, the left one first.

    `signs` are 1 where a joint opens upwards, else -1. `offset` m is how far a finger's origin stands from the middle
    between them with its joint at zero. `face` and `thickness` m are those of `Pads`, and `pads` their poses (4, 4) in
    `Pads.links`: x along the finger, y the way the fingers close.
    """

    joints: tuple[UrdfJoint, UrdfJoint]
    signs: tuple[float, float]
    offset: float
    face: float
    thickness: float
    pads: tuple[FloatArray, FloatArray]

    @classmethod
    def of(cls, tree: UrdfTree, gripper: ParallelGripper, tool: Placed) -> "ParallelJaw":
        """Raises RobotError: the URDF lacks a joint or link, or the fingers do not move along one line."""
        left, right = _joints(tree, gripper)
        frames = [tree.frame(link) for link in gripper.pads.links]
        turns = [tree.frame(joint.child)[:3, :3] for joint in (left, right)]
        axes = [turn @ joint.axis for turn, joint in zip(turns, (left, right), strict=True)]
        signs = _signs((left, right), axes, [frame[:3, 3] for frame in frames])
        along = (tree.frame(tool.link) @ pose_of(tool.xyz, tool.rpy))[:3, 0]
        # Of both pads the way in which the left finger opens is y, so that they lie alike.
        turn = _pad_turn(along, signs[0] * axes[0])
        opens = [sign * axis for sign, axis in zip(signs, axes, strict=True)]
        apart = (frames[0][:3, 3] - frames[1][:3, 3]) @ opens[0]
        return cls(
            (left, right),
            signs,
            float(np.round(0.5 * apart, DECIMALS) + 0.0),
            gripper.pads.face,
            gripper.pads.thickness,
            (_pad(gripper, frames[0], turn, opens[0]), _pad(gripper, frames[1], turn, opens[1])),
        )

    def position(self, gap: float) -> float:
        """How far, m, each finger's joint is moved in the way it opens, with the pads `gap` m apart."""
        return gap / 2 + self.face + self.thickness - self.offset

    def positions(self, gap: float) -> dict[str, float]:
        """The positions of both joints, m."""
        position = self.position(gap)
        return {joint.name: sign * position for joint, sign in zip(self.joints, self.signs, strict=True)}

    def reach(self, side: int) -> tuple[float, float]:
        """The pads' distances, m, between which the URDF's limits keep the left (0) or the right (1) finger."""
        sign, limits = self.signs[side], self.joints[side].limits
        ends = sorted(sign * limits.get(key, 0.0) for key in ("lower", "upper"))
        gaps = [2 * (end - self.face - self.thickness + self.offset) for end in ends]
        return gaps[0], gaps[1]

    def gap(self, left: float, right: float) -> float:
        """The pads' distance, m, with the joints at these positions."""
        return self.signs[0] * left + self.signs[1] * right - 2 * (self.face + self.thickness - self.offset)


def _joints(tree: UrdfTree, gripper: ParallelGripper) -> tuple[UrdfJoint, UrdfJoint]:
    sliding = [name for name, joint in tree.joints.items() if joint.kind == "prismatic"]
    for side, name in enumerate(gripper.joints):
        if name not in sliding:
            what = f"is {tree.joints[name].kind}, not prismatic" if name in tree.joints else "is not in the URDF"
            raise RobotError(("gripper", "joints", side), f"the joint {quoted(name)} {what}; {nearest(name, sliding)}")
    if gripper.joints[0] == gripper.joints[1]:
        raise RobotError(("gripper", "joints"), f"both fingers are {quoted(gripper.joints[0])}; name two joints")
    for side, link in enumerate(gripper.pads.links):
        path, name = ("gripper", "pads", "links", side), gripper.joints[side]
        if link not in tree.links:
            raise RobotError(path, f"the URDF has no link {quoted(link)}; {nearest(link, tree.links)}")
        if name not in [joint.name for joint in tree.way_to(link)]:
            raise RobotError(path, f"the joint {name} does not move {link}; name {tree.joints[name].child}")
    for n, name in enumerate(gripper.spin):
        if name not in tree.joints:
            right = nearest(name, list(tree.joints))
            raise RobotError(("gripper", "spin", n), f"the URDF has no joint {quoted(name)}; {right}")
    return tree.joints[gripper.joints[0]], tree.joints[gripper.joints[1]]


def _signs(
    joints: tuple[UrdfJoint, UrdfJoint], axes: list[FloatArray], places: list[FloatArray]
) -> tuple[float, float]:
    """A finger opens away from the other; where they are is looked at amid the joints' limits."""
    path, names = ("gripper", "joints"), f"{joints[0].name} and {joints[1].name}"
    if np.linalg.norm(np.cross(axes[0], axes[1])) > _ONE_LINE:
        raise RobotError(path, f"{names} do not move along one line; name two fingers that do")
    amid = [0.5 * (joint.limits.get("lower", 0.0) + joint.limits.get("upper", 0.0)) for joint in joints]
    left, right = (place + q * axis for place, q, axis in zip(places, amid, axes, strict=True))
    ways = float((left - right) @ axes[0]), float((right - left) @ axes[1])
    if not all(ways):
        raise RobotError(path, f"amid their limits {names} stand in one place; give them limits in the URDF")
    return (1.0 if ways[0] > 0 else -1.0), (1.0 if ways[1] > 0 else -1.0)


def _pad_turn(along: FloatArray, y: FloatArray) -> FloatArray:
    """The rotation (3, 3) of the pads in the URDF's root: x along the fingers, as far as that is across y."""
    x = along - (along @ y) * y
    if np.linalg.norm(x) < _ASIDE:
        message = "the tool's x lies along the way in which the fingers close; x goes along the fingers, y that way"
        raise RobotError(("tool", "rpy"), message)
    x = x / np.linalg.norm(x)
    return np.column_stack([x, y, np.cross(x, y)])


def _pad(gripper: ParallelGripper, frame: FloatArray, turn: FloatArray, opens: FloatArray) -> FloatArray:
    """link_from_pad (4, 4). The finger link's origin is at its joint's position: the face is nearer to the middle."""
    pads, pose = gripper.pads, np.eye(4)
    pose[:3, :3] = snapped(frame[:3, :3].T @ turn)
    outwards = snapped((frame[:3, :3].T @ opens)[None])[0]
    pose[:3, 3] = pads.ahead * pose[:3, 0] - (pads.face + pads.thickness / 2) * outwards + 0.0
    return pose
