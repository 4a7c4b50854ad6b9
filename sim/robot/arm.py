"""A simulated ViperX 300 S: position servos, constant joint offsets, encoders.

Its interface uses the maker's present joint signs, as all other packages do. In the URDF the elbow and the wrist angle
have the opposite sign.
"""

import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numba
import numpy as np
import pybullet as p
from scipy.spatial.transform import RigidTransform, Rotation

from regrasp.interfaces.arrays import FloatArray, Mask
from regrasp.interfaces.cell import ArmSpec, Cell, WristMount
from regrasp.interfaces.reading import JointReading
from regrasp.interfaces.trajectory import Trajectory
from regrasp.sim.robot.gripper import GripperParameters, SimGripper
from regrasp.sim.robot.model import ROBOT_NAME, robot_urdf

# The URDF's links that the six joints move.
JOINT_LINKS = (
    "shoulder_link",
    "upper_arm_link",
    "upper_forearm_link",
    "lower_forearm_link",
    "wrist_link",
    "gripper_link",
)
JOINT_SIGNS = np.array([1.0, 1.0, -1.0, 1.0, -1.0, 1.0])
# Stall torques at 12 V of the maker's servos: XM540-W270 10.6 N m (two at shoulder and elbow), XM430-W350 4.1 N m.
STALL_TORQUES = np.array([10.6, 21.2, 21.2, 10.6, 10.6, 4.1])
MAX_JOINT_SPEED = np.pi  # rad/s, the maker's limit of every joint
ENCODER_STEP = 2 * np.pi / 4096  # rad
# Joint positions at which the joint offsets make the stated tool error: stretched forward, and two poses of the task.
REFERENCE_POSES = np.array([[0, 0, 0, 0, 0, 0], [0.4, -0.3, 0.4, 0.5, 0.3, 0.2], [0.8, 0.3, -0.2, -0.6, 0.6, 0.0]])
_WRIST_FROM_URDF = Rotation.from_rotvec([np.pi, 0, 0])


@dataclass(frozen=True)
class ArmParameters:
    """The joint servos."""

    braking: float = 12.0  # rad/s2: from full speed (0.85 of pi rad/s) to rest in 0.22 s
    braking_samples: int = 12  # of the trajectory that brakes
    position_gain: float = 0.3  # PyBullet's position control, share of the error that is corrected in a step
    velocity_gain: float = 1.0


