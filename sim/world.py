"""The simulated world of one run: the engine, the scene, the devices, the task's objects and the faults, put together.

Time passes only in `advance`. Every physics step has the same order, which `regrasp.sim.objects` tells. Cameras expose
and finger encoders sample at fixed steps, so nothing depends on who reads them and how often.
"""

from dataclasses import dataclass, field
from typing import Generic

import numpy as np
from scipy.spatial.transform import RigidTransform

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cell import Cell
from regrasp.interfaces.fault import Fault
from regrasp.interfaces.scene import Gravity, SceneSetup
from regrasp.interfaces.wall_time import counts_as
from regrasp.sim.contacts import BodyOrLink, ContactWatch
from regrasp.sim.devices import DeviceParameters, Devices
from regrasp.sim.engine import Engine
from regrasp.sim.faults.effects import FaultParameters, effect_of
from regrasp.sim.faults.faults import ScheduledFault, TriggerState
from regrasp.sim.objects import ObjectsT
from regrasp.sim.render.renderer import LightState, RendererName
from regrasp.sim.scene import Scene


@dataclass(frozen=True)
class WorldParameters:
    """Tuning values of a world and its parts. A task's objects have their own, and what describes a cell its file."""

    contact_interval: int = 4  # physics steps between checks of contacts and of the faults' triggers
    devices: DeviceParameters = field(default_factory=DeviceParameters)
    fault: FaultParameters = field(default_factory=FaultParameters)


NOTHING_ADDED = SceneSetup()


class World(Generic[ObjectsT]):
    """The world of one run: the cell, the task's `objects` in it, and what `setup` adds.

    All errors and noise are drawn from `seed`; equal arguments give equal bits. The `objects` belong to this world
    alone. `arms` and `cameras` go by the cell's names, `fixed_bodies` are PyBullet's ids by name (`sim.scene.Scene`).
    """

    def __init__(
        self,
        cell: Cell,
        gravity: Gravity,
        seed: int,
        objects: ObjectsT,
        setup: SceneSetup = NOTHING_ADDED,
        renderer: RendererName = "software",
        gui: bool = False,
        parameters: WorldParameters = WorldParameters(),
    ) -> None:
        self.cell, self.gravity, self.objects, self._parameters = cell, gravity, objects, parameters
        self._engine = Engine(cell.hidden, gravity, gui)
        self.client, self.step_seconds = self._engine.client, self._engine.step_seconds
        self._scene = Scene(self._engine, cell.known, objects, setup)
        self.fixed_bodies = self._scene.fixed_bodies
        self._devices = Devices(self._engine, cell, seed, parameters.devices)
        self.arms, self.cameras = self._devices.arms, self._devices.cameras
        objects.build_moving(self._engine, self.arms)
        self._stand_arms_on_floor()
        objects.lay_out(self._engine, self.fixed_bodies)
        named = (self._scene.forbidden, objects.forbidden())
        forbidden: dict[BodyOrLink, str] = {body: name for names in named for body, name in names.items()}
        self._contacts = ContactWatch(self.client, self.arms, forbidden, objects.grips())
        self.contact_peaks = self._contacts.peaks
        self._devices.add_cameras(renderer)
        self.visuals, self.renderer = self._devices.visuals, self._devices.renderer
        self.faults = self._schedule(setup.faults, seed)
        self._triggers = TriggerState()
        self._engine.restart_clock()
        self._devices.restart_clocks()
        self._watch_faults()
        self._devices.expose()

    def now(self) -> float:
        """Seconds since the run began."""
        return self._engine.now()

    @counts_as("step loop")
    def advance(self, seconds: float) -> None:
        """Run the physics for so long, rounded to whole steps."""
        for _ in range(round(seconds / self.step_seconds)):
            self._step()
        self._engine.count_wall_time()

    def note_entered(self, node: str) -> None:
        """Note that the node with this tree path was entered now, for faults that wait for it."""
        self._triggers.nodes.setdefault(node, self.now())

    def take_forces(self, arm: str) -> tuple[float, float]:
        """See `ContactWatch.take_recent`; for the record."""
        return self._contacts.take_recent(arm)

    def place_obstacle(self, name: str, center: FloatArray) -> None:
        """Move an obstacle that has no stand: the centre of its box to `center` (3,) m."""
        self._scene.place_obstacle(name, center)

    def place_prop(self, number: int, pose: RigidTransform | None) -> None:
        """Put prop `number` at `pose`, world_from_prop, or with None out of sight."""
        self._scene.place_prop(number, pose)

    @property
    def light(self) -> LightState:
        """The present light."""
        return self._devices.light

    def set_light(self, light: LightState) -> None:
        """Change the light for all later exposures."""
        self._devices.set_light(light)

    def close(self) -> None:
        """Close the renderer and disconnect the client."""
        self.renderer.close()
        self._engine.close()

    def _step(self) -> None:
        self._devices.step()
        now = self._engine.now()
        for fault in self.faults:
            fault.step(now)
        self.objects.before_step()
        self._engine.step()
        self.objects.after_step()
        if self._engine.steps % self._parameters.contact_interval == 0:
            self._contacts.look()
            self._watch_faults()
        self._devices.expose()

    def _watch_faults(self) -> None:
        now = self._triggers.now = self._engine.now()
        if any(fault.waiting for fault in self.faults):
            self.objects.update_triggers(now, self._triggers)
        for fault in self.faults:
            fault.watch(self._triggers)

    def _stand_arms_on_floor(self) -> None:
        """Switch off collisions of the arms' bases with the floor, on which they stand."""
        if "floor" in self.fixed_bodies:
            for arm in self.arms.values():
                self._engine.let_pass(arm.body, -1, self.fixed_bodies["floor"])

    def _schedule(self, faults: tuple[Fault, ...], seed: int) -> list[ScheduledFault]:
        """The faults with their effects; each draws from a generator of its own."""
        rngs = [np.random.default_rng(s) for s in np.random.SeedSequence([seed, 2]).spawn(len(faults))]
        of_task, parameters = self.objects.effects(), self._parameters.fault
        return [
            ScheduledFault(fault, effect_of(fault, self, rng, of_task, parameters))
            for fault, rng in zip(faults, rngs, strict=True)
        ]
