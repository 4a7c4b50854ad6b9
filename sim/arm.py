"""A ViperX 300 S with its jaw: joint servos, constant joint offsets, a friction grip, noisy finger readings.

It speaks the maker's present joint signs (all other rooms do); the URDF's elbow and wrist run the other way.
"""

import tempfile
from collections import deque
from pathlib import Path

import numpy as np
import pybullet as p
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform, Rotation

from interfaces.cell import ArmSpec, Errors, GripperSpec
from interfaces.reading import GripperReading, JointReading
from interfaces.trajectory import Trajectory
from sim.robot_model import NAME, finger_position, pad_gap, robot_urdf

FloatArray = NDArray[np.float64]

SIGN = np.array([1.0, 1.0, -1.0, 1.0, -1.0, 1.0])
# Stall torques at 12 V of the maker's servos: XM540-W270 10.6 N m (two at shoulder and elbow), XM430-W350 4.1 N m.
TORQUE = np.array([10.6, 21.2, 21.2, 10.6, 10.6, 4.1])
ENCODER_STEP = 2 * np.pi / 4096
BRAKE = 12.0  # rad/s2: from full speed (0.85 of pi rad/s) to rest in 0.22 s
OPEN_FORCE = 40.0  # N a finger while opening or holding a gap
_WRIST_FROM_URDF = Rotation.from_rotvec([np.pi, 0, 0])


