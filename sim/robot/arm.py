"""A simulated arm: position servos, constant joint offsets, encoders. What it is stands in its robot's file.

Its interface uses the joints' signs of that file; in the URDF some may count the other way.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numba
import numpy as np
import pybullet as p
from scipy.spatial.transform import RigidTransform, Rotation

from regrasp.interfaces.arrays import FloatArray, Mask
from regrasp.interfaces.cell import Cell, WristMount
from regrasp.interfaces.devices import Guard
from regrasp.interfaces.reading import JointReading
from regrasp.interfaces.robot.parts import Placed
from regrasp.interfaces.trajectory import Trajectory
from regrasp.sim.robot.gripper import GripperParameters, GripperPlace, SimGripper, make_gripper, robot_in_world
from regrasp.sim.robot.load import joint_numbers, link_numbers, load_robot_body
from regrasp.sim.robot.model import pad_links


@dataclass(frozen=True)
class ArmParameters:
    """The joint servos."""

    braking_samples: int = 12  # of the trajectory that brakes
    position_gain: float = 0.3  # PyBullet's position control, share of the error that is corrected in a step
    velocity_gain: float = 1.0
    slow: float = 0.05  # rad/s or m/s of each joint, from which on an arm that a guard stopped holds softly; choice


class SimArm:
    """One arm in a PyBullet client; implements `regrasp.interfaces.devices.Arm`, and its `gripper` `Gripper`.

    `offsets` (n,) rad are the joint offsets: each encoder reads that much less than the truth. The world calls `step()`
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
        self.robot = robot_in_world(spec.robot, hidden.gripper)
        self.client = client
        self._parameters = parameters
        self._dt = 1.0 / hidden.step_rate
        self._steps = 0
        chain, self._signs = self.robot.chain, self.robot.signs
        self._chain, count = chain, len(chain)
        base, camera = spec.world_from_base, _camera_offset(cell, name)
        self.body, self.joints = load_robot_body(client, self.robot, base, camera)
        self.links = link_numbers(client, self.body)
        self._tool_links = [self.links[name] for name in (*pad_links(self.robot.gripper), self.robot.tool.link)]
        self._tool_turn = _turn(self.robot.tool.rpy)
        self.offsets = self._draw_offsets(hidden.errors.arm_tool, rng)
        self._speed_share = np.ones(count)  # of the joints' speeds; less by a fault
        self._encoder_slip = np.zeros(count)  # rad that the encoders read too much, by a fault
        self._late_joints = False  # whether the last command was more than some servo can do in a step
        self._gains = [parameters.position_gain] * count, [parameters.velocity_gain] * count, chain.torques.tolist()
        self._trajectory: Trajectory | None = None
        self._guard: Guard | None = None
        self._hold: FloatArray | None = None  # where the guard stopped the arm, rad, until it is slow
        self._started = 0.0
        self._servo: FloatArray = np.array(spec.sleep, float)  # where the servos stand, rad
        self._target = self._servo.copy()  # where they were told to go, rad
        self._speeds = np.empty(count)  # of the targets, rad/s
        self._command = np.empty(
            (2, count)
        )  # what PyBullet is told: positions with the offsets, velocities; URDF signs
        self.place(self._servo)
        self.gripper: SimGripper = make_gripper(
            self.robot,
            GripperPlace(client, self.body, self.links, joint_numbers(client, self.body), self.now),
            hidden.errors,
            rng,
            gripper_parameters or GripperParameters(),
        )

    def true_joints(self) -> FloatArray:
        """True positions (n,) of the joints."""
        states = p.getJointStates(self.body, self.joints, physicsClientId=self.client)
        return np.asarray(self._signs * np.array([s[0] for s in states]))

    def reading(self) -> JointReading:
        """Quantised encoder positions, which are less than the truth by the offsets; velocities; servo torques."""
        states = p.getJointStates(self.body, self.joints, physicsClientId=self.client)
        values = np.array([s[k] for k in (0, 1, 3) for s in states]).reshape(3, -1)
        _read(values, self._signs, self.offsets, self._encoder_slip, self.robot.calibration.encoder_step)
        positions, velocities, efforts = values
        return JointReading(self.now(), positions, velocities, efforts)

    def gravity(self) -> FloatArray:
        """See `regrasp.interfaces.devices.Arm`."""
        engine = p.getPhysicsEngineParameters(physicsClientId=self.client)
        return np.array([engine[f"gravityAcceleration{axis}"] for axis in "XYZ"])

    def now(self) -> float:
        """Simulated seconds since the last `restart_clock`."""
        return self._steps * self._dt

    def restart_clock(self) -> None:
        """Set the clock to zero."""
        self._steps = 0
        self.gripper.restart_clock()

    def follow(self, trajectory: Trajectory, guard: Guard | None = None) -> None:
        """See `regrasp.interfaces.devices.Arm`."""
        self._trajectory, self._started, self._guard, self._hold = trajectory, self.now(), guard, None

    def stop(self) -> None:
        """See `regrasp.interfaces.devices.Arm`: all joints come to rest together."""
        if self._trajectory is None:
            return
        q, v = self._trajectory.sample(self.now() - self._started)
        late = self._late(q)
        q, v = np.where(late, self._servo, q), np.where(late, 0.0, v)
        seconds = float(np.max(np.abs(v) / self._chain.accelerations))
        if seconds < self._dt:
            self._trajectory = None
            self._drive(q, np.zeros(len(q)))
            return
        times = np.linspace(0.0, seconds, self._parameters.braking_samples)
        share = times - times**2 / (2 * seconds)
        self.follow(Trajectory(times, q + share[:, None] * v, (1 - times / seconds)[:, None] * v))

    def is_moving(self) -> bool:
        """See `regrasp.interfaces.devices.Arm`."""
        return self._trajectory is not None

    def deferred_mount_pose(self) -> Callable[[], RigidTransform]:
        """What works out the present true world_from_mount when it is called, now or later.

        Raises RobotError if the robot has no mount for a camera.
        """
        mount = self.robot.camera_mount
        s = p.getLinkState(self.body, self.links[mount.link], 0, 1, physicsClientId=self.client)
        return lambda: _framed(s, mount)

    def tool_pose(self) -> RigidTransform:
        """True world_from_tool: x along the fingers, y along the closing direction, origin midway between the pads."""
        left, right, hand = (
            p.getLinkState(self.body, link, 0, 1, physicsClientId=self.client) for link in self._tool_links
        )
        middle = (np.array(left[4]) + np.array(right[4])) / 2
        turn = Rotation.from_quat(hand[5])
        return RigidTransform.from_components(middle, turn if self._tool_turn is None else turn * self._tool_turn)

    def in_tool(self, point: Sequence[float]) -> FloatArray:
        """A point (3,) m of the world in the frame of `tool_pose`, worked out faster."""
        turn, middle = self.tool_frame()
        return np.asarray((np.array(point) - middle) @ turn)

    def tool_frame(self) -> tuple[FloatArray, FloatArray]:
        """`tool_pose` as rotation matrix (3, 3) and position (3,) m, worked out faster."""
        left, right, hand = p.getLinkStates(self.body, self._tool_links, 0, 1, physicsClientId=self.client)
        turn = np.array(p.getMatrixFromQuaternion(hand[5])).reshape(3, 3)
        if self._tool_turn is not None:
            turn = turn @ self._tool_turn.as_matrix()
        return turn, (np.array(left[4]) + np.array(right[4])) / 2

    def set_speed_share(self, joint: int, share: float) -> None:
        """A fault: the joint turns no faster than `share` of its rated speed; with 0 it does not turn."""
        self._speed_share[joint] = share

    def slip_encoder(self, joint: int, angle: float) -> None:
        """A fault: the encoder of the joint reads `angle` rad more from now on. The servo has its own sensor."""
        self._encoder_slip[joint] += angle

    def step(self) -> None:
        """Set the servos for the next physics step."""
        if self._trajectory is not None and self._guard is not None:
            reading = self.reading()
            if self._guard(reading):
                self._trajectory = None
                self._hold = reading.positions - self._encoder_slip
                self._hold_softly(reading)
        elif self._hold is not None and self._trajectory is None:
            self._hold_softly(self.reading())
        if self._trajectory is not None:
            t = self.now() + self._dt - self._started
            q, v = self._trajectory.sample(t)
            over = t >= self._trajectory.duration
            efforts = None if self._guard is None else self._guard.greatest_efforts()
            if _move_target(self._target, self._speeds, q, v, over, self._chain.speeds * self._dt, self._dt):
                self._trajectory = efforts = None
            self._drive(self._target, self._speeds, efforts)
        elif self._late_joints and self._late(self._target).any():
            self._drive(self._target, np.zeros(len(self._target)))
        if self._steps * self._dt >= self.gripper.due:
            self.gripper.sample()
        self._steps += 1

    def _hold_softly(self, reading: JointReading) -> None:
        """Brake where the guard stopped the arm, and once it is slow hold with no more than the guard allows.

        The place may lie behind a wall by a step of the encoders: with all its efforts the arm would press it.
        """
        assert self._guard is not None
        assert self._hold is not None
        slow = bool(np.max(np.abs(reading.velocities)) < self._parameters.slow)
        self._drive(self._hold, np.zeros(len(self._hold)), self._guard.greatest_efforts() if slow else None)
        if slow:
            self._hold = None

    def _drive(self, q: FloatArray, v: FloatArray, efforts: FloatArray | None = None) -> None:
        """Tell the servos where to go, and how fast; with at most these `efforts` (n,), None: all that they can."""
        reach = self._speed_share * self._chain.speeds * self._dt
        self._late_joints = _servo_command(
            self._servo, q, v, reach, self.offsets, self._signs, self._target, self._command
        )
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
            forces=torques if efforts is None else efforts.tolist(),
            physicsClientId=self.client,
        )

    def _late(self, q: FloatArray) -> Mask:
        """Which servos (n,) cannot reach `q` (n,) within a step; without a fault, none."""
        return np.abs(q - self._servo) > self._speed_share * self._chain.speeds * self._dt + 1e-9

    def place(self, q: FloatArray) -> None:
        """Set the joints to `q` (n,) rad at once, for the start of a run and for pictures without physics."""
        self._reset_joints(q + self.offsets)
        self._servo[:] = q
        self._drive(q, np.zeros(len(q)))

    def _reset_joints(self, q: FloatArray) -> None:
        for joint, value in zip(self.joints, self._signs * q, strict=True):
            p.resetJointState(self.body, joint, value, physicsClientId=self.client)

    def _draw_offsets(self, tool_error: float, rng: np.random.Generator) -> FloatArray:
        """Random joint offsets (n,) rad; their mean tool error over the calibration's poses is `tool_error` m."""
        draw = rng.normal(size=len(self._chain))
        if tool_error == 0.0:
            return np.zeros(len(self._chain))
        small = 1e-3 * draw
        poses = np.array(self.robot.calibration.poses)
        moved = [np.linalg.norm(self._tool_at(q + small) - self._tool_at(q)) for q in poses]
        return small * tool_error / float(np.mean(moved))

    def _tool_at(self, q: FloatArray) -> FloatArray:
        """Tool position (3,) m in the world with the joints set to `q` (n,) rad."""
        self._reset_joints(q)
        return self.tool_pose().translation


