"""A ViperX 300 S: joint servos, constant joint offsets, encoders.

It speaks the maker's present joint signs (all other rooms do); the URDF's elbow and wrist run the other way.
"""

import tempfile
from pathlib import Path

import numpy as np
import pybullet as p
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform, Rotation

from regrasp.interfaces.cell import ArmSpec
from regrasp.interfaces.hidden_world import Errors, GripperSpec
from regrasp.interfaces.reading import JointReading
from regrasp.interfaces.trajectory import Trajectory
from regrasp.sim.robot.gripper import SimGripper
from regrasp.sim.robot.model import NAME, robot_urdf

FloatArray = NDArray[np.float64]

# The URDF's links that the six joints move.
JOINTS = ("shoulder_link", "upper_arm_link", "upper_forearm_link", "lower_forearm_link", "wrist_link", "gripper_link")
SIGN = np.array([1.0, 1.0, -1.0, 1.0, -1.0, 1.0])
# Stall torques at 12 V of the maker's servos: XM540-W270 10.6 N m (two at shoulder and elbow), XM430-W350 4.1 N m.
TORQUE = np.array([10.6, 21.2, 21.2, 10.6, 10.6, 4.1])
SPEED = np.pi  # rad/s, the maker's limit of every joint
ENCODER_STEP = 2 * np.pi / 4096
# Where the tool error that the joint offsets make is set: out forward, and two poses of the work.
REFERENCE_POSES = np.array([[0, 0, 0, 0, 0, 0], [0.4, -0.3, 0.4, 0.5, 0.3, 0.2], [0.8, 0.3, -0.2, -0.6, 0.6, 0.0]])
BRAKE = 12.0  # rad/s2: from full speed (0.85 of pi rad/s) to rest in 0.22 s
_WRIST_FROM_URDF = Rotation.from_rotvec([np.pi, 0, 0])


class SimArm:
    """One arm in a PyBullet client; fulfils `regrasp.interfaces.devices.Arm`, its `gripper` fulfils `Gripper`.

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
        self.name: str = spec.name
        self.client = client
        self._dt = step
        self._steps = 0
        self.body = _load(client, spec, robot_urdf(gripper.pad_thickness, camera_offset))
        self.links = {
            p.getJointInfo(self.body, j, physicsClientId=client)[12].decode().removeprefix(f"{NAME}/"): j
            for j in range(p.getNumJoints(self.body, physicsClientId=client))
        }
        self.joints = [self.links[name] for name in JOINTS]
        self.offsets = self._draw_offsets(errors.arm_tool, rng)
        self._speed_share = np.ones(6)  # of `SPEED`, joint by joint; less by a fault
        self._slip = np.zeros(6)  # rad that the encoders read too much, by a fault
        self._trajectory: Trajectory | None = None
        self._started = 0.0
        self._servo: FloatArray = np.array(spec.sleep, float)
        self.place(self._servo)
        self.gripper = SimGripper(client, self.body, self.links, self.now, gripper, errors, rng)

    def reading(self) -> JointReading:
        """Encoder positions, quantised and short of the truth by the offsets; servo torques."""
        states = p.getJointStates(self.body, self.joints, physicsClientId=self.client)
        positions = SIGN * np.array([s[0] for s in states]) - self.offsets + self._slip
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
        """See `regrasp.interfaces.devices.Arm`."""
        self._trajectory, self._started = trajectory, self.now()

    def stop(self) -> None:
        """See `regrasp.interfaces.devices.Arm`: all joints brake to rest together, at most `BRAKE`."""
        if self._trajectory is None:
            return
        q, v = self._trajectory.sample(self.now() - self._started)
        late = self._late(q)
        q, v = np.where(late, self._servo, q), np.where(late, 0.0, v)
        seconds = float(np.max(np.abs(v))) / BRAKE
        if seconds < self._dt:
            self._trajectory = None
            self._drive(q, np.zeros(6))
            return
        times = np.linspace(0.0, seconds, 12)
        share = times - times**2 / (2 * seconds)
        self.follow(Trajectory(times, q + share[:, None] * v, (1 - times / seconds)[:, None] * v))

    def is_moving(self) -> bool:
        """See `regrasp.interfaces.devices.Arm`."""
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

    def set_speed_share(self, joint: int, share: float) -> None:
        """A fault: a joint, 0 to 5, that turns no faster than a share of `SPEED`; with 0 it stands."""
        self._speed_share[joint] = share

    def slip_encoder(self, joint: int, angle: float) -> None:
        """A fault: a joint's encoder reads `angle` rad more from now on; its servo has a sensor of its own."""
        self._slip[joint] += angle

    def step(self) -> None:
        """Set the servos for the next physics step."""
        if self._trajectory is not None:
            t = self.now() + self._dt - self._started
            q, v = self._trajectory.sample(t)
            if t >= self._trajectory.duration and float(np.max(np.abs(q - self._target))) <= SPEED * self._dt:
                self._trajectory, v = None, np.zeros(6)
            # A servo turns no faster than its maker lets it: a hasty trajectory is followed late.
            wanted = q - self._target
            step = np.clip(wanted, -SPEED * self._dt, SPEED * self._dt)
            self._drive(self._target + step, np.where(step == wanted, v, step / self._dt))
        elif self._late(self._target).any():
            self._drive(self._target, np.zeros(6))
        self.gripper.step()
        self._steps += 1

    def _drive(self, q: FloatArray, v: FloatArray) -> None:
        late = self._late(q)
        if late.any():
            reach = self._speed_share * SPEED * self._dt
            self._servo = np.where(late, self._servo + np.clip(q - self._servo, -reach, reach), q)
            v = np.where(late, 0.0, v)
        else:
            self._servo = q
        self._target = q
        p.setJointMotorControlArray(
            self.body,
            self.joints,
            p.POSITION_CONTROL,
            targetPositions=(SIGN * (self._servo + self.offsets)).tolist(),
            targetVelocities=(SIGN * v).tolist(),
            positionGains=[0.3] * 6,
            velocityGains=[1.0] * 6,
            forces=TORQUE.tolist(),
            physicsClientId=self.client,
        )

    def _late(self, q: FloatArray) -> NDArray[np.bool_]:
        """Which servos (6,) cannot be at `q` (6,) rad within a step: none, but by a fault."""
        return np.abs(q - self._servo) > self._speed_share * SPEED * self._dt + 1e-9

    def place(self, q: FloatArray) -> None:
        """Put the joints at `q` (6,) rad at once: where a run begins, and for pictures without physics."""
        self._reset_joints(q + self.offsets)
        self._servo = q
        self._drive(q, np.zeros(6))

    def _reset_joints(self, q: FloatArray) -> None:
        for joint, value in zip(self.joints, SIGN * q, strict=True):
            p.resetJointState(self.body, joint, value, physicsClientId=self.client)

    def _draw_offsets(self, tool_error: float, rng: np.random.Generator) -> FloatArray:
        """Joint offsets (6,) rad whose mean tool error over reference poses is `tool_error` metres."""
        draw = rng.normal(size=6)
        if tool_error == 0.0:
            return np.zeros(6)
        small = 1e-3 * draw
        moved = [np.linalg.norm(self._tool_at(q + small) - self._tool_at(q)) for q in REFERENCE_POSES]
        return small * tool_error / float(np.mean(moved))

    def _tool_at(self, q: FloatArray) -> FloatArray:
        """Tool position (3,) m with the joints put at `q`."""
        self._reset_joints(q)
        return self.tool_pose().translation


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
