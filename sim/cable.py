"""The cable: one chain of capsules with spherical joints and an explicit spring-damper torque at every step.

Discretised rod: bending stiffness k = EI / l between links, 2 k at the clamp. An explicit spring is stable only while
k dt^2 / I is small, so each link's inertia has a floor, and its joint damping a cap, both from the step (measured: without
the joint damping the explicit spring gains energy). Material damping is Rayleigh's mass-proportional term.
"""

from dataclasses import dataclass

import numba
import numpy as np
import pybullet as p
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform, Rotation

from interfaces.cell import Cable, Connector, pose_along

FloatArray = NDArray[np.float64]

STABILITY = 0.7  # sf: the fastest joint mode turns by sf radians a step
JOINT_DAMPING = 0.6  # share of the critical step damping
_IDENTITY = [0.0, 0.0, 0.0, 1.0]


@numba.njit(cache=True)  # type: ignore[untyped-decorator]
def spring_torques(rotations: FloatArray, rates: FloatArray, stiffness: FloatArray, damping: FloatArray) -> FloatArray:
    """Joint torques (n, 3) N m of linear springs on the rotation vectors.

    `rotations` (n, 4) are the joints' quaternions x, y, z, w; `rates` (n, 3) rad/s and the result are in the child frames.
    """
    torques = np.empty_like(rates)
    for i in range(rotations.shape[0]):
        x, y, z, w = rotations[i]
        if w < 0.0:
            x, y, z, w = -x, -y, -z, -w
        sine = np.sqrt(x * x + y * y + z * z)
        factor = 2.0 if sine < 1e-9 else 2.0 * np.arctan2(sine, w) / sine
        torques[i, 0] = -stiffness[i] * factor * x - damping[i] * rates[i, 0]
        torques[i, 1] = -stiffness[i] * factor * y - damping[i] * rates[i, 1]
        torques[i, 2] = -stiffness[i] * factor * z - damping[i] * rates[i, 2]
    return torques


def first_frequency(stiffness: float, length: float, mass_per_length: float, tip_mass: float) -> float:
    """First bending frequency in rad/s of a cantilever with a tip mass (Rayleigh: 0.243 of the beam's mass at the tip)."""
    return float(np.sqrt(3 * stiffness / ((tip_mass + 0.243 * mass_per_length * length) * length**3)))


@dataclass(frozen=True)
class CableBody:
    """The chain in a PyBullet client. Links 0..n-1 are cable, link n is the connector (its frame at the centre)."""

    client: int
    body: int
    links: int
    link_length: float
    stiffness: FloatArray  # (n,) N m/rad
    damping: FloatArray  # (n,) N m s/rad
    connector_inertia: float  # kg m2, across the connector's axis

    @property
    def connector_link(self) -> int:
        """Index of the connector's link."""
        return self.links

    def apply_springs(self) -> None:
        """Set the joint torques for the next step from the present bend."""
        states = p.getJointStatesMultiDof(self.body, range(self.links), physicsClientId=self.client)
        rotations = np.array([s[0] for s in states])
        rates = np.array([s[1] for s in states])
        torques = spring_torques(rotations, rates, self.stiffness, self.damping)
        p.setJointMotorControlMultiDofArray(
            self.body,
            range(self.links),
            p.TORQUE_CONTROL,
            targetPositions=[_IDENTITY] * self.links,
            forces=torques.tolist(),
            physicsClientId=self.client,
        )

    def connector_state(self) -> tuple[RigidTransform, FloatArray, FloatArray]:
        """world_from_connector, its centre's velocity (3,) m/s and its rate of turn (3,) rad/s, in the world."""
        s = p.getLinkState(self.body, self.connector_link, 1, 1, physicsClientId=self.client)
        return RigidTransform.from_components(s[4], Rotation.from_quat(s[5])), np.array(s[6]), np.array(s[7])

    def energy(self) -> float:
        """Kinetic plus bending energy in J (without gravity); the links' inertia floor counts, as it does in the motion."""
        links = range(self.links + 1)
        states = p.getLinkStates(self.body, links, 1, 1, physicsClientId=self.client)
        kinetic = 0.0
        for link, s in zip(links, states, strict=True):
            info = p.getDynamicsInfo(self.body, link, physicsClientId=self.client)
            turn = np.array(p.getMatrixFromQuaternion(s[1])).reshape(3, 3)
            rate = turn.T @ np.array(s[7])
            kinetic += 0.5 * info[0] * float(np.dot(s[6], s[6])) + 0.5 * float(np.dot(info[2], rate**2))
        joints = p.getJointStatesMultiDof(self.body, range(self.links), physicsClientId=self.client)
        vectors = spring_torques(
            np.array([j[0] for j in joints]), np.zeros((self.links, 3)), np.ones(self.links), np.zeros(self.links)
        )
        return kinetic + 0.5 * float(np.sum(self.stiffness * np.sum(vectors**2, axis=1)))


