"""The signals of every task: the clock, and each arm as read and as it truly is."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from regrasp.app.task.signals import Signal, SignalGroup
from regrasp.motion.robots.kinematics import ArmKinematics

if TYPE_CHECKING:
    from scipy.spatial.transform import RigidTransform

    from regrasp.behaviors.services import Services
    from regrasp.sim.world import World

POSE = "rows of (3, 4): rotation, position in m"


def engine_signals(world: "World[Any]", services: "Services") -> list[SignalGroup]:
    """The clock's and each arm's."""
    clock = SignalGroup((Signal("t", "s", 1, "simulated time"),), lambda: (world.now(),))
    return [clock, *(_of_arm(name, world, services) for name in world.arms)]


def _of_arm(name: str, world: "World[Any]", services: "Services") -> SignalGroup:
    arm, motion, spec = world.arms[name], services.motion, services.known.arm(name)
    kinematics = ArmKinematics(spec.robot, spec.world_from_base)
    count, recent = len(kinematics), "largest since the row before"
    signals = (
        Signal(f"{name}.joints", "rad or m", count, "joint positions as the encoders read, corrected by what is known"),
        Signal(f"{name}.joints_true", "rad or m", count, "joint positions"),
        Signal(f"{name}.tool", POSE, 12, "world_from_tool by the readings"),
        Signal(f"{name}.tool_true", POSE, 12, "world_from_tool"),
        Signal(f"{name}.gap", "m", 1, "between the pads, as the gripper reads"),
        Signal(f"{name}.gap_true", "m", 1, "between the pads"),
        Signal(f"{name}.forbidden_force_true", "N", 1, f"{recent} against what the arm must not touch"),
        Signal(f"{name}.force_true", "N", 1, f"{recent} of its other contacts together, as of a grasp"),
    )

    def sample() -> Sequence[float]:
        q = motion.joints(name)
        forbidden, other = world.take_forces(name)
        return (
            *q.tolist(),
            *arm.true_joints().tolist(),
            *kinematics.tool_matrix(q)[:3].ravel().tolist(),
            *np.column_stack(arm.tool_frame()).ravel().tolist(),
            arm.gripper.reading().gap,
            arm.gripper.true_gap(),
            forbidden,
            other,
        )

    return SignalGroup(signals, sample)


def pose_values(pose: "RigidTransform") -> list[float]:
    """A pose's rotation and position, row by row (12,)."""
    values: list[float] = pose.as_matrix()[:3].ravel().tolist()
    return values