class SimArm:
    """One arm in a PyBullet client; implements `regrasp.interfaces.devices.Arm`, and its `gripper` `Gripper`.

    `offsets` (6,) rad are the joint offsets: each encoder reads that much less than the truth. The world calls `step()`
    before every physics step.
    """

    def __init__(
        self,
        client: int,
        cell: Cell,
        name: str,
        rng: np.random.Generator,
        parameters: ArmParameters = ArmParameters(),
        gripper_parameters: GripperParameters | None = None,
    ) -> None:
        spec, hidden = cell.known.arm(name), cell.hidden
        self.name: str = spec.name
        self.client = client
        self._parameters = parameters
        self._dt = 1.0 / hidden.step_rate
        self._steps = 0
        self.body = _load(client, spec, robot_urdf(hidden.gripper.pad_thickness, _camera_offset(cell, name)))
        self.links = {
            p.getJointInfo(self.body, j, physicsClientId=client)[12].decode().removeprefix(f"{ROBOT_NAME}/"): j
            for j in range(p.getNumJoints(self.body, physicsClientId=client))
        }
        self.joints = [self.links[name] for name in JOINT_LINKS]
        self._tool_links = [self.links[name] for name in ("left_pad", "right_pad", "gripper_link")]
        self.offsets = self._draw_offsets(hidden.errors.arm_tool, rng)
        self._speed_share = np.ones(6)  # of `MAX_JOINT_SPEED`, for each joint; less by a fault
        self._encoder_slip = np.zeros(6)  # rad that the encoders read too much, by a fault
        self._late_joints = False  # whether the last command was more than some servo can do in a step
        self._gains = [parameters.position_gain] * 6, [parameters.velocity_gain] * 6, STALL_TORQUES.tolist()
        self._trajectory: Trajectory | None = None
        self._started = 0.0
        self._servo: FloatArray = np.array(spec.sleep, float)  # where the servos stand, rad
        self._target = self._servo.copy()  # where they were told to go, rad
        self._speeds = np.empty(6)  # of the targets, rad/s
        self._command = np.empty((2, 6))  # what PyBullet is told: positions with the offsets, velocities; URDF signs
        self.place(self._servo)
        self.gripper = SimGripper(
            client, self.body, self.links, self.now, hidden, rng, gripper_parameters or GripperParameters()
        )

    def reading(self) -> JointReading:
        """Quantised encoder positions, which are less than the truth by the offsets; velocities; servo torques."""
        states = p.getJointStates(self.body, self.joints, physicsClientId=self.client)
        positions = JOINT_SIGNS * np.array([s[0] for s in states]) - self.offsets + self._encoder_slip
        return JointReading(
            self.now(),
            np.round(positions / ENCODER_STEP) * ENCODER_STEP,
            JOINT_SIGNS * np.array([s[1] for s in states]),
            JOINT_SIGNS * np.array([s[3] for s in states]),
        )

    def now(self) -> float:
        """Simulated seconds since the last `restart_clock`."""
        return self._steps * self._dt

    def restart_clock(self) -> None:
        """Set the clock to zero."""
        self._steps = 0
        self.gripper.restart_clock()

    def follow(self, trajectory: Trajectory) -> None:
        """See `regrasp.interfaces.devices.Arm`."""
        self._trajectory, self._started = trajectory, self.now()

    def stop(self) -> None:
        """See `regrasp.interfaces.devices.Arm`: all joints come to rest together, none brakes harder than `braking`."""
        if self._trajectory is None:
            return
        q, v = self._trajectory.sample(self.now() - self._started)
        late = self._late(q)
        q, v = np.where(late, self._servo, q), np.where(late, 0.0, v)
        seconds = float(np.max(np.abs(v))) / self._parameters.braking
        if seconds < self._dt:
            self._trajectory = None
            self._drive(q, np.zeros(6))
            return
        times = np.linspace(0.0, seconds, self._parameters.braking_samples)
        share = times - times**2 / (2 * seconds)
        self.follow(Trajectory(times, q + share[:, None] * v, (1 - times / seconds)[:, None] * v))

    def is_moving(self) -> bool:
        """See `regrasp.interfaces.devices.Arm`."""
        return self._trajectory is not None

    def deferred_wrist_pose(self) -> Callable[[], RigidTransform]:
        """What works out the present true world_from_wrist when it is called, now or later.

        The wrist is the link before the last joint: x along the gripper, z up when all joints are zero.
        """
        s = p.getLinkState(self.body, self.links["wrist_link"], 0, 1, physicsClientId=self.client)
        return lambda: RigidTransform.from_components(s[4], Rotation.from_quat(s[5]) * _WRIST_FROM_URDF.inv())

    def tool_pose(self) -> RigidTransform:
        """True world_from_tool: x along the fingers, y along the closing direction, origin midway between the pads."""
        left = p.getLinkState(self.body, self.links["left_pad"], 0, 1, physicsClientId=self.client)
        right = p.getLinkState(self.body, self.links["right_pad"], 0, 1, physicsClientId=self.client)
        middle = (np.array(left[4]) + np.array(right[4])) / 2
        bar = p.getLinkState(self.body, self.links["gripper_link"], 0, 1, physicsClientId=self.client)
        return RigidTransform.from_components(middle, Rotation.from_quat(bar[5]))

    def in_tool(self, point: Sequence[float]) -> FloatArray:
        """A point (3,) m of the world in the frame of `tool_pose`, worked out faster."""
        left, right, bar = p.getLinkStates(self.body, self._tool_links, 0, 1, physicsClientId=self.client)
        turn = np.array(p.getMatrixFromQuaternion(bar[5])).reshape(3, 3)
        return np.asarray((np.array(point) - (np.array(left[4]) + np.array(right[4])) / 2) @ turn)

    def set_speed_share(self, joint: int, share: float) -> None:
        """A fault: joint 0 to 5 turns no faster than `share` of `MAX_JOINT_SPEED`; with 0 it does not turn."""
        self._speed_share[joint] = share

    def slip_encoder(self, joint: int, angle: float) -> None:
        """A fault: the encoder of joint 0 to 5 reads `angle` rad more from now on. The servo has its own sensor."""
        self._encoder_slip[joint] += angle

    def step(self) -> None:
        """Set the servos for the next physics step."""
        if self._trajectory is not None:
            t = self.now() + self._dt - self._started
            q, v = self._trajectory.sample(t)
            over = t >= self._trajectory.duration
            if _move_target(self._target, self._speeds, q, v, over, self._dt):
                self._trajectory = None
            self._drive(self._target, self._speeds)
        elif self._late_joints and self._late(self._target).any():
            self._drive(self._target, np.zeros(6))
        if self._steps * self._dt >= self.gripper.due:
            self.gripper.sample()
        self._steps += 1

    def _drive(self, q: FloatArray, v: FloatArray) -> None:
        shares, offsets = self._speed_share, self.offsets
        self._late_joints = _servo_command(self._servo, q, v, shares, offsets, self._dt, self._target, self._command)
        positions, velocities = self._command.tolist()
        position_gains, velocity_gains, torques = self._gains
        p.setJointMotorControlArray(
            self.body,
            self.joints,
            p.POSITION_CONTROL,
            targetPositions=positions,
            targetVelocities=velocities,
            positionGains=position_gains,
            velocityGains=velocity_gains,
            forces=torques,
            physicsClientId=self.client,
        )

    def _late(self, q: FloatArray) -> Mask:
        """Which servos (6,) cannot reach `q` (6,) rad within a step; without a fault, none."""
        return np.abs(q - self._servo) > self._speed_share * MAX_JOINT_SPEED * self._dt + 1e-9

    def place(self, q: FloatArray) -> None:
        """Set the joints to `q` (6,) rad at once, for the start of a run and for pictures without physics."""
        self._reset_joints(q + self.offsets)
        self._servo[:] = q
        self._drive(q, np.zeros(6))

    def _reset_joints(self, q: FloatArray) -> None:
        for joint, value in zip(self.joints, JOINT_SIGNS * q, strict=True):
            p.resetJointState(self.body, joint, value, physicsClientId=self.client)

    def _draw_offsets(self, tool_error: float, rng: np.random.Generator) -> FloatArray:
        """Random joint offsets (6,) rad; their mean tool error over the reference poses is `tool_error` m."""
        draw = rng.normal(size=6)
        if tool_error == 0.0:
            return np.zeros(6)
        small = 1e-3 * draw
        moved = [np.linalg.norm(self._tool_at(q + small) - self._tool_at(q)) for q in REFERENCE_POSES]
        return small * tool_error / float(np.mean(moved))

    def _tool_at(self, q: FloatArray) -> FloatArray:
        """Tool position (3,) m in the world with the joints set to `q` (6,) rad."""
        self._reset_joints(q)
        return self.tool_pose().translation


