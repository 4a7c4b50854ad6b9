"""The ViperX's gripper: two coupled fingers that hold by friction alone, and their noisy encoder."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np
import pybullet as p

from regrasp.interfaces.hidden_world import HiddenWorld
from regrasp.interfaces.reading import GripperReading
from regrasp.sim.robot.model import finger_position, pad_gap


@dataclass(frozen=True)
class GripperParameters:
    """The fingers' drive and their coupling."""

    open_force: float = 40.0  # N on each finger while opening or holding a gap
    closed_gap: float = 0.003  # m between the pads at the lower stop
    position_gain: float = 0.1  # PyBullet's position control while opening or holding a gap
    velocity_gain: float = 1.0
    spinning_friction: float = 0.005  # of the pads, against rotation about a contact's normal (PyBullet's unit)
    gear_force: float = 500.0  # N, limit of the constraint that couples the fingers
    gear_error_reduction: float = 0.3  # share of the coupling's error that is corrected in a step


class SimGripper:
    """Implements `regrasp.interfaces.devices.Gripper` with the fingers and pads among the `links` of an arm's `body`.

    `now` gives the arm's simulated seconds. The arm calls `sample()` when it is `due`.
    """

    def __init__(
        self,
        client: int,
        body: int,
        links: Mapping[str, int],
        now: Callable[[], float],
        hidden: HiddenWorld,
        rng: np.random.Generator,
        parameters: GripperParameters = GripperParameters(),
    ) -> None:
        self._client, self._body, self._now = client, body, now
        self._spec, self._errors, self._parameters = hidden.gripper, hidden.errors, parameters
        self._fingers = (links["left_finger_link"], links["right_finger_link"])
        self.pads = (links["left_pad"], links["right_pad"])
        self._noise = _noise(hidden.errors.finger_noise, int(rng.integers(2**31)))
        self._build(links["gripper_prop_link"])
        self._gap_command = parameters.closed_gap
        self._force: float | None = None
        self._forced_open, self._stuck, self._force_share = False, False, 1.0
        self._backlash_gap = self.true_gap()
        self.restart_clock()
        self._drive()

    def open(self, gap: float) -> None:
        """See `regrasp.interfaces.devices.Gripper`."""
        self._gap_command, self._force = gap, None
        self._drive()

    def close(self, force: float) -> None:
        """See `regrasp.interfaces.devices.Gripper`; `force` is limited to the gripper's maximum."""
        self._force = min(force, self._spec.max_force)
        self._drive()

    def reading(self) -> GripperReading:
        """The newest sample of the finger encoder, taken at the errors' `finger_rate`."""
        return self._reading

    def set_fault(
        self, *, forced_open: bool | None = None, stuck: bool | None = None, force_share: float | None = None
    ) -> None:
        """Switch faults on and off; those that are None stay as they are.

        `forced_open`: it drives open whatever it is commanded. `stuck`: it keeps its last command and takes no new one.
        `force_share`: the share of the closing force that is left.
        """
        self._forced_open = self._forced_open if forced_open is None else forced_open
        self._stuck = self._stuck if stuck is None else stuck
        self._force_share = self._force_share if force_share is None else force_share
        self._drive()

    def true_gap(self) -> float:
        """The true distance between the pads in metres."""
        states = p.getJointStates(self._body, self._fingers, physicsClientId=self._client)
        return pad_gap(states[0][0], states[1][0], self._spec.pad_thickness)

    def restart_clock(self) -> None:
        """Set the count of samples to zero; the arm's clock is zero now."""
        self._samples = -1
        self.sample()

    def sample(self) -> None:
        """Sample the encoder; the next sample is due at the arm's second `due`."""
        self._samples += 1
        self.due = (self._samples + 1 - 1e-6) / self._errors.finger_rate
        self._reading = self._sampled()

    def _sampled(self) -> GripperReading:
        half = self._errors.finger_backlash / 2
        gap = self.true_gap()
        self._backlash_gap = min(max(self._backlash_gap, gap - half), gap + half)
        noise = next(self._noise)
        step = self._errors.finger_resolution
        return GripperReading(self._now(), max(0.0, round((self._backlash_gap + noise) / step) * step))

    def _build(self, prop: int) -> None:
        """Couple the fingers, set the pads' friction, stop the URDF's propeller joint, and close the gripper."""
        body, client = self._body, self._client
        for pad in self.pads:
            p.changeDynamics(
                body,
                pad,
                lateralFriction=self._spec.friction,
                spinningFriction=self._parameters.spinning_friction,
                physicsClientId=client,
            )
        left, right = self._fingers
        gear = p.createConstraint(
            body, left, body, right, p.JOINT_GEAR, [0, 1, 0], [0, 0, 0], [0, 0, 0], physicsClientId=client
        )
        # One servo moves both fingers; the URDF's right finger has the opposite sign.
        p.changeConstraint(
            gear,
            gearRatio=1,
            maxForce=self._parameters.gear_force,
            erp=self._parameters.gear_error_reduction,
            physicsClientId=client,
        )
        p.setJointMotorControl2(body, prop, p.VELOCITY_CONTROL, targetVelocity=0, force=1, physicsClientId=client)
        closed = finger_position(self._parameters.closed_gap, self._spec.pad_thickness)
        p.resetJointState(body, left, closed, physicsClientId=client)
        p.resetJointState(body, right, -closed, physicsClientId=client)

    def _drive(self) -> None:
        if self._stuck:
            return
        if self._forced_open:
            self._drive_at(self._spec.speed, self._spec.max_force)
        elif self._force is not None:
            self._drive_at(-self._spec.speed, self._force_share * self._force)
        else:
            self._drive_to(finger_position(self._gap_command, self._spec.pad_thickness))

    def _drive_at(self, speed: float, force: float) -> None:
        """Open (speed > 0) or close; each finger moves at `speed` m/s with at most `force` N."""
        for finger, side in zip(self._fingers, (1, -1), strict=True):
            p.setJointMotorControl2(
                self._body,
                finger,
                p.VELOCITY_CONTROL,
                targetVelocity=side * speed,
                force=force,
                physicsClientId=self._client,
            )

    def _drive_to(self, position: float) -> None:
        """Move the finger joints to `position` m and hold them there."""
        for finger, side in zip(self._fingers, (1, -1), strict=True):
            p.setJointMotorControl2(
                self._body,
                finger,
                p.POSITION_CONTROL,
                targetPosition=side * position,
                positionGain=self._parameters.position_gain,
                velocityGain=self._parameters.velocity_gain,
                force=self._parameters.open_force,
                maxVelocity=self._spec.speed,
                physicsClientId=self._client,
            )


def _noise(deviation: float, seed: int, block: int = 256) -> Iterator[float]:
    """Normal noise; numbers that are drawn `block` at a time cost a tenth of those that are drawn one by one."""
    rng = np.random.default_rng(seed)
    while True:
        yield from rng.normal(0.0, deviation, block).tolist()
