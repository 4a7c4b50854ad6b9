r"""The cable: a chain of capsules with spherical joints, each with an explicit spring-damper.

The chain is a discretised elastic rod. A joint between links of length l has the bending stiffness

.. math:: k = EI / l,

and the clamp at the fixed end 2 k. Integrated explicitly with the step :math:`\Delta t`, a joint is stable only while
:math:`4 k \Delta t^2 / I` is below a limit. Therefore the links' inertia I is at least

.. math:: I_{min} = 4 k \Delta t^2 / s^2

with s the stability factor of `CableParameters`. The joint damping :math:`d = c I / (4 \Delta t)`, a share c of what an
explicit step can bear, is needed too: without it the springs gain energy (measured). The material's damping is
Rayleigh's mass-proportional term.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import chain
from typing import NamedTuple

import numba
import numpy as np
import pybullet as p
from scipy.spatial.transform import RigidTransform, Rotation

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cable.cell import Connector, HiddenCable
from regrasp.interfaces.cell import pose_along
from regrasp.interfaces.fields import Color
from regrasp.sim.render.fiducials import compound_visual, tag_boxes

_IDENTITY = [0.0, 0.0, 0.0, 1.0]


@dataclass(frozen=True)
class CableParameters:
    """Numerical stability of the chain."""

    stability: float = 0.7  # rad, phase of a joint's fastest mode in a step; an explicit step diverges at 2
    joint_damping: float = 0.6  # share of the damping at which an explicit step overshoots


class BodyState(NamedTuple):
    """Where a body's frame is in the world and how it moves, as PyBullet gives it."""

    position: Sequence[float]  # m
    quaternion: Sequence[float]  # x, y, z, w
    velocity: Sequence[float]  # m/s
    rate: Sequence[float]  # rad/s

    @property
    def pose(self) -> RigidTransform:
        """world_from_body."""
        return RigidTransform.from_components(self.position, Rotation.from_quat(self.quaternion))


@numba.njit(cache=True)
def spring_torques(states: FloatArray, stiffness: FloatArray, damping: FloatArray) -> FloatArray:
    r"""Joint torques (n, 3) N m of linear spring-dampers on the joints' rotation vectors :math:`\theta`.

    .. math:: \tau = -k \theta - d \omega

    `states` (n, 7) are the joints' quaternions x, y, z, w and their rates in rad/s. Rates and torques are in the child
    links' frames. `stiffness` (n,) is in N m/rad, `damping` (n,) in N m s/rad.
    """
    torques = np.empty((states.shape[0], 3))
    for i in range(states.shape[0]):
        x, y, z, w = states[i, :4]
        rates = states[i, 4:]
        if w < 0.0:
            x, y, z, w = -x, -y, -z, -w
        sine = np.sqrt(x * x + y * y + z * z)
        factor = 2.0 if sine < 1e-9 else 2.0 * np.arctan2(sine, w) / sine
        torques[i, 0] = -stiffness[i] * factor * x - damping[i] * rates[0]
        torques[i, 1] = -stiffness[i] * factor * y - damping[i] * rates[1]
        torques[i, 2] = -stiffness[i] * factor * z - damping[i] * rates[2]
    return torques


def first_frequency(stiffness: float, length: float, mass_per_length: float, tip_mass: float) -> float:
    r"""First bending frequency, rad/s, of a cantilever with a tip mass, by Rayleigh's method.

    .. math:: \omega_1 = \sqrt{3 EI / ((m_{tip} + 0.243 \mu L) L^3)}

    `stiffness` EI is in N m2, `length` L in m, `mass_per_length` :math:`\mu` in kg/m, `tip_mass` in kg.
    """
    return float(np.sqrt(3 * stiffness / ((tip_mass + 0.243 * mass_per_length * length) * length**3)))


@dataclass(frozen=True)
class CableBody:
    """The chain in a PyBullet client. Links 0 to n - 1 are cable; link n is the connector (frame at its centre)."""

    client: int
    body: int
    links: int
    link_length: float  # m
    stiffness: FloatArray  # (n,) N m/rad
    damping: FloatArray  # (n,) N m s/rad
    connector_inertia: float  # kg m2, about an axis across the connector

    @property
    def connector_link(self) -> int:
        """Index of the connector's link."""
        return self.links

    def apply_springs(self) -> None:
        """Set the joint torques for the next step from the present joint rotations and rates."""
        joints, no_turns = self._joints
        states = p.getJointStatesMultiDof(self.body, joints, physicsClientId=self.client)
        flat = chain.from_iterable([s[0] + s[1] for s in states])
        values = np.fromiter(flat, float, 7 * self.links).reshape(-1, 7)
        torques = spring_torques(values, self.stiffness, self.damping)
        p.setJointMotorControlMultiDofArray(
            self.body,
            joints,
            p.TORQUE_CONTROL,
            targetPositions=no_turns,
            forces=torques.tolist(),
            physicsClientId=self.client,
        )

    def connector_state(self) -> BodyState:
        """The present state of the connector's frame; the velocity is that of its centre."""
        return BodyState(*p.getLinkState(self.body, self.connector_link, 1, 1, physicsClientId=self.client)[4:8])

    @cached_property
    def _joints(self) -> tuple[list[int], list[list[float]]]:
        """The spherical joints, and a target rotation for each, which PyBullet wants but torque control ignores."""
        return list(range(self.links)), [_IDENTITY] * self.links