class SimArm:
    """One arm in a PyBullet client; fulfils `interfaces.devices.Arm`, its `gripper` fulfils `Gripper`.

    `offsets` (6,) rad: what each encoder reads too little. The world calls `step()` before every physics step.
    """

    def __init__(
        self,
        client: int,
        spec: ArmSpec,
        gripper: GripperSpec,
        errors: Errors,
        step: float,
        camera_offset: tuple[float, float, float] | None,
        rng: np.random.Generator,
    ) -> None:
        self.name = spec.name
        self.client = client
        self._dt = step
        self._steps = 0
        self.body = _load(client, spec, robot_urdf(gripper.pad_thickness, camera_offset))
        self.links = {
            p.getJointInfo(self.body, j, physicsClientId=client)[12].decode().removeprefix(f"{NAME}/"): j
            for j in range(p.getNumJoints(self.body, physicsClientId=client))
        }
        self.joints = [
            self.links[n]
            for n in (
                "shoulder_link",
                "upper_arm_link",
                "upper_forearm_link",
                "lower_forearm_link",
                "wrist_link",
                "gripper_link",
            )
        ]
        self.offsets = self._draw_offsets(errors.arm_tool, rng)
        self._trajectory: Trajectory | None = None
        self._started = 0.0
        self._command = np.array(spec.sleep, float)
        self._place(self._command)
        self.gripper = SimGripper(self, gripper, errors, rng)

    def reading(self) -> JointReading:
        """Encoder positions, quantised and short of the truth by the offsets; servo torques."""
        states = p.getJointStates(self.body, self.joints, physicsClientId=self.client)
        positions = SIGN * np.array([s[0] for s in states]) - self.offsets
        return JointReading(
            self.now(),
            np.round(positions / ENCODER_STEP) * ENCODER_STEP,
            SIGN * np.array([s[1] for s in states]),
            SIGN * np.array([s[3] for s in states]),
        )

    def now(self) -> float:
        """Simulated seconds since the last `restart_clock`."""
        return self._steps * self._dt

    def restart_clock(self) -> None:
        """Call the present instant zero."""
        self._steps = 0
        self.gripper.restart_clock()

    def follow(self, trajectory: Trajectory) -> None:
        """See `interfaces.devices.Arm`."""
        self._trajectory, self._started = trajectory, self.now()

    def stop(self) -> None:
        """See `interfaces.devices.Arm`: all joints brake to rest together, at most `BRAKE`."""
        if self._trajectory is None:
            return
        q, v = self._trajectory.sample(self.now() - self._started)
        seconds = float(np.max(np.abs(v))) / BRAKE
        if seconds < self._dt:
            self._command, self._trajectory = q, None
            self._drive(q, np.zeros(6))
            return
        times = np.linspace(0.0, seconds, 12)
        share = times - times**2 / (2 * seconds)
        self.follow(Trajectory(times, q + share[:, None] * v, (1 - times / seconds)[:, None] * v))

    def is_moving(self) -> bool:
        """See `interfaces.devices.Arm`."""
        return self._trajectory is not None

    def wrist_pose(self) -> RigidTransform:
        """True world_from_wrist (link before the last joint; x along the gripper, z up at the zero pose)."""
        s = p.getLinkState(self.body, self.links["wrist_link"], 0, 1, physicsClientId=self.client)
        return RigidTransform.from_components(s[4], Rotation.from_quat(s[5]) * _WRIST_FROM_URDF.inv())

    def tool_pose(self) -> RigidTransform:
        """True world_from_tool: x along the fingers, y the closing direction, origin between the pads."""
        left = p.getLinkState(self.body, self.links["left_pad"], 0, 1, physicsClientId=self.client)
        right = p.getLinkState(self.body, self.links["right_pad"], 0, 1, physicsClientId=self.client)
        middle = (np.array(left[4]) + np.array(right[4])) / 2
        bar = p.getLinkState(self.body, self.links["gripper_link"], 0, 1, physicsClientId=self.client)
        return RigidTransform.from_components(middle, Rotation.from_quat(bar[5]))

    def step(self) -> None:
        """Set the servos for the next physics step."""
        if self._trajectory is not None:
            t = self.now() + self._dt - self._started
            q, v = self._trajectory.sample(t)
            if t >= self._trajectory.duration:
                self._command, self._trajectory, v = q, None, np.zeros(6)
            self._drive(q, v)
        self.gripper.step()
        self._steps += 1

    def _drive(self, q: FloatArray, v: FloatArray) -> None:
        p.setJointMotorControlArray(
            self.body,
            self.joints,
            p.POSITION_CONTROL,
            targetPositions=(SIGN * (q + self.offsets)).tolist(),
            targetVelocities=(SIGN * v).tolist(),
            positionGains=[0.3] * 6,
            velocityGains=[1.0] * 6,
            forces=TORQUE.tolist(),
            physicsClientId=self.client,
        )

    def _place(self, q: FloatArray) -> None:
        for joint, value in zip(self.joints, SIGN * (q + self.offsets), strict=True):
            p.resetJointState(self.body, joint, value, physicsClientId=self.client)
        self._drive(q, np.zeros(6))

    def _draw_offsets(self, tool_error: float, rng: np.random.Generator) -> FloatArray:
        """Joint offsets (6,) rad whose mean tool error over reference poses is `tool_error` metres."""
        draw = rng.normal(size=6)
        if tool_error == 0.0:
            return np.zeros(6)
        small = 1e-3
        poses = np.array([[0, 0, 0, 0, 0, 0], [0.4, -0.3, 0.4, 0.5, 0.3, 0.2], [0.8, 0.3, -0.2, -0.6, 0.6, 0.0]])
        moved = []
        for q in poses:
            ends = []
            for o in (np.zeros(6), small * draw):
                for joint, value in zip(self.joints, SIGN * (q + o), strict=True):
                    p.resetJointState(self.body, joint, value, physicsClientId=self.client)
                ends.append(self.tool_pose().translation)
            moved.append(float(np.linalg.norm(ends[1] - ends[0])))
        return draw * small * tool_error / float(np.mean(moved))


