"""Holders of the connector in the cell: a socket with a pull-out force, and a snap-in clip.

Both are physical models with stated numbers. Neither depends on the gripper, so neither helps the robot.
"""

from collections import deque
from dataclasses import dataclass

import numpy as np
import pybullet as p
from scipy.spatial.transform import RigidTransform

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cell import Clip


@dataclass(frozen=True)
class HoldParameters:
    """The constraint that fixes a plugged connector."""

    constraint_force: float = 1e4  # N, limit of the constraint itself: far above the forces at which it is released
    force_window: int = (
        5  # physics steps over which the force is averaged, so that a solver's spike does not release it
    )


@dataclass(frozen=True)
class ClipParameters:
    """The clip's rubber lips; forces and distances that differ between clips are in the cell file."""

    lip_travel: float = 0.010  # m over which the force grows to its full value
    lip_torque: float = 0.3  # N m, largest aligning torque: 15 N on lips 0.02 m apart
    click_speed: float = 0.02  # m/s; the lips close on a connector that is slower than this ...
    click_seconds: float = 0.2  # ... for so long
    rearm_distance: float = 1.5  # capture distances by which a pulled-out connector must leave before it is taken again


@dataclass(frozen=True)
class BodyLink:
    """A link of a body in a PyBullet client; -1 is the base."""

    client: int
    body: int
    link: int


class Hold:
    """A fixed constraint between the world and a link at the pose `at`, world_from_link."""

    def __init__(self, link: BodyLink, at: RigidTransform, parameters: HoldParameters = HoldParameters()) -> None:
        self._client, self._max_force = link.client, parameters.constraint_force
        # Child frame in the world; the parent frame is the link's centre.
        self._constraint: int | None = p.createConstraint(
            link.body,
            link.link,
            -1,
            -1,
            p.JOINT_FIXED,
            [0, 0, 0],
            [0, 0, 0],
            at.translation.tolist(),
            [0, 0, 0, 1],
            at.rotation.as_quat().tolist(),
            physicsClientId=link.client,
        )
        p.changeConstraint(self._constraint, maxForce=self._max_force, physicsClientId=link.client)
        self._forces: deque[FloatArray] = deque(maxlen=parameters.force_window)

    def move(self, to: RigidTransform) -> None:
        """Move the constraint to the pose `to`, and the link with it; for laying the cable before a run."""
        p.changeConstraint(
            self._constraint,
            to.translation.tolist(),
            jointChildFrameOrientation=to.rotation.as_quat().tolist(),
            maxForce=self._max_force,
            physicsClientId=self._client,
        )

    def force(self) -> FloatArray:
        """Add the last step's constraint force, and return the mean (3,) N over the window, in the world frame."""
        self._forces.append(np.array(p.getConstraintState(self._constraint, physicsClientId=self._client)[:3]))
        return np.asarray(np.mean(self._forces, axis=0))

    def release(self) -> None:
        """Remove the constraint."""
        if self._constraint is not None:
            p.removeConstraint(self._constraint, physicsClientId=self._client)
            self._constraint = None


class SocketHold:
    """A socket with a plug in it. It releases the plug when this is pulled against `axis` (3,) with `pull_out_force` N.

    `axis` is the direction in which the plug goes in. A force across it, as a closing gripper makes, does not release
    the plug. With `axis` None, for a stand, a force of that size in any direction does. `getConstraintState` gives the
    constraint's reaction in the world frame (measured), so a pull along -axis reads as a force along +axis.
    """

    def __init__(self, hold: Hold, axis: FloatArray | None, pull_out_force: float) -> None:
        self._hold: Hold | None = hold
        self._axis = None if axis is None else axis / np.linalg.norm(axis)
        self._limit = pull_out_force

    @property
    def holds(self) -> bool:
        """Whether the plug is still in."""
        return self._hold is not None

    def step(self) -> None:
        """Check the force; call after every physics step."""
        if self._hold is None:
            return
        force = self._hold.force()
        if float(np.linalg.norm(force) if self._axis is None else force @ self._axis) > self._limit:
            self._hold.release()
            self._hold = None


class ClipHold:
    r"""The stow clip: rubber lips that close on a connector at rest between them and pull it to the seat.

    The lips are a spring-damper whose spring force is limited, with :math:`\Delta` the vector to the seat and
    :math:`v` the connector's velocity:

    .. math:: F = \mathrm{limit}(k \Delta, F_{hold}) - \sqrt{k m} \, v, \quad k = F_{hold} / \mathtt{lip\_travel}

    The damping is half of the critical damping of a mass m on the spring. A torque of the same form aligns the
    connector's axis; rotation about that axis is free. A connector that is pulled past `capture_distance` is released.

    `mass` (kg) and `inertia` (kg m2, across the axis) are the connector's, `step` is the physics step in s.
    """

    def __init__(
        self,
        link: BodyLink,
        clip: Clip,
        mass: float,
        inertia: float,
        step: float,
        parameters: ClipParameters = ClipParameters(),
    ) -> None:
        self._target, self._clip, self._dt, self._parameters = link, clip, step, parameters
        self._seat = clip.world_from_seat
        self._axis = self._seat.rotation.apply([1.0, 0.0, 0.0])
        self._cos = float(np.cos(np.deg2rad(clip.capture_angle_deg)))
        self._stiffness = clip.hold_force / parameters.lip_travel
        self._torsion = parameters.lip_torque / float(np.sin(np.deg2rad(clip.capture_angle_deg)))
        self._damping = float(np.sqrt(self._stiffness * mass))
        self._torsion_damping = float(np.sqrt(self._torsion * inertia))
        self._resting = 0.0
        self._armed = True
        self.holds = False

    def step(self, connector: RigidTransform, velocity: FloatArray, rate: FloatArray) -> None:
        """Take, pull or release the connector; call before every physics step.

        `connector` is its pose in the world, `velocity` (3,) m/s that of its centre, `rate` (3,) rad/s its rotation.
        """
        offset = self._seat.translation - connector.translation
        distance = float(np.linalg.norm(offset))
        axis = connector.rotation.apply([1.0, 0.0, 0.0])
        if self.holds and distance > self._clip.capture_distance:
            self.holds, self._armed = False, False
        if self.holds:
            self._pull(connector, offset, velocity, axis, rate)
            return
        self._armed = self._armed or distance > self._parameters.rearm_distance * self._clip.capture_distance
        inside = self._armed and distance < self._clip.capture_distance and float(axis @ self._axis) > self._cos
        resting = inside and float(np.linalg.norm(velocity)) < self._parameters.click_speed
        self._resting = self._resting + self._dt if resting else 0.0
        if self._resting >= self._parameters.click_seconds:
            self.holds, self._resting = True, 0.0

    def _pull(
        self, connector: RigidTransform, offset: FloatArray, velocity: FloatArray, axis: FloatArray, rate: FloatArray
    ) -> None:
        force = _limited(self._stiffness * offset, self._clip.hold_force) - self._damping * velocity
        turning = rate - axis * float(rate @ axis)
        torque = (
            _limited(self._torsion * np.cross(axis, self._axis), self._parameters.lip_torque)
            - self._torsion_damping * turning
        )
        at, target = connector.translation.tolist(), self._target
        client = target.client
        p.applyExternalForce(target.body, target.link, force.tolist(), at, p.WORLD_FRAME, physicsClientId=client)
        p.applyExternalTorque(target.body, target.link, torque.tolist(), p.WORLD_FRAME, physicsClientId=client)


def _limited(vector: FloatArray, limit: float) -> FloatArray:
    size = float(np.linalg.norm(vector))
    return vector if size <= limit else vector * (limit / size)
