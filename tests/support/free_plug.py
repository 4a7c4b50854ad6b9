"""A connector alone in a world, without a cable."""

from collections.abc import Callable
from dataclasses import dataclass

import pybullet as p
from scipy.spatial.transform import RigidTransform

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cable.cell import CableCell
from regrasp.sim.bodies import BodyLink
from regrasp.sim.cable.cable import BodyState
from regrasp.sim.cable.fixtures import ClipHold
from regrasp.sim.cable.mouth import SocketMouth


@dataclass
class FreePlug:
    """The connector and the step of its world."""

    client: int
    body: int
    step: float

    @property
    def link(self) -> BodyLink:
        """As the holders want it."""
        return BodyLink(self.client, self.body, -1)

    def state(self) -> BodyState:
        """Where it is and how it moves."""
        place = p.getBasePositionAndOrientation(self.body, physicsClientId=self.client)
        return BodyState(*place, *p.getBaseVelocity(self.body, physicsClientId=self.client))

    def put(self, pose: RigidTransform, velocity: FloatArray | None = None) -> None:
        """Put it somewhere, with a velocity in m/s."""
        p.resetBasePositionAndOrientation(
            self.body, pose.translation.tolist(), pose.rotation.as_quat().tolist(), physicsClientId=self.client
        )
        p.resetBaseVelocity(
            self.body, [0, 0, 0] if velocity is None else velocity.tolist(), [0, 0, 0], physicsClientId=self.client
        )

    def advance(
        self,
        seconds: float,
        holder: ClipHold | SocketMouth | None = None,
        force: FloatArray | Callable[[BodyState], FloatArray] | None = None,
    ) -> None:
        """Simulate so long, with what may hold it and a force (3,) N on its centre."""
        for _ in range(round(seconds / self.step)):
            state = self.state()
            if holder is not None:
                holder.step(state)
            if force is not None:
                pushed = (force(state) if callable(force) else force).tolist()
                at = state.position
                p.applyExternalForce(self.body, -1, pushed, at, p.WORLD_FRAME, physicsClientId=self.client)
            p.stepSimulation(physicsClientId=self.client)


def free_plug(cell: CableCell, client: int) -> FreePlug:
    """The cell's connector in that world."""
    connector, mass = cell.known.cable.connector, cell.hidden.cable.connector_mass
    radius, length = connector.radius, connector.length
    body = p.createMultiBody(mass, -1, -1, physicsClientId=client)
    inertia = [mass * radius**2 / 2] + [mass * (3 * radius**2 + length**2) / 12] * 2
    p.changeDynamics(body, -1, localInertiaDiagonal=inertia, linearDamping=0, angularDamping=0, physicsClientId=client)
    return FreePlug(client, body, 1.0 / cell.hidden.step_rate)
