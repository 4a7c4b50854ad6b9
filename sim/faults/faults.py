"""Faults of a run: each waits for its trigger, takes effect, and may end."""

from dataclasses import dataclass, field

from regrasp.interfaces.fault import Fault, Lasting, When
from regrasp.sim.faults.effects import Effect


@dataclass
class TriggerState:
    """The state of a run on which the beginning of faults depends."""

    now: float = 0.0  # simulated second
    # Shares of the task's progress by name; None while there is none.
    shares: dict[str, float | None] = field(default_factory=dict)
    phases: dict[str, float] = field(default_factory=dict)  # seconds at which phases began
    nodes: dict[str, float] = field(default_factory=dict)  # seconds at which nodes, by tree path, were first entered

    def triggers(self, when: When) -> bool:
        """Whether a fault with this `when`, its ranges drawn, is due."""
        if when.at is not None:
            return self.now >= when.at[0] - 1e-9
        for name in when.SHARES:
            if (span := getattr(when, name)) is not None:
                share = self.shares.get(name)
                return share is not None and share >= span[0]
        if (phase := getattr(when, "phase", None)) is not None:  # of a task that has phases
            return phase in self.phases
        delay = when.after[0] if when.after else 0.0
        entered = (second for path, second in self.nodes.items() if ends_with_node(path, when.node or ""))
        return any(self.now >= second + delay - 1e-9 for second in entered)


def ends_with_node(path: str, node: str) -> bool:
    """Whether `node` is the tree path `path` or its end, from a node's name on."""
    return f"/{path}".endswith(f"/{node}")


class ScheduledFault:
    """A fault of one run. `began_at` and `ended_at` are simulated seconds, None until then."""

    def __init__(self, spec: Fault, effect: Effect) -> None:
        self.spec, self._effect = spec, effect
        self.began_at: float | None = None
        self.ended_at: float | None = None

    @property
    def active(self) -> bool:
        """Whether it has begun and not ended."""
        return self.began_at is not None and self.ended_at is None

    @property
    def waiting(self) -> bool:
        """Whether it has not begun."""
        return self.began_at is None

    def watch(self, state: TriggerState) -> None:
        """Begin the fault when its trigger fires, end it when its time is over."""
        if self.waiting and state.triggers(self.spec.when):
            self.began_at = state.now
            self._effect.begin()
        if not self.active or self.began_at is None:
            return
        seconds = self.spec.seconds if isinstance(self.spec, Lasting) else self._effect.seconds
        if seconds is not None and state.now >= self.began_at + seconds - 1e-9:
            self.end(state.now)

    def end(self, now: float) -> None:
        """End the fault at second `now`."""
        self.ended_at = now
        self._effect.end()

    def step(self, now: float) -> None:
        """Apply the effect; call before every physics step, which begins at second `now`."""
        if self.active and self.began_at is not None:
            self._effect.step(now - self.began_at)
