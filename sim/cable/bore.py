"""The bore of a socket with a plug in it: an insert that floats in the socket's block, friction, and a click."""

import math
from dataclasses import dataclass

import numba
import numpy as np
import pybullet as p
from scipy.spatial.transform import RigidTransform

from regrasp.interfaces.arrays import FloatArray
from regrasp.sim.bodies import BodyLink
from regrasp.sim.cable.cable import BodyState


@dataclass(frozen=True)
class BoreParameters:
    """A bore. Its depth and the pull-out force, which differ between sockets, are in the cell file."""

    # The insert's float: it stands for the panel, the plug's soft body and an arm's servos, which PyBullet's lack.
    stiffness: float = 5000.0  # N/m across; choice
    torsion: float = 20.0  # N m/rad; choice: a stiff cable, bent by 20 degrees, then turns the plug by 1.5
    mass: float = 0.05  # kg of the insert; choice: twice the plug. An explicit step of 1/480 s bears its springs
    inertia: float = 2e-4  # kg m2; choice
    damping_ratio: float = 0.5
    insertion_force: float = 3.0  # N of friction of the contact springs on a plug that is all the way in; choice
    friction_stiffness: float = 8000.0  # N/m before the friction slips; choice
    click_depth: float = 0.001  # m short of the bore's end at which the plug clicks in; choice
    seat_stiffness: float = 5000.0  # N/m along the axis of a plug that has clicked in, and of the bore's end; choice
    seat_damping: float = 5.0  # N s/m; choice
    joint_force: float = 1e4  # N, limit of the slider joint itself: far above the forces of the springs


class Bore:
    r"""A plug in a bore of `depth` m, from the moment at which its tip passes the chamfer.

    The plug slides in an insert along its own axis (a slider joint). Springs and dampers hold the insert at the pose
    that it has at first, `mouth` (world_from_mouth). Along the axis, with the tip x m deep, friction is a spring that
    slips (Dahl 1968): no more than :math:`f x / d` for the depth d and the force f of the contact springs. Within
    `click_depth` of the end the plug clicks in: then a stiffer spring holds it where it is until it is pulled with
    `pull_out_force` N.
    """

    def __init__(
        self,
        link: BodyLink,
        connector: BodyState,
        mouth: RigidTransform,
        depth: float,
        pull_out_force: float,
        parameters: BoreParameters = BoreParameters(),
    ) -> None:
        self._link, self._mouth, self._parameters = link, mouth, parameters
        self._depth, self._limit, self._seat = depth, pull_out_force, 0.0
        self._anchor: float | None = None  # m; where the friction's spring is fixed
        self.holds = False
        self._insert, self._joint = self._build(connector)
        values = parameters
        across = 2 * values.damping_ratio * math.sqrt(values.stiffness * values.mass)
        about = 2 * values.damping_ratio * math.sqrt(values.torsion * values.inertia)
        self._springs = np.array([values.stiffness, across, values.torsion, about])
        self._home = mouth.as_matrix()

    def step(self, connector: BodyState, tip: float, speed: float) -> None:
        """Act on plug and insert before a physics step, with the tip `tip` m deep and going in at `speed` m/s."""
        along = self._along(tip, speed)
        self._push(self._link, connector.position, along * self._home[:3, 0])
        client = self._link.client
        place = p.getBasePositionAndOrientation(self._insert, physicsClientId=client)
        state = BodyState(*place, *p.getBaseVelocity(self._insert, physicsClientId=client))
        force, torque = _float(np.concatenate(state), self._home, self._springs)
        self._push(BodyLink(client, self._insert, -1), state.position, force)
        p.applyExternalTorque(self._insert, -1, torque.tolist(), p.WORLD_FRAME, physicsClientId=client)

    def close(self) -> None:
        """Let go of the plug, which has left the bore."""
        p.removeConstraint(self._joint, physicsClientId=self._link.client)
        p.removeBody(self._insert, physicsClientId=self._link.client)

    def _along(self, tip: float, speed: float) -> float:
        """The force in N along the bore on a plug whose tip is so deep; the click may take it or let it go."""
        values = self._parameters
        damping = values.seat_damping * speed
        if self.holds:
            spring = values.seat_stiffness * (self._seat - tip)
            if spring <= self._limit:
                return spring - damping
            self.holds, self._anchor = False, tip
        elif tip > self._depth - values.click_depth:
            self.holds, self._seat = True, min(tip, self._depth)
            return values.seat_stiffness * (self._seat - tip) - damping
        limit = values.insertion_force * min(max(tip / self._depth, 0.0), 1.0)
        way = 0.0 if self._anchor is None else values.friction_stiffness * (tip - self._anchor)
        friction = -min(max(way, -limit), limit)
        self._anchor = tip + friction / values.friction_stiffness
        return friction - damping

    def _build(self, connector: BodyState) -> tuple[int, int]:
        """The insert, and the slider joint between it and the plug."""
        client, values, link = self._link.client, self._parameters, self._link
        place, turn = self._mouth.translation.tolist(), self._mouth.rotation.as_quat().tolist()
        insert = p.createMultiBody(values.mass, -1, -1, place, turn, physicsClientId=client)
        inertia = [values.inertia] * 3
        p.changeDynamics(
            insert, -1, localInertiaDiagonal=inertia, linearDamping=0, angularDamping=0, physicsClientId=client
        )
        inside = self._mouth.inv() * connector.pose
        frame = inside.translation.tolist(), [0, 0, 0, 1], inside.rotation.as_quat().tolist()
        joint = p.createConstraint(
            link.body, link.link, insert, -1, p.JOINT_PRISMATIC, [1, 0, 0], [0, 0, 0], *frame, client
        )
        p.changeConstraint(joint, maxForce=values.joint_force, physicsClientId=client)
        return int(insert), int(joint)

    @staticmethod
    def _push(link: BodyLink, at: object, force: FloatArray) -> None:
        p.applyExternalForce(link.body, link.link, force.tolist(), at, p.WORLD_FRAME, physicsClientId=link.client)


@numba.njit(cache=True)
def _float(state: FloatArray, home: FloatArray, springs: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Force (3,) N and torque (3,) N m, in the world, that bring a body of that `state` (13,) back to `home` (4, 4).

    `springs` (4,): stiffness (N/m), damping (N s/m), torsion (N m/rad) and its damping (N m s/rad).
    """
    x, y, z, w = state[3:7]
    turn = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
    error = np.zeros(3)  # rotation vector, small
    for k in range(3):
        error += 0.5 * np.cross(turn[:, k], home[:3, k])
    force = springs[0] * (home[:3, 3] - state[:3]) - springs[1] * state[7:10]
    return force, springs[2] * error - springs[3] * state[10:13]
