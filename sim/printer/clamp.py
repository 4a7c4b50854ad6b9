"""The clamp on the desk: two jaws that press on a plate between them."""

import pybullet as p

from regrasp.interfaces.cell import Box
from regrasp.interfaces.printer.cell import HiddenPrinter, KnownPrinter
from regrasp.sim.bodies import box_shapes


class SimClamp:
    """Two jaws on slides along y, which a gear lets go in by the same way (a self-centring vise); they begin open.

    Nothing but the jaws' force and friction holds the plate. `jaws` are their links. Once closed, they and the `plate`,
    a body, sleep while they rest: the engine does not simulate them until another body touches one.
    """

    jaws = (0, 1)  # the first closes towards +y, the second towards -y

    def __init__(
        self,
        client: int,
        known: KnownPrinter,
        hidden: HiddenPrinter,
        plate: int,
        gear_force: float = 2000.0,
        jaw_mass: float = 1.0,
        rest: float = 1e-4,
    ) -> None:
        """The gear bears `gear_force` N: choice, far more than the jaws press with.

        Each jaw weighs `jaw_mass` kg, with the inertia of its screw. Choice: an iteration of PyBullet's solver gives a
        jaw the momentum of its speed at most. Jaws of 0.2 kg need 70 iterations until they press with their force.
        What moves by less than `rest` m/s and rad/s for 2 s falls asleep; choice: what is clamped, and nothing faster.
        """
        self._client, self._hidden, self._plate, self._rest = client, hidden, plate, rest
        clamp, width, height = known.clamp, known.plate.size[1], known.plate.size[2]
        size = clamp.jaw_size
        out = 0.5 * (width + size[1]) + clamp.stroke
        up = 0.5 * (height - size[2]) + clamp.above
        jaw = Box(name="jaw", center=(0.0, 0.0, 0.0), size=size, color=clamp.color)
        shapes = [box_shapes(client, jaw) for _ in self.jaws]
        level = [0.0, 0.0, 0.0, 1.0]
        self.body = int(
            p.createMultiBody(
                baseMass=0,
                basePosition=list(clamp.center),
                linkMasses=[jaw_mass, jaw_mass],
                linkCollisionShapeIndices=[shape[0] for shape in shapes],
                linkVisualShapeIndices=[shape[1] for shape in shapes],
                linkPositions=[[0.0, -out, up], [0.0, out, up]],
                linkOrientations=[level, level],
                linkInertialFramePositions=[[0.0, 0.0, 0.0]] * 2,
                linkInertialFrameOrientations=[level, level],
                linkParentIndices=[0, 0],
                linkJointTypes=[p.JOINT_PRISMATIC] * 2,
                linkJointAxis=[[0, 1, 0], [0, -1, 0]],
                physicsClientId=client,
            )
        )
        most = clamp.stroke + 0.25 * width  # where nothing lies between them
        for link in self.jaws:
            p.changeDynamics(
                self.body,
                link,
                lateralFriction=1.0,  # PyBullet multiplies it with the plate's
                frictionAnchor=1,  # without it the plate creeps by half a millimetre a second
                jointLowerLimit=0.0,
                jointUpperLimit=most,
                physicsClientId=client,
            )
        gear = p.createConstraint(
            self.body,
            self.jaws[0],
            self.body,
            self.jaws[1],
            p.JOINT_GEAR,
            [0, 1, 0],
            [0, 0, 0],
            [0, 0, 0],
            physicsClientId=client,
        )
        p.changeConstraint(gear, gearRatio=-1.0, maxForce=gear_force, erp=0.8, physicsClientId=client)
        self.open()

    def close(self) -> None:
        """Close the jaws, and press with their force from now on."""
        self._drive(0.02, self._hidden.clamp_force)
        self._may_sleep(True)

    def open(self) -> None:
        """Open the jaws."""
        self._drive(-0.02, self._hidden.clamp_force)
        self._may_sleep(False)

    def travel(self) -> tuple[float, float]:
        """How far, m, each jaw has gone in from where it is open."""
        first, second = p.getJointStates(self.body, self.jaws, physicsClientId=self._client)
        return float(first[0]), float(second[0])

    def presses(self, body: int) -> bool:
        """Whether both jaws touch a body."""
        return all(p.getContactPoints(self.body, body, jaw, -1, physicsClientId=self._client) for jaw in self.jaws)

    def _drive(self, speed: float, force: float) -> None:
        """Let each jaw go in with a speed (m/s) and at most a force (N)."""
        for link in self.jaws:
            p.setJointMotorControl2(
                self.body, link, p.VELOCITY_CONTROL, targetVelocity=speed, force=force, physicsClientId=self._client
            )

    def _may_sleep(self, may: bool) -> None:
        """Let jaws and plate sleep while they rest, or keep them awake, which wakes them (a motor's speed does not)."""
        state = p.ACTIVATION_STATE_ENABLE_SLEEPING if may else p.ACTIVATION_STATE_DISABLE_SLEEPING
        for body, link in ((self._plate, -1), *((self.body, link) for link in (-1, *self.jaws))):
            p.changeDynamics(
                body,
                link,
                activationState=state,
                sleepThreshold=self._rest**2,
                physicsClientId=self._client,
            )
