r"""The mouth of a free socket: a chamfered bore that a plug must be aligned with to go in.

The plug is a cylinder, its tip a point of its axis that may lie as far off the socket's axis as the bore is wider than
the plug. Seen so the mouth is a funnel in the space of that point (configuration space, Lozano-Perez 1983): with the
depth x and the offset r its free part is

.. math:: x < 0 \quad\text{or}\quad r < c + b - x, \; x < b

for the clearance c, with what the bore's insert gives way, and the chamfer b at 45 degrees; at its end begins the bore
(`Bore`). A tip that overlaps face or chamfer by :math:`\delta`, and moves with v, is pushed back along the normal n:

.. math:: F = \max(k \delta - s \, v \cdot n, 0)

Friction is a spring that slips (Dahl 1968): k times the way along the surface, no more than :math:`\mu F`. None of this
depends on the gripper.
"""

import math
from dataclasses import dataclass, field

import numba
import numpy as np
import pybullet as p

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cable.cell import Connector, Socket
from regrasp.interfaces.cell import pose_along
from regrasp.sim.bodies import BodyLink
from regrasp.sim.cable.bore import Bore, BoreParameters
from regrasp.sim.cable.cable import BodyState
from regrasp.sim.cable.fixtures import x_axis


@dataclass(frozen=True)
class MouthParameters:
    """A socket's mouth."""

    clearance: float = 0.00075  # m between plug and bore all round; choice: a loose fit of 20 mm
    chamfer: float = 0.003  # m by which the bore's edge is cut back at 45 degrees; choice
    give: float = 0.0005  # m that the bore's insert gives way to a plug that enters; choice
    most_tilt_deg: float = 7.0  # of a plug that enters the bore; choice: 15 mm deep, the clearance lets it tilt by 6
    # N/m. An explicit step of 1/480 s bears four times as much at the tip of 25 g.
    stiffness: float = 2500.0
    damping: float = 0.7  # N s/m; choice: a tenth of the critical one
    friction: float = 0.2  # of plastic on plastic
    tip_tilt_deg: float = 45.0  # what comes through the face with more is no tip; choice
    bore: BoreParameters = field(default_factory=BoreParameters)


class SocketMouth:
    """The mouth of one socket. A plug is met only when its tip comes through the face from the front.

    A plug that is too skew for the bore stands on its edge.
    """

    def __init__(
        self, link: BodyLink, socket: Socket, connector: Connector, parameters: MouthParameters = MouthParameters()
    ) -> None:
        self._link, self._socket, self._parameters = link, socket, parameters
        self._half = 0.5 * connector.length
        axis = np.asarray(socket.axis) / np.linalg.norm(socket.axis)
        place = np.asarray(socket.center) - 0.5 * socket.size[1] * axis
        self._pose = pose_along((place[0], place[1], place[2]), socket.axis)
        self._mouth_from_world: FloatArray = np.ascontiguousarray(self._pose.inv().as_matrix())
        edges = 0.5 * (socket.world_from_block.as_matrix() * socket.size)[:, [0, 2]].T @ self._pose.rotation.as_matrix()
        self._place: list[float] = place.tolist()
        self._reach = connector.length + socket.depth  # m from there; a connector further off meets nothing
        self._face = edges / np.sum(edges**2, axis=1, keepdims=True)  # within 1 to both sides on the face
        self._tip_cos = math.cos(math.radians(parameters.tip_tilt_deg))
        self._bore_cos = math.cos(math.radians(parameters.most_tilt_deg))
        values = parameters
        self._shape = np.array(
            [
                values.clearance + values.give,
                values.chamfer,
                connector.radius,
                values.stiffness,
                values.damping,
                values.friction,
            ]
        )
        self._ahead = self._met = False
        self._anchor = np.zeros(3)  # m, in the mouth; where the friction's spring is fixed
        self._bore: Bore | None = None

    @property
    def holds(self) -> bool:
        """Whether a plug has clicked in."""
        return self._bore is not None and self._bore.holds

    def step(self, connector: BodyState) -> None:
        """Push or hold the connector; call before every physics step."""
        if self._bore is None and math.dist(self._place, connector.position) > self._reach:
            self._ahead = self._met = False
            return
        state = _in_mouth(self._mouth_from_world, np.concatenate(connector), self._half)
        if self._bore is not None and state[0] < self._parameters.chamfer:
            self._bore.close()
            self._bore, self._anchor = None, state[:3].copy()
        if self._bore is None and self._meets(state) and self._enters(state):
            socket, values = self._socket, self._parameters.bore
            self._bore = Bore(self._link, connector, self._pose, socket.depth, socket.pull_out_force, values)
        if self._bore is not None:
            self._bore.step(connector, float(state[0]), float(state[6]))
        elif self._met:
            self._push(connector, state)

    def _meets(self, state: FloatArray) -> bool:
        """Whether the tip is in the block, through its face."""
        on_face = state[3] > self._tip_cos and bool(np.all(np.abs(self._face @ state[:3]) < 1.0))
        if state[0] <= 0.0 or not on_face:
            self._ahead, self._met, self._anchor = on_face and state[0] <= 0.0, False, state[:3].copy()
            return False
        self._met, self._ahead = self._met or self._ahead, False
        return self._met

    def _enters(self, state: FloatArray) -> bool:
        values = self._parameters
        return (
            state[0] > values.chamfer
            and math.hypot(state[1], state[2]) < values.clearance + values.give
            and state[3] > self._bore_cos
        )

    def _push(self, connector: BodyState, state: FloatArray) -> None:
        link, turn, at = self._link, self._mouth_from_world[:3, :3], connector.position
        client = link.client
        force, torque = _contact(state, self._anchor, self._shape, self._half)
        p.applyExternalForce(link.body, link.link, (force @ turn).tolist(), at, p.WORLD_FRAME, physicsClientId=client)
        p.applyExternalTorque(link.body, link.link, (torque @ turn).tolist(), p.WORLD_FRAME, physicsClientId=client)


