"""What holds the connector in the cell: the bodies of sockets and clip, and the model of a snap-in clip.

The model has stated numbers, and does not depend on the gripper, so it does not help the robot.
"""

import math
from dataclasses import dataclass

import numba
import numpy as np
import pybullet as p

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cable.cell import Clip, KnownCable
from regrasp.interfaces.cell import Box
from regrasp.sim.bodies import BodyLink, build_box
from regrasp.sim.cable.cable import BodyState
from regrasp.sim.render.fiducials import compound_visual, tag_boxes


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
