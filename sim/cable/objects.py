"""The cable in the world: sockets, bracket and tags, the cable itself, the socket and the clip that hold its end."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product

import numpy as np
import pybullet as p
from scipy.spatial.transform import RigidTransform

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cable.cell import PLUGGED_INTO, CableCell
from regrasp.interfaces.scene import Gravity, SceneSetup
from regrasp.sim.bodies import BodyLink
from regrasp.sim.cable.cable import BodyState, CableBody, CableParameters, build_cable
from regrasp.sim.cable.effects import effects_on
from regrasp.sim.cable.fixtures import ClipHold, ClipParameters, build_fixtures
from regrasp.sim.cable.laying import LayingParameters, lay_cable
from regrasp.sim.cable.mouth import MouthParameters, SocketMouth
from regrasp.sim.cable.phase import PhaseParameters, PhaseWatch
from regrasp.sim.engine import Engine
from regrasp.sim.faults.effects import TaskEffects
from regrasp.sim.faults.faults import TriggerState
from regrasp.sim.hold import Catch
from regrasp.sim.objects import TaskObjects
from regrasp.sim.render.renderer import RendererName
from regrasp.sim.robot.arm import SimArm
from regrasp.sim.world import NOTHING_ADDED, World


@dataclass(frozen=True)
class CableObjectsParameters:
    """Tuning values of the cable and what holds it. What describes a certain cell is in its file."""

    clamped_links: int = 4  # at the fixed end, which run through the last socket ...
    clamping_panel: str = "right_panel"  # ... and through this box, if the cell has it
    stand_force: float = 3.0  # N that a stand's spring clip holds; choice: a light pull, twice a slack cable's force
    spinning_friction: float = 0.005  # of the connector, against rotation about a contact's normal (PyBullet's unit)
    knock_seconds: float = 0.02  # s over which a knock's impulse is spread
    cable: CableParameters = field(default_factory=CableParameters)
    laying: LayingParameters = field(default_factory=LayingParameters)
    clip: ClipParameters = field(default_factory=ClipParameters)
    mouth: MouthParameters = field(default_factory=MouthParameters)
    phase: PhaseParameters = field(default_factory=PhaseParameters)


class CableObjects(TaskObjects):
    """The cable task's objects in one world.

    `connector_at` is the pose world_from_connector at the start, on a stand; None for the connector in its socket.
    `cable`, `socket` (or the stand), `clip` and the `mouths` of the sockets by name are there once the world is built;
    the last socket, which holds the cable's other end, has none.
    """

    cable: CableBody
    socket: Catch
    clip: ClipHold
    mouths: dict[str, SocketMouth]

    def __init__(
        self,
        cell: CableCell,
        connector_at: RigidTransform | None = None,
        parameters: CableObjectsParameters = CableObjectsParameters(),
    ) -> None:
        self.cell, self._stand, self._parameters = cell, connector_at, parameters
        known = cell.known.cable
        self._start = known.socket(PLUGGED_INTO).world_from_plug(known.connector.length).translation
        self._way = known.clip.world_from_seat.translation - self._start
        self._way_sq = float(self._way @ self._way)
        self._phase = PhaseWatch(self._start, parameters.phase)

    def build_fixed(self, engine: Engine) -> Mapping[str, int]:
        """See `TaskObjects`: the clip's bracket and the sockets."""
        return build_fixtures(engine.client, self.cell.known.cable)

    def build_moving(self, engine: Engine, arms: Mapping[str, SimArm]) -> None:
        """See `TaskObjects`: the cable."""
        self._client, self._arms = engine.client, arms
        self.cable = self._build_cable(engine)

    def lay_out(self, engine: Engine, fixed: Mapping[str, int]) -> None:
        """See `TaskObjects`: the cable comes to rest in its socket or on its stand."""
        self._filter_collisions(engine, fixed)
        obstacles = [body for name, body in fixed.items() if name.startswith("obstacle ")]
        meetings = list(product(range(self.cable.connector_link + 1), obstacles))
        for link, body in meetings:  # the way to where it begins is not the run's
            engine.let_pass(self.cable.body, link, body)
        self.socket = self._plug(engine)
        for link, body in meetings:
            engine.let_meet(self.cable.body, link, body)
        self.clip = self._build_clip(engine)
        self.mouths = self._open_mouths()
        self._connector: BodyState = self.cable.connector_state()

    def effects(self) -> TaskEffects:
        """See `TaskObjects`."""
        return effects_on(self.cable, self._parameters.knock_seconds)

    def before_step(self) -> None:
        """See `TaskObjects`: the cable's springs, the clip and the sockets' mouths act."""
        self.cable.apply_springs()
        self.clip.step(self._connector)
        for mouth in self.mouths.values():
            mouth.step(self._connector)

    def after_step(self) -> None:
        """See `TaskObjects`: the socket may let go."""
        self._connector = self.cable.connector_state()
        self.socket.step()

    def update_triggers(self, now: float, triggers: TriggerState) -> None:
        """See `TaskObjects`: the share of the way that the held connector has been carried, and the phases."""
        position, plugged = np.array(self._connector.position), self.plugged()
        pads = (False, False) if plugged else self.touching()[1]
        speed = math.hypot(*self._connector.velocity)
        self._phase.step(now, position, speed, pads, plugged, self.clip.holds)
        held = all(pads) and not plugged
        triggers.shares["carried"] = float((position - self._start) @ self._way) / self._way_sq if held else None
        triggers.phases = self._phase.began

    def plugged(self) -> bool:
        """Whether a socket, or the stand, holds the connector."""
        return self.socket.holds or self.plugged_into() is not None

    def plugged_into(self) -> str | None:
        """Name of the socket that holds the connector; None if none does."""
        if self.socket.holds and self._stand is None:
            return self.cell.known.cable.plugged_into
        return next((name for name, mouth in self.mouths.items() if mouth.holds), None)

    def touching(self) -> tuple[str, tuple[bool, bool]]:
        """The arm that holds the connector, and whether its left and right pad touch it.

        Where none holds it, an arm that touches it, else the cell's hand.
        """
        hand = self.cell.known.cable.hand
        touching = {hand: self.pads_touching(hand)}
        if not all(touching[hand]):
            touching |= {arm: self.pads_touching(arm) for arm in self._arms if arm != hand}
        return max(touching.items(), key=lambda item: sum(item[1]))

    def pads_touching(self, arm: str) -> tuple[bool, bool]:
        """Whether the left and the right pad of that arm touch the connector now."""
        body, link, client = self.cable.body, self.cable.connector_link, self._client
        hand = self._arms[arm]
        left, right = (
            bool(p.getContactPoints(hand.body, body, pad, link, physicsClientId=client)) for pad in hand.gripper.pads
        )
        return left, right

    def connector_pose(self) -> RigidTransform:
        """True world_from_connector after the last step."""
        return self._connector.pose

    def connector_position(self) -> Sequence[float]:
        """True position (3,) m of the connector's centre."""
        return self._connector.position

    def connector_velocity(self) -> FloatArray:
        """True velocity (3,) m/s of the connector's centre."""
        return np.array(self._connector.velocity)

    def _build_cable(self, engine: Engine) -> CableBody:
        hidden, connector = self.cell.hidden.cable, self.cell.known.cable.connector
        stiffness = hidden.stiffness.zero if engine.gravity == "zero" else hidden.stiffness.earth
        mass, step = hidden.connector_mass, engine.step_seconds
        cable = build_cable(engine.client, hidden, connector, mass, stiffness, step, self._parameters.cable)
        p.changeDynamics(
            cable.body,
            cable.connector_link,
            lateralFriction=hidden.connector_friction,
            spinningFriction=self._parameters.spinning_friction,
            physicsClientId=engine.client,
        )
        return cable

    def _filter_collisions(self, engine: Engine, fixed: Mapping[str, int]) -> None:
        """Let pass what touches by design.

        These are the connector in sockets and clip, and the first links at the cable's fixed end in the socket and the
        panel through which they run.
        """
        known, cable, parameters = self.cell.known.cable, self.cable, self._parameters
        for name in [*(socket.name for socket in known.sockets), *(box.name for box in known.clip.bracket)]:
            engine.let_pass(cable.body, cable.connector_link, fixed[name])
        clamp = [fixed[name] for name in (known.sockets[-1].name, parameters.clamping_panel) if name in fixed]
        for link in range(parameters.clamped_links):
            for body in clamp:
                engine.let_pass(cable.body, link, body)

    def _plug(self, engine: Engine) -> Catch:
        """Lay the straight cable into its socket or on its stand, before the run's time begins."""
        known = self.cell.known.cable
        socket, stand = known.socket(PLUGGED_INTO), self._stand
        goal = socket.world_from_plug(known.connector.length) if stand is None else stand
        hold = lay_cable(engine, self.cable, goal, self._parameters.laying)
        if stand is None:
            return Catch(hold, np.asarray(socket.axis), socket.pull_out_force)
        return Catch(hold, None, self._parameters.stand_force)

    def _open_mouths(self) -> dict[str, SocketMouth]:
        known, link = self.cell.known.cable, BodyLink(self._client, self.cable.body, self.cable.connector_link)
        parameters = self._parameters.mouth
        return {socket.name: SocketMouth(link, socket, known.connector, parameters) for socket in known.sockets[:-1]}

    def _build_clip(self, engine: Engine) -> ClipHold:
        return ClipHold(
            BodyLink(engine.client, self.cable.body, self.cable.connector_link),
            self.cell.known.cable.clip,
            self.cell.hidden.cable.connector_mass,
            self.cable.connector_inertia,
            engine.step_seconds,
            self._parameters.clip,
        )


def cable_world(
    cell: CableCell,
    gravity: Gravity,
    seed: int,
    setup: SceneSetup = NOTHING_ADDED,
    *,
    connector_at: RigidTransform | None = None,
    renderer: RendererName = "software",
    gui: bool = False,
) -> World[CableObjects]:
    """The world of a cell with a cable: see `World` and `CableObjects`. The caller closes it."""
    return World(cell, gravity, seed, CableObjects(cell, connector_at), setup, renderer, gui)
