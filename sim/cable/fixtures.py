"""Holders of the connector in the cell, and their bodies: a socket with a pull-out force, and a snap-in clip.

Both are physical models with stated numbers. Neither depends on the gripper, so neither helps the robot.
"""

import math
import operator
from collections import deque
from dataclasses import dataclass

import numba
import numpy as np
import pybullet as p
from scipy.spatial.transform import RigidTransform

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cable.cell import Clip, KnownCable
from regrasp.interfaces.cell import Box
from regrasp.sim.bodies import build_box
from regrasp.sim.cable.cable import BodyState
from regrasp.sim.render.fiducials import compound_visual, tag_boxes


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


def build_fixtures(client: int, cable: KnownCable) -> dict[str, int]:
    """Create the clip's bracket, the sockets' blocks and the clip's tag; the ids of all but the tag by name."""
    bodies = {box.name: build_box(client, box) for box in cable.clip.bracket}
    for socket in cable.sockets:
        block = Box(name=socket.name, center=socket.center, size=socket.size, color=socket.color)
        bodies[socket.name] = build_box(client, block, socket.world_from_block)
    tag = cable.clip.tag
    if tag is not None:
        world_from_tag = cable.clip.world_from_seat * tag.body_from_tag
        p.createMultiBody(0, -1, compound_visual(client, tag_boxes(tag), world_from_tag), physicsClientId=client)
    return bodies


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
        self._forces: deque[tuple[float, float, float]] = deque(maxlen=parameters.force_window)

    def move(self, position: list[float], quaternion: list[float]) -> None:
        """Move the constraint to that pose in the world, and the link with it; for laying the cable before a run."""
        p.changeConstraint(
            self._constraint,
            position,
            jointChildFrameOrientation=quaternion,
            maxForce=self._max_force,
            physicsClientId=self._client,
        )

    def force(self) -> list[float]:
        """Add the last step's constraint force, and return the mean (3,) N over the window, in the world frame."""
        self._forces.append(p.getConstraintState(self._constraint, physicsClientId=self._client)[:3])
        return [sum(along) / len(self._forces) for along in zip(*self._forces, strict=True)]

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
        self._axis = None if axis is None else (axis / np.linalg.norm(axis)).tolist()
        self._limit = pull_out_force

    @property
    def holds(self) -> bool:
        """Whether the plug is still in."""
        return self._hold is not None

    def release(self) -> None:
        """Let the plug go."""
        if self._hold is not None:
            self._hold.release()
            self._hold = None

    def step(self) -> None:
        """Check the force; call after every physics step."""
        if self._hold is None:
            return
        force = self._hold.force()
        pull = math.hypot(*force) if self._axis is None else sum(map(operator.mul, force, self._axis))
        if pull > self._limit:
            self.release()


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
        self._seat: list[float] = clip.world_from_seat.translation.tolist()
        self._axis: FloatArray = clip.world_from_seat.rotation.apply([1.0, 0.0, 0.0])
        self._cos = float(np.cos(np.deg2rad(clip.capture_angle_deg)))
        stiffness = clip.hold_force / parameters.lip_travel
        torsion = parameters.lip_torque / float(np.sin(np.deg2rad(clip.capture_angle_deg)))
        self._force = np.array([stiffness, clip.hold_force, np.sqrt(stiffness * mass)])
        self._torque = np.array([torsion, parameters.lip_torque, np.sqrt(torsion * inertia)])
        self._resting = 0.0
        self._armed = True
        self.holds = False

    def step(self, connector: BodyState) -> None:
        """Take, pull or release the connector; call before every physics step."""
        distance = math.dist(self._seat, connector.position)
        if distance > self._clip.capture_distance:
            if self.holds:
                self.holds, self._armed = False, False
            self._armed = self._armed or distance > self._parameters.rearm_distance * self._clip.capture_distance
            self._resting = 0.0
            return
        if self.holds:
            self._pull(connector)
            return
        aligned = float(x_axis(np.array(connector.quaternion)) @ self._axis) > self._cos
        resting = self._armed and aligned and math.hypot(*connector.velocity) < self._parameters.click_speed
        self._resting = self._resting + self._dt if resting else 0.0
        if self._resting >= self._parameters.click_seconds:
            self.holds, self._resting = True, 0.0

    def _pull(self, connector: BodyState) -> None:
        force, torque = _lip_wrench(
            np.concatenate(connector), np.array(self._seat), self._axis, self._force, self._torque
        )
        at, target = connector.position, self._target
        client = target.client
        p.applyExternalForce(target.body, target.link, force.tolist(), at, p.WORLD_FRAME, physicsClientId=client)
        p.applyExternalTorque(target.body, target.link, torque.tolist(), p.WORLD_FRAME, physicsClientId=client)


@numba.njit(cache=True)
def _lip_wrench(
    state: FloatArray, seat: FloatArray, seat_axis: FloatArray, force: FloatArray, torque: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """The lips' force (3,) N and torque (3,) N m on a connector, in the world.

    `state` (13,) is the connector's position, quaternion, velocity and rate; `seat` (3,) m and `seat_axis` (3,) the
    seat's position and x axis. `force` (3,) and `torque` (3,) are stiffness, limit and damping in their units.
    """
    axis, velocity, rate = x_axis(state[3:7]), state[7:10], state[10:13]
    pull = _limited(force[0] * (seat - state[:3]), force[1]) - force[2] * velocity
    turning = rate - axis * np.sum(rate * axis)
    turn = _limited(torque[0] * np.cross(axis, seat_axis), torque[1]) - torque[2] * turning
    return pull, turn


@numba.njit(cache=True)
def x_axis(quaternion: FloatArray) -> FloatArray:
    """The x axis (3,) of the frame that a quaternion x, y, z, w (4,) of any length turns."""
    x, y, z, w = quaternion / np.sqrt(np.sum(quaternion * quaternion))
    return np.array([x * x - y * y - z * z + w * w, 2 * (x * y + z * w), 2 * (x * z - y * w)])


@numba.njit(cache=True)
def _limited(vector: FloatArray, limit: float) -> FloatArray:
    size = np.sqrt(np.sum(vector * vector))
    return vector if size <= limit else vector * (limit / size)