@numba.njit(cache=True)
def _read(values: FloatArray, signs: FloatArray, offsets: FloatArray, slip: FloatArray, step: float) -> None:
    """Make of PyBullet's positions, velocities and efforts, the rows of `values` (3, n), what the encoders read.

    A position is less than the truth by `offsets` (n,), more by `slip` (n,), and a whole number of steps.
    """
    for i in range(len(signs)):
        values[0, i] = np.rint((signs[i] * values[0, i] - offsets[i] + slip[i]) / step) * step
        values[1, i] *= signs[i]
        values[2, i] *= signs[i]


@numba.njit(cache=True)
def _move_target(
    target: FloatArray, speeds: FloatArray, q: FloatArray, v: FloatArray, over: bool, reach: FloatArray, dt: float
) -> bool:
    """Move the servos' `target` (n,) towards a trajectory's `q`, with its `v`; write the `speeds` (n,).

    A servo turns no further than `reach` (n,) in a step; it follows a faster trajectory late. `over`: the trajectory's
    time is over. Says whether the servos are at its end, too.
    """
    ended = over and bool(np.all(np.abs(q - target) <= reach))
    for i in range(len(q)):
        wanted = q[i] - target[i]
        step = min(max(wanted, -reach[i]), reach[i])
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
    reach: FloatArray,
    offsets: FloatArray,
    signs: FloatArray,
    target: FloatArray,
    command: FloatArray,
) -> bool:
    """Move the `servo` (n,) towards `q` (n,) with velocities `v` (n,); whether any servo is late.

    A servo goes no further than `reach` (n,). Writes `q` to `target` (n,), and to `command` (2, n) the servos'
    positions plus `offsets` and their velocities, with the URDF's signs.
    """
    late = False
    for i in range(len(q)):
        position, velocity = q[i], v[i]
        if abs(q[i] - servo[i]) > reach[i] + 1e-9:
            late, velocity = True, 0.0
            position = servo[i] + min(max(q[i] - servo[i], -reach[i]), reach[i])
        target[i], servo[i] = q[i], position
        command[0, i] = signs[i] * (position + offsets[i])
        command[1, i] = signs[i] * velocity
    return late


def _camera_offset(cell: Cell, arm: str) -> tuple[float, float, float] | None:
    """Offset (m, in the mount) of the camera on that arm; None if it carries none."""
    offsets = {c.mount.arm: c.mount.offset for c in cell.known.cameras if isinstance(c.mount, WristMount)}
    return offsets.get(arm)


def _turn(rpy: Sequence[float]) -> Rotation | None:
    """The rotation by roll, pitch and yaw (rad) about fixed axes; None for none."""
    return Rotation.from_euler("xyz", rpy) if any(rpy) else None


def _framed(state: Sequence[Any], frame: Placed) -> RigidTransform:
    """world_from_frame, for the state of the link that the frame is fixed to."""
    turn, place = Rotation.from_quat(state[5]), np.array(state[4])
    if any(frame.xyz):
        place = place + turn.apply(frame.xyz)
    own = _turn(frame.rpy)
    return RigidTransform.from_components(place, turn if own is None else turn * own)