class SimGripper:
    """The two coupled fingers. They hold by friction only. Fulfils `interfaces.devices.Gripper`."""

    def __init__(self, arm: SimArm, spec: GripperSpec, errors: Errors, rng: np.random.Generator) -> None:
        self._arm, self._spec, self._errors = arm, spec, errors
        self._fingers = [arm.links["left_finger_link"], arm.links["right_finger_link"]]
        self.pads = (arm.links["left_pad"], arm.links["right_pad"])
        self._noise_key = int(rng.integers(2**31))
        client, body = arm.client, arm.body
        for pad in self.pads:
            p.changeDynamics(body, pad, lateralFriction=spec.friction, spinningFriction=0.005, physicsClientId=client)
        gear = p.createConstraint(
            body,
            self._fingers[0],
            body,
            self._fingers[1],
            p.JOINT_GEAR,
            [0, 1, 0],
            [0, 0, 0],
            [0, 0, 0],
            physicsClientId=client,
        )
        # One servo moves both fingers: the URDF's right finger runs the other way.
        p.changeConstraint(gear, gearRatio=1, maxForce=500, erp=0.3, physicsClientId=client)
        p.setJointMotorControl2(
            body, arm.links["gripper_prop_link"], p.VELOCITY_CONTROL, targetVelocity=0, force=1, physicsClientId=client
        )
        closed = finger_position(0.003, spec.pad_thickness)
        for finger, side in zip(self._fingers, (1, -1), strict=True):
            p.resetJointState(body, finger, side * closed, physicsClientId=client)
        self._gap_command = 0.003
        self._force: float | None = None
        self._stuck_open_until = -1.0
        self._play = self.true_gap()
        self._samples = 0
        self._reading = self._sample(0)
        self._drive()

    def open(self, gap: float) -> None:
        """See `interfaces.devices.Gripper`."""
        self._gap_command, self._force = gap, None
        self._drive()

    def close(self, force: float) -> None:
        """See `interfaces.devices.Gripper`; `force` is capped at the jaw's maximum."""
        self._force = min(force, self._spec.max_force)
        self._drive()

    def reading(self) -> GripperReading:
        """The newest sample of the finger encoder, taken at the errors' `finger_rate`."""
        return self._reading

    def fail_open(self, seconds: float) -> None:
        """A fault: for so long the jaw drives open whatever it is told."""
        self._stuck_open_until = self._arm.now() + seconds
        self._drive()

    def true_gap(self) -> float:
        """The true distance between the pads in metres."""
        states = p.getJointStates(self._arm.body, self._fingers, physicsClientId=self._arm.client)
        return pad_gap(states[0][0], states[1][0], self._spec.pad_thickness)

    def restart_clock(self) -> None:
        """Call the present instant zero."""
        self._samples = 0
        self._reading = self._sample(0)

    def step(self) -> None:
        """Sample the encoder when due; end a fault when its time is over."""
        now = self._arm.now()
        if 0.0 <= self._stuck_open_until <= now:
            self._stuck_open_until = -1.0
            self._drive()
        due = int(now * self._errors.finger_rate + 1e-6)
        if due > self._samples:
            self._samples = due
            self._reading = self._sample(due)

    def _sample(self, number: int) -> GripperReading:
        half = self._errors.finger_backlash / 2
        gap = self.true_gap()
        self._play = min(max(self._play, gap - half), gap + half)
        noise = np.random.default_rng([self._noise_key, number]).normal(0.0, self._errors.finger_noise)
        step = self._errors.finger_resolution
        return GripperReading(self._arm.now(), max(0.0, round((self._play + noise) / step) * step))

    def _drive(self) -> None:
        client, body = self._arm.client, self._arm.body
        if self._stuck_open_until >= 0.0:
            force, velocity, target = self._spec.max_force, self._spec.speed, None
        elif self._force is not None:
            force, velocity, target = self._force, -self._spec.speed, None
        else:
            force, velocity, target = OPEN_FORCE, 0.0, finger_position(self._gap_command, self._spec.pad_thickness)
        for finger, side in zip(self._fingers, (1, -1), strict=True):
            if target is None:
                p.setJointMotorControl2(
                    body,
                    finger,
                    p.VELOCITY_CONTROL,
                    targetVelocity=side * velocity,
                    force=force,
                    physicsClientId=client,
                )
            else:
                p.setJointMotorControl2(
                    body,
                    finger,
                    p.POSITION_CONTROL,
                    targetPosition=side * target,
                    positionGain=0.1,
                    velocityGain=1.0,
                    force=force,
                    maxVelocity=self._spec.speed,
                    physicsClientId=client,
                )


def _load(client: int, spec: ArmSpec, urdf: str) -> int:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"{spec.name}.urdf"
        path.write_text(urdf, encoding="utf-8")
        body = p.loadURDF(
            str(path), spec.base, useFixedBase=True, flags=p.URDF_USE_INERTIA_FROM_FILE, physicsClientId=client
        )
    for link in range(-1, p.getNumJoints(body, physicsClientId=client)):
        p.changeDynamics(body, link, linearDamping=0, angularDamping=0, jointDamping=0, physicsClientId=client)
    return int(body)
