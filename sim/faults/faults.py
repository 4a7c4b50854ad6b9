"""What goes wrong, caused by the world: each fault waits for its moment, takes effect, and may end."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from regrasp.interfaces.fault import AnyFault, Lasting, Phase, When
from regrasp.sim.faults.effects import Effect

FloatArray = NDArray[np.float64]


@dataclass
class Moments:
    """What triggers go by: the second, the held connector's share of the way, phases and nodes with their seconds."""

    now: float = 0.0
    carried: float | None = None  # None while it is plugged in or not held by both pads
    phases: dict[Phase, float] = field(default_factory=dict)
    nodes: dict[str, float] = field(default_factory=dict)

    def has_come(self, when: When) -> bool:
        """Whether the moment, drawn, has come."""
        if when.at is not None:
            return self.now >= when.at[0] - 1e-9
        if when.carried is not None:
            return self.carried is not None and self.carried >= when.carried[0]
        if when.phase is not None:
            return when.phase in self.phases
        delay = when.after[0] if when.after else 0.0
        entered = (second for path, second in self.nodes.items() if names(path, when.node or ""))
        return any(self.now >= second + delay - 1e-9 for second in entered)


def names(path: str, node: str) -> bool:
    """Whether `node` is a tree path or the last names of it."""
    return f"/{path}".endswith(f"/{node}")


class Fault:
    """A fault of one run. `began_at` and `ended_at` are simulated seconds, None before."""

    def __init__(self, spec: AnyFault, effect: Effect) -> None:
        self.spec, self._effect = spec, effect
        self.began_at: float | None = None
        self.ended_at: float | None = None

    @property
    def active(self) -> bool:
        """Whether it is in force now."""
        return self.began_at is not None and self.ended_at is None

    @property
    def waiting(self) -> bool:
        """Whether it is still to come."""
        return self.began_at is None

    def watch(self, moments: Moments) -> None:
        """Begin when the moment has come, end when the time is over."""
        if self.waiting and moments.has_come(self.spec.when):
            self.began_at = moments.now
            self._effect.begin()
        if not self.active or self.began_at is None:
            return
        seconds = self.spec.seconds if isinstance(self.spec, Lasting) else self._effect.seconds
        if seconds is not None and moments.now >= self.began_at + seconds - 1e-9:
            self.end(moments.now)

    def end(self, now: float) -> None:
        """Take the effect back."""
        self.ended_at = now
        self._effect.end()

    def step(self, now: float) -> None:
        """Act, before a physics step that begins at second `now`."""
        if self.active and self.began_at is not None:
            self._effect.step(now - self.began_at)
