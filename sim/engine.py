"""The engine of a world: a PyBullet client with the physics settings of a cell, and the clock of a run."""

import time
import weakref

import pybullet as p

from regrasp.interfaces.hidden_world import HiddenWorld
from regrasp.interfaces.scene import EARTH_GRAVITY, Gravity
from regrasp.interfaces.wall_time import move_time


class Engine:
    """An empty PyBullet client with the cell's step and solver, and the clock of a run."""

    def __init__(self, hidden: HiddenWorld, gravity: Gravity, gui: bool = False) -> None:
        self.gravity = gravity
        self.client: int = p.connect(p.GUI if gui else p.DIRECT)
        self._disconnect = weakref.finalize(self, p.disconnect, self.client)  # also if nobody closes the engine
        self.step_rate = hidden.step_rate  # physics steps a second
        self.step_seconds = 1.0 / self.step_rate
        self.steps = 0  # since the clock began
        self._simulating = 0.0  # s of wall time in PyBullet's steps that are not counted yet
        self._configure(hidden)

    def now(self) -> float:
        """Simulated seconds since the clock began."""
        return self.steps * self.step_seconds

    def restart_clock(self) -> None:
        """Set the clock to zero: what was simulated before belongs to no run."""
        self.steps = 0

    def step(self) -> None:
        """Simulate one physics step."""
        began = time.perf_counter()
        p.stepSimulation(physicsClientId=self.client)
        self._simulating += time.perf_counter() - began
        self.steps += 1

    def count_wall_time(self) -> None:
        """Count the wall time of the steps since the last call as that of the physics; one by one it would cost."""
        move_time("physics", self._simulating)
        self._simulating = 0.0

    def let_pass(self, body: int, link: int, other: int) -> None:
        """Switch off collisions of a link (-1: the base) with the base of another body."""
        p.setCollisionFilterPair(body, other, link, -1, 0, physicsClientId=self.client)

    def let_meet(self, body: int, link: int, other: int) -> None:
        """Undo `let_pass`."""
        p.setCollisionFilterPair(body, other, link, -1, 1, physicsClientId=self.client)

    def close(self) -> None:
        """Disconnect the client."""
        self._disconnect()

    def _configure(self, hidden: HiddenWorld) -> None:
        p.resetSimulation(physicsClientId=self.client)
        p.setGravity(0, 0, -EARTH_GRAVITY if self.gravity == "earth" else 0.0, physicsClientId=self.client)
        p.setTimeStep(self.step_seconds, physicsClientId=self.client)
        p.setPhysicsEngineParameter(
            numSolverIterations=hidden.solver_iterations, deterministicOverlappingPairs=1, physicsClientId=self.client
        )
