"""Arms and grippers that do exactly what they are told, on a clock that is turned by hand."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from regrasp.interfaces.cable.cell import CableKnown
from regrasp.interfaces.devices import TICK as TICK
from regrasp.interfaces.devices import Guard
from regrasp.interfaces.reading import GripperReading, JointReading
from regrasp.interfaces.request import Request
from regrasp.interfaces.trajectory import Trajectory
from regrasp.motion.cable.service import CableMotion
from regrasp.motion.robots.contact_guard import ContactGuard, Touch


@dataclass
class Clock:
    t: float = 0.0

    def now(self) -> float:
        return self.t


@dataclass
class FakeArm:
    """`stuck` is the share of a trajectory after which the arm goes no further.

    Where it first meets the conditions `bumps` on its joints (6,), one after the other, it touches something and stops.
    """

    name: str
    clock: Clock
    at: NDArray[np.float64]
    stuck: float = 1.0
    followed: list[tuple[float, Trajectory]] = field(default_factory=list)
    stops: int = 0
    bumps: list[Callable[[NDArray[np.float64]], bool]] = field(default_factory=list)
    _guard: Guard | None = None
    _begun: float | None = None

    def reading(self) -> JointReading:
        if self._begun is not None and self.bumps and self.bumps[0](self._now()):
            self.bumps.pop(0)
            assert isinstance(self._guard, ContactGuard)
            self._guard.touch = Touch(self.clock.t, self._now(), self._rate(), np.full(6, 3.0))
            self.stop()
        return JointReading(self.clock.t, self._now(), self._rate(), np.zeros(6))

    def gravity(self) -> NDArray[np.float64]:
        return np.zeros(3)

    def follow(self, trajectory: Trajectory, guard: Guard | None = None) -> None:
        assert np.abs(trajectory.positions[0] - self._now()).max() < 1e-6, "a trajectory begins where the arm is"
        self.at = self._now()
        self.followed.append((self.clock.t, trajectory))
        self._begun, self._guard = self.clock.t, guard

    def stop(self) -> None:
        self.at, self._begun = self._now(), None
        self.stops += 1

    def is_moving(self) -> bool:
        return self._begun is not None and self.clock.t < self._begun + self.followed[-1][1].duration - 1e-9

    def _rate(self) -> NDArray[np.float64]:
        if self._begun is None or not self.is_moving() or self.clock.t - self._begun > self._stuck_at():
            return np.zeros(6)
        return self.followed[-1][1].sample(self.clock.t - self._begun)[1]

    def _stuck_at(self) -> float:
        return self.stuck * self.followed[-1][1].duration

    def _now(self) -> NDArray[np.float64]:
        if self._begun is None:
            return self.at
        trajectory = self.followed[-1][1]
        elapsed = min(self.clock.t - self._begun, self._stuck_at())
        return trajectory.sample(elapsed)[0]


@dataclass
class FakeGripper:
    """`inside` m is how thick what lies between the pads is, `soft` m what a force below `yields` N leaves of it."""

    clock: Clock
    gap: float = 0.0
    inside: float = 0.0
    soft: float = 0.0
    yields: float = 0.0
    told: list[tuple[float, str, float]] = field(default_factory=list)

    def open(self, gap: float) -> None:
        self.gap = gap
        self.told.append((self.clock.t, "open", gap))

    def close(self, force: float) -> None:
        self.gap = self.inside if force >= self.yields else self.soft
        self.told.append((self.clock.t, "close", force))

    def reading(self) -> GripperReading:
        return GripperReading(self.clock.t, self.gap)


@dataclass
class Rig:
    """A cell with both arms asleep."""

    known: CableKnown
    clock: Clock = field(default_factory=Clock)

    def __post_init__(self) -> None:
        self.arms: dict[str, FakeArm] = {
            s.name: FakeArm(s.name, self.clock, np.array(s.sleep)) for s in self.known.arms
        }
        self.grippers: dict[str, FakeGripper] = {s.name: FakeGripper(self.clock) for s in self.known.arms}
        self.remarks: list[str] = []  # of what does not follow
        self.motion = CableMotion(
            self.known, self.arms, self.grippers, self.clock, seed=0, on_anomaly=self.remarks.append
        )

    def run(self, task: Request[Any], seconds: float = 60.0) -> None:
        """Poll a task at every tick until it is done."""
        end = self.clock.t + seconds
        while not task.poll():
            assert self.clock.t < end, "the task does not end"
            self.clock.t += TICK