def build_cable(
    client: int, cable: Cable, connector: Connector, connector_mass: float, stiffness: float, step: float
) -> CableBody:
    """Create the chain, straight and at rest. `stiffness` is EI in N m2, `step` the physics step in s."""
    n, length = cable.links, cable.length / cable.links
    mass = cable.mass_per_length * length
    bend = stiffness / length
    inertia_floor = max(4 * bend * step**2 / STABILITY**2, mass * length**2 / 12)
    along_x = p.getQuaternionFromEuler([0.0, np.pi / 2, 0.0])

    def shapes(
        radius: float, size: float, offset: float, color: tuple[float, float, float], round_ends: bool
    ) -> tuple[int, int]:
        kind = p.GEOM_CAPSULE if round_ends else p.GEOM_CYLINDER
        frame = {"FramePosition": [offset, 0, 0], "FrameOrientation": along_x}
        c = p.createCollisionShape(
            kind, radius=radius, height=size, physicsClientId=client, **{f"collision{k}": v for k, v in frame.items()}
        )
        v = p.createVisualShape(
            kind,
            radius=radius,
            length=size,
            rgbaColor=[*color, 1],
            physicsClientId=client,
            **{f"visual{k}": v for k, v in frame.items()},
        )
        return c, v

    link_shape = shapes(cable.radius, length, length / 2, cable.color, True)
    end_shape = shapes(connector.radius, connector.length, 0.0, connector.color, False)
    origin = pose_along(cable.anchor, cable.anchor_axis)
    body = p.createMultiBody(
        0,
        -1,
        -1,
        origin.translation.tolist(),
        origin.rotation.as_quat().tolist(),
        linkMasses=[mass] * n + [connector_mass],
        linkCollisionShapeIndices=[link_shape[0]] * n + [end_shape[0]],
        linkVisualShapeIndices=[link_shape[1]] * n + [end_shape[1]],
        linkPositions=[[0, 0, 0]] + [[length, 0, 0]] * (n - 1) + [[length + connector.length / 2, 0, 0]],
        linkOrientations=[_IDENTITY] * (n + 1),
        linkInertialFramePositions=[[length / 2, 0, 0]] * n + [[0, 0, 0]],
        linkInertialFrameOrientations=[_IDENTITY] * (n + 1),
        linkParentIndices=list(range(n + 1)),
        linkJointTypes=[p.JOINT_SPHERICAL] * n + [p.JOINT_FIXED],
        linkJointAxis=[[0, 0, 1]] * (n + 1),
        physicsClientId=client,
    )
    rayleigh = 2 * cable.damping_ratio * first_frequency(stiffness, cable.length, cable.mass_per_length, connector_mass)
    for link in range(-1, n + 1):
        p.changeDynamics(body, link, linearDamping=rayleigh, angularDamping=0, jointDamping=0, physicsClientId=client)
    for link in range(n):
        p.changeDynamics(body, link, localInertiaDiagonal=[inertia_floor] * 3, physicsClientId=client)
    r, h = connector.radius, connector.length
    across = connector_mass * (3 * r**2 + h**2) / 12
    p.changeDynamics(body, n, localInertiaDiagonal=[connector_mass * r**2 / 2, across, across], physicsClientId=client)
    # The default motors of spherical joints cost forty times a step and hold the joint: off.
    p.setJointMotorControlMultiDofArray(
        body,
        range(n),
        p.POSITION_CONTROL,
        targetPositions=[_IDENTITY] * n,
        targetVelocities=[[0, 0, 0]] * n,
        positionGains=[0] * n,
        velocityGains=[0] * n,
        forces=[[0, 0, 0]] * n,
        physicsClientId=client,
    )
    springs = np.full(n, bend)
    springs[0] *= 2
    damping_time = JOINT_DAMPING / (step * 4 * bend / inertia_floor)
    return CableBody(client, body, n, length, springs, springs * damping_time, across)
