"""Grippers: two fingers that one drive moves and that hold by friction alone, and their noisy encoder."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np
import pybullet as p

from regrasp.interfaces.hidden_world import Errors, GripperSpec
from regrasp.interfaces.reading import GripperReading
from regrasp.interfaces.robot.linkage import Linkage
from regrasp.interfaces.robot.parallel_jaw import ParallelJaw
from regrasp.interfaces.robot.parts import LinkageGripper, ParallelGripper
from regrasp.interfaces.robot.robot import Robot
from regrasp.sim.robot.model import pad_links


@dataclass(frozen=True)
class GripperParameters:
    """The fingers' drive and their coupling."""

    open_force: float = 40.0  # N on each finger while opening or holding a gap
    position_gain: float = 0.1  # PyBullet's position control while opening or holding a gap
    velocity_gain: float = 1.0
    spinning_friction: float = 0.005  # of the pads, against rotation about a contact's normal (PyBullet's unit)
    gear_force: float = 500.0  # N or N m, limit of the constraints that couple the fingers
    gear_error_reduction: float = 0.3  # share of the coupling's error that is corrected in a step
    linkage_error_reduction: float = 0.9  # the same of a linkage
    # kg m2 of each bar of a linkage, for the drive's inertia as its gearing reflects it; choice. An iteration of
    # PyBullet's solver gives the drive the momentum of its speed at most. With 45 iterations a part pressed with 40 N
    # sinks in by 0.6 mm in 0.8 s, and by 1.3 mm with half of this. With the bars' own, a millionth, pads give by 3 mm.
    linkage_inertia: float = 1e-3
    redriven: float = 1e-4  # m that a jaw moves before the torque of its drive is set anew


@dataclass(frozen=True, eq=False)
class GripperPlace:
    """Where a gripper is: PyBullet's client and body, its links and joints by name, and the arm's simulated seconds."""

    client: int
    body: int
    links: Mapping[str, int]
    joints: Mapping[str, int]
    now: Callable[[], float]


class SimGripper(ABC):
    """Implements `regrasp.interfaces.devices.Gripper`. The arm calls `sample()` when it is `due`."""

    def __init__(
        self,
        robot: Robot,
        place: GripperPlace,
        errors: Errors,
        rng: np.random.Generator,
        parameters: GripperParameters = GripperParameters(),
    ) -> None:
        self._place, self._client, self._body = place, place.client, place.body
        self._errors, self._parameters = errors, parameters
        self._robot, self._max_force = robot, robot.gripper.force
        self.pads = tuple(place.links[name] for name in pad_links(robot.gripper))
        self._noise = _noise(errors.finger_noise, int(rng.integers(2**31)))
        self._set_friction(robot.gripper.friction)
        self._build()
        self._gap_command = robot.gripper.closed
        self._force: float | None = None
        self._forced_open, self._stuck, self._force_share = False, False, 1.0
        self._gap = self._backlash_gap = self.true_gap()  # m, at the last sample
        self.restart_clock()
        self._drive()

    def open(self, gap: float) -> None:
        """See `regrasp.interfaces.devices.Gripper`."""
        self._gap_command, self._force = gap, None
        self._drive()

    def close(self, force: float) -> None:
        """See `regrasp.interfaces.devices.Gripper`; `force` is limited to the gripper's maximum."""
        self._force = min(force, self._max_force)
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

    @abstractmethod
    def true_gap(self) -> float:
        """The true distance between the pads in metres."""

    @abstractmethod
    def place_at(self, gap: float) -> None:
        """Set the fingers at once so that the pads are `gap` m apart, for pictures without physics."""

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
        gap = self._gap = self.true_gap()
        self._backlash_gap = min(max(self._backlash_gap, gap - half), gap + half)
        noise = next(self._noise)
        step = self._errors.finger_resolution
        return GripperReading(self._place.now(), max(0.0, round((self._backlash_gap + noise) / step) * step))

    def _set_friction(self, friction: float) -> None:
        for pad in self.pads:
            p.changeDynamics(
                self._body,
                pad,
                lateralFriction=friction,
                spinningFriction=self._parameters.spinning_friction,
                physicsClientId=self._client,
            )

    def _couple(
        self, joint: int, other: int, ratio: float, axis: tuple[float, float, float], error_reduction: float
    ) -> None:
        """Couple two joints (PyBullet's numbers) of the body, about or along this axis of their links."""
        gear = p.createConstraint(
            self._body, joint, self._body, other, p.JOINT_GEAR, axis, [0, 0, 0], [0, 0, 0], physicsClientId=self._client
        )
        p.changeConstraint(
            gear,
            gearRatio=ratio,
            maxForce=self._parameters.gear_force,
            erp=error_reduction,
            physicsClientId=self._client,
        )

    @abstractmethod
    def _build(self) -> None:
        """Couple the fingers and close the gripper."""

    def _drive(self) -> None:
        if self._stuck:
            return
        if self._forced_open:
            self._drive_at(self._robot.gripper.speed, self._max_force)
        elif self._force is not None:
            self._drive_at(-self._robot.gripper.speed, self._force_share * self._force)
        else:
            self._drive_to(self._gap_command)

    @abstractmethod
    def _drive_at(self, speed: float, force: float) -> None:
        """Open (speed > 0) or close; each finger moves at `speed` m/s with at most `force` N."""

    @abstractmethod
    def _drive_to(self, gap: float) -> None:
        """Move the pads until they are `gap` m apart, and hold them there."""