def build_cable(
    client: int,
    cable: HiddenCable,
    connector: Connector,
    connector_mass: float,
    stiffness: float,
    step: float,
    parameters: CableParameters = CableParameters(),
) -> CableBody:
    """Create the chain, straight and at rest. `stiffness` is EI in N m2, `step` the physics step in s."""
    n, length = cable.links, cable.length / cable.links
    bend = stiffness / length
    inertia = max(4 * bend * step**2 / parameters.stability**2, cable.mass_per_length * length**3 / 12)
    body = _create_chain(client, cable, connector, connector_mass)
    across = _set_inertias(client, body, n, inertia, connector, connector_mass)
    first = first_frequency(stiffness, cable.length, cable.mass_per_length, connector_mass)
    for link in range(-1, n + 1):
        p.changeDynamics(
            body,
            link,
            linearDamping=2 * cable.damping_ratio * first,
            angularDamping=0,
            jointDamping=0,
            physicsClientId=client,
        )
    _switch_motors_off(client, body, n)
    springs = np.full(n, bend)
    springs[0] *= 2
    damping_time = parameters.joint_damping / (step * 4 * bend / inertia)
    return CableBody(client, body, n, length, springs, springs * damping_time, across)


def _create_chain(client: int, cable: HiddenCable, connector: Connector, connector_mass: float) -> int:
    n, length = cable.links, cable.length / cable.links
    link = _shapes(client, p.GEOM_CAPSULE, cable.radius, length, length / 2, cable.color)
    end = _shapes(client, p.GEOM_CYLINDER, connector.radius, connector.length, 0.0, connector.color)
    if connector.tag is not None:
        body = (connector.radius, connector.length, connector.color)
        end = end[0], compound_visual(client, tag_boxes(connector.tag), connector.tag.body_from_tag, body)
    collisions, visuals = zip(*[link] * n, end, strict=True)
    origin = pose_along(cable.anchor, cable.anchor_axis)
    return int(
        p.createMultiBody(
            0,
            -1,
            -1,
            origin.translation.tolist(),
            origin.rotation.as_quat().tolist(),
            linkMasses=[cable.mass_per_length * length] * n + [connector_mass],
            linkCollisionShapeIndices=collisions,
            linkVisualShapeIndices=visuals,
            linkPositions=[[0, 0, 0]] + [[length, 0, 0]] * (n - 1) + [[length + connector.length / 2, 0, 0]],
            linkOrientations=[_IDENTITY] * (n + 1),
            linkInertialFramePositions=[[length / 2, 0, 0]] * n + [[0, 0, 0]],
            linkInertialFrameOrientations=[_IDENTITY] * (n + 1),
            linkParentIndices=list(range(n + 1)),
            linkJointTypes=[p.JOINT_SPHERICAL] * n + [p.JOINT_FIXED],
            linkJointAxis=[[0, 0, 1]] * (n + 1),
            physicsClientId=client,
        )
    )


def _shapes(client: int, kind: int, radius: float, length: float, offset: float, color: Color) -> tuple[int, int]:
    """Collision and visual shape of a capsule or cylinder along x, its centre `offset` m along x from its frame."""
    place, turn = [offset, 0, 0], p.getQuaternionFromEuler([0.0, np.pi / 2, 0.0])
    collision = p.createCollisionShape(
        kind,
        radius=radius,
        height=length,
        collisionFramePosition=place,
        collisionFrameOrientation=turn,
        physicsClientId=client,
    )
    visual = p.createVisualShape(
        kind,
        radius=radius,
        length=length,
        rgbaColor=[*color, 1],
        visualFramePosition=place,
        visualFrameOrientation=turn,
        physicsClientId=client,
    )
    return collision, visual


def _set_inertias(
    client: int, body: int, links: int, link_inertia: float, connector: Connector, connector_mass: float
) -> float:
    """Set the inertias in kg m2: every link's (isotropic) and the connector's. Returns the latter across its axis."""
    for link in range(links):
        p.changeDynamics(body, link, localInertiaDiagonal=[link_inertia] * 3, physicsClientId=client)
    r, h = connector.radius, connector.length
    across = connector_mass * (3 * r**2 + h**2) / 12
    diagonal = [connector_mass * r**2 / 2, across, across]
    p.changeDynamics(body, links, localInertiaDiagonal=diagonal, physicsClientId=client)
    return across


def _switch_motors_off(client: int, body: int, links: int) -> None:
    """Switch off PyBullet's default joint motors: they brake the joints and make a step 40 times slower."""
    p.setJointMotorControlMultiDofArray(
        body,
        range(links),
        p.POSITION_CONTROL,
        targetPositions=[_IDENTITY] * links,
        targetVelocities=[[0, 0, 0]] * links,
        positionGains=[0] * links,
        velocityGains=[0] * links,
        forces=[[0, 0, 0]] * links,
        physicsClientId=client,
    )