@numba.njit(cache=True)
def _move_target(target: FloatArray, speeds: FloatArray, q: FloatArray, v: FloatArray, over: bool, dt: float) -> bool:
    """Move the servos' `target` (6,) rad towards a trajectory's `q`, with its `v`; write the `speeds` (6,) rad/s.

    A servo turns no faster than its rated speed; it follows a faster trajectory late. `over`: the trajectory's time is
    over. Says whether the servos are at its end, too.
    """
    reach = MAX_JOINT_SPEED * dt
    ended = over and np.max(np.abs(q - target)) <= reach
    for i in range(6):
        wanted = q[i] - target[i]
        step = min(max(wanted, -reach), reach)
        target[i] += step
        if step != wanted:
            speeds[i] = step / dt
        else:
            speeds[i] = 0.0 if ended else v[i]
    return ended


@numba.njit(cache=True)
def _servo_command(
    servo: FloatArray,
    q: FloatArray,
    v: FloatArray,
    speed_share: FloatArray,
    offsets: FloatArray,
    dt: float,
    target: FloatArray,
    command: FloatArray,
) -> bool:
    """Move the `servo` (6,) rad towards `q` (6,) rad with velocities `v` (6,) rad/s; whether any servo is late.

    A slow joint's servo goes as far as it can. Writes `q` to `target` (6,), and to `command` (2, 6) the servos'
    positions plus `offsets` and their velocities, with the URDF's signs.
    """
    late = False
    for i in range(6):
        reach = speed_share[i] * MAX_JOINT_SPEED * dt
        position, velocity = q[i], v[i]
        if abs(q[i] - servo[i]) > reach + 1e-9:
            late, velocity = True, 0.0
            position = servo[i] + min(max(q[i] - servo[i], -reach), reach)
        target[i], servo[i] = q[i], position
        command[0, i] = JOINT_SIGNS[i] * (position + offsets[i])
        command[1, i] = JOINT_SIGNS[i] * velocity
    return late


def _camera_offset(cell: Cell, arm: str) -> tuple[float, float, float] | None:
    """Offset (m, in the wrist link) of the camera on that arm; None if it carries none."""
    offsets = {c.mount.arm: c.mount.offset for c in cell.known.cameras if isinstance(c.mount, WristMount)}
    return offsets.get(arm)


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