class SimParallelGripper(SimGripper):
    """Two sliding fingers."""

    def true_gap(self) -> float:
        """See `SimGripper`."""
        left, right = p.getJointStates(self._body, self._fingers, physicsClientId=self._client)
        return float(self._jaw.gap(left[0], right[0]))

    def place_at(self, gap: float) -> None:
        """See `SimGripper`."""
        position = self._jaw.position(gap)
        for finger, sign in zip(self._fingers, self._jaw.signs, strict=True):
            p.resetJointState(self._body, finger, sign * position, physicsClientId=self._client)

    @property
    def _gripper(self) -> ParallelGripper:
        assert isinstance(self._robot.gripper, ParallelGripper)
        return self._robot.gripper

    @property
    def _jaw(self) -> ParallelJaw:
        return self._robot.parallel_jaw

    def _build(self) -> None:
        self._fingers = tuple(self._place.joints[name] for name in self._gripper.joints)
        left, right = self._fingers
        ratio, axis = -self._jaw.signs[0] * self._jaw.signs[1], tuple(self._jaw.joints[0].axis.tolist())
        self._couple(left, right, ratio, axis, self._parameters.gear_error_reduction)  # one servo moves both
        for name in self._gripper.spin:
            joint, client = self._place.joints[name], self._client
            p.setJointMotorControl2(
                self._body, joint, p.VELOCITY_CONTROL, targetVelocity=0, force=1, physicsClientId=client
            )
        self.place_at(self._gripper.closed)

    def _drive_at(self, speed: float, force: float) -> None:
        for finger, sign in zip(self._fingers, self._jaw.signs, strict=True):
            p.setJointMotorControl2(
                self._body,
                finger,
                p.VELOCITY_CONTROL,
                targetVelocity=sign * speed,
                force=force,
                physicsClientId=self._client,
            )

    def _drive_to(self, gap: float) -> None:
        position = self._jaw.position(gap)
        for finger, sign in zip(self._fingers, self._jaw.signs, strict=True):
            p.setJointMotorControl2(
                self._body,
                finger,
                p.POSITION_CONTROL,
                targetPosition=sign * position,
                positionGain=self._parameters.position_gain,
                velocityGain=self._parameters.velocity_gain,
                force=self._parameters.open_force,
                maxVelocity=self._robot.gripper.speed,
                physicsClientId=self._client,
            )