@numba.njit(cache=True)
def _in_mouth(mouth_from_world: FloatArray, state: FloatArray, half: float) -> FloatArray:
    """Tip (3,) m, axis (3,) and velocity of the tip (3,) m/s of a connector, in the mouth, one after the other.

    `state` (13,) is its position, quaternion, velocity and rate in the world, `half` its half length in m.
    """
    turn, axis = np.ascontiguousarray(mouth_from_world[:3, :3]), x_axis(state[3:7])
    found = np.empty(9)
    found[:3] = turn @ (state[:3] + half * axis) + mouth_from_world[:3, 3]
    found[3:6] = turn @ axis
    found[6:] = turn @ (state[7:10] + half * np.cross(state[10:13], axis))
    return found


@numba.njit(cache=True)
def _contact(state: FloatArray, anchor: FloatArray, shape: FloatArray, half: float) -> tuple[FloatArray, FloatArray]:
    """Force (3,) N and torque (3,) N m about the connector's centre that face or chamfer exert, in the mouth's frame.

    `state` (9,) is as of `_in_mouth`, `anchor` (3,) where the friction's spring is fixed, which moves on when it slips.
    `shape` (6,): clearance, chamfer, the plug's radius (m), stiffness, damping, and the coefficient of friction.
    """
    clearance, chamfer, radius, stiffness, damping, friction = shape
    tip, axis = state[:3], state[3:6]
    offset = np.sqrt(tip[1] ** 2 + tip[2] ** 2)
    outward = np.array([0.0, tip[1], tip[2]]) / max(offset, 1e-9)
    normal, overlap = np.array([-1.0, 0.0, 0.0]), tip[0]
    if offset < clearance:  # too skew for the bore
        overlap = tip[0] - chamfer
    elif offset < clearance + chamfer:
        normal = (normal - outward) * np.sqrt(0.5)
        overlap = (offset - clearance - chamfer + tip[0]) * np.sqrt(0.5)
    if overlap <= 0.0:
        anchor[:] = tip
        return np.zeros(3), np.zeros(3)
    load = max(stiffness * overlap - damping * np.sum(state[6:] * normal), 0.0)
    way = tip - anchor
    way -= np.sum(way * normal) * normal
    length = np.sqrt(np.sum(way**2))
    if stiffness * length > friction * load:
        way *= friction * load / (stiffness * length)
    anchor[:] = tip - way
    force = load * normal - stiffness * way
    # The tip's edge is pressed; far off the axis the whole of its face.
    at = half * axis + radius * min(1.0, (clearance + chamfer) / max(offset, 1e-9)) * outward
    return force, np.cross(at, force)