class SimLinkageGripper(SimGripper):
    r"""Two fingers on linkages. PyBullet ignores `mimic`: gears couple all joints to the driven one.

    A finger's force follows from the drive's torque by virtual work: with the opening :math:`g(\theta)` each finger
    moves by :math:`g/2`, so that :math:`\tau = F |dg/d\theta| / 2` on each side.
    """

    def true_gap(self) -> float:
        """See `SimGripper`."""
        states = p.getJointStates(self._body, self._drives, physicsClientId=self._client)
        return self._linkage.opening(sum(state[0] for state in states) / len(states))

    def place_at(self, gap: float) -> None:
        """See `SimGripper`."""
        for name, position in self._linkage.positions(gap).items():
            p.resetJointState(self._body, self._place.joints[name], position, physicsClientId=self._client)

    def sample(self) -> None:
        """See `SimGripper`; the torque for the present force depends on how far the jaw is open."""
        super().sample()
        pressing = self._force is not None and not self._stuck and not self._forced_open
        if pressing and abs(self._gap - self._driven_gap) > self._parameters.redriven:
            self._drive()

    @property
    def _linkage(self) -> Linkage:
        return self._robot.linkage

    def _build(self) -> None:
        gripper, joints = self._robot.gripper, self._place.joints
        assert isinstance(gripper, LinkageGripper)
        self._driven_gap = np.inf
        tree, followers = self._robot.tree, self._linkage.followers
        # One joint a side is driven: the first on the way to its pad.
        sides = [next(joint.name for joint in tree.way_to(pad) if joint.name in followers) for pad in gripper.pads]
        self._drives = tuple(joints[name] for name in sides)
        for name, (multiplier, _) in followers.items():
            bar, inertia = joints[name], [self._parameters.linkage_inertia] * 3
            p.setJointMotorControl2(self._body, bar, p.VELOCITY_CONTROL, force=0, physicsClientId=self._client)
            p.changeDynamics(self._body, bar, localInertiaDiagonal=inertia, physicsClientId=self._client)
            if name != gripper.joint:
                # With the next bar above it, the solver passes a force on in fewer iterations.
                above = [joint.name for joint in tree.way_to(tree.joints[name].parent) if joint.name in followers]
                other = above[-1] if above else gripper.joint
                axis, ratio = tuple(tree.joints[name].axis.tolist()), -multiplier / followers[other][0]
                self._couple(joints[other], bar, ratio, axis, self._parameters.linkage_error_reduction)
        self.place_at(gripper.closed)

    def _drive_at(self, speed: float, force: float) -> None:
        slope, self._driven_gap = self._slope(), self._gap
        for joint in self._drives:
            p.setJointMotorControl2(
                self._body,
                joint,
                p.VELOCITY_CONTROL,
                targetVelocity=-speed / slope,
                force=force * slope,
                physicsClientId=self._client,
            )

    def _drive_to(self, gap: float) -> None:
        slope = self._slope()
        for joint in self._drives:
            p.setJointMotorControl2(
                self._body,
                joint,
                p.POSITION_CONTROL,
                targetPosition=self._linkage.position(gap),
                positionGain=self._parameters.position_gain,
                velocityGain=self._parameters.velocity_gain,
                force=self._parameters.open_force * slope,
                maxVelocity=self._robot.gripper.speed / slope,
                physicsClientId=self._client,
            )

    def _slope(self) -> float:
        """How far (m) each finger moves by a rad of the drive, at the present opening."""
        linkage, step = self._linkage, 1e-3
        here = linkage.position(self.true_gap())
        here = min(max(here, linkage.driven[0] + step), linkage.driven[-1] - step)
        return (linkage.opening(here - step) - linkage.opening(here + step)) / (4 * step)


def make_gripper(
    robot: Robot,
    place: GripperPlace,
    errors: Errors,
    rng: np.random.Generator,
    parameters: GripperParameters = GripperParameters(),
) -> SimGripper:
    """The gripper of a robot that is loaded in PyBullet."""
    kind = SimParallelGripper if isinstance(robot.gripper, ParallelGripper) else SimLinkageGripper
    return kind(robot, place, errors, rng, parameters)


def robot_in_world(robot: Robot, spec: GripperSpec) -> Robot:
    """The robot with the gripper that it has in this world."""
    names = {"max_force": "force", "speed": "speed", "friction": "friction"}
    given = {name: value for key, name in names.items() if (value := getattr(spec, key)) is not None}
    gripper = robot.gripper.model_copy(update=given)
    if spec.pad_thickness is not None and isinstance(gripper, ParallelGripper):
        pads = gripper.pads.model_copy(update={"thickness": spec.pad_thickness})
        gripper = gripper.model_copy(update={"pads": pads})
    return robot if gripper == robot.gripper else robot.model_copy(update={"gripper": gripper})


def _noise(deviation: float, seed: int, block: int = 256) -> Iterator[float]:
    """Normal noise; numbers that are drawn `block` at a time cost a tenth of those that are drawn one by one."""
    rng = np.random.default_rng(seed)
    while True:
        yield from rng.normal(0.0, deviation, block).tolist()
