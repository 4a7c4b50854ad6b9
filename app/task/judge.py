"""The judge of a run: whether it came out as its scenario expects, by ground truth."""

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from regrasp.app.task.expect import Expect
from regrasp.app.task.expectation import Expectation

if TYPE_CHECKING:
    from regrasp.behaviors.services import Services
    from regrasp.sim.world import World

LEAST_TOUCH = 1.0  # N; a weaker touch is not told

ExpectT = TypeVar("ExpectT", bound=Expect)


class Judge(Generic[ExpectT]):
    """Judges what every task expects. A task derives its own: it watches every tick, and adds expectations."""

    def __init__(self, world: "World[Any]", services: "Services", expect: ExpectT) -> None:
        self.world, self.services, self.expect = world, services, expect
        self._told: dict[str, float] = {}  # the forces of touches that were told, by their pairs

    def new_touches(self) -> Iterator[tuple[str, float]]:
        """The pairs whose greatest force (N) has doubled since they were told last; a weak touch is not told."""
        for pair, force in self.world.contact_peaks.items():
            if force > 2.0 * self._told.get(pair, 0.5 * LEAST_TOUCH):
                self._told[pair] = force
                yield pair, force

    def observe(self, now: float) -> None:
        """Look at the ground truth after a tick at second `now`."""

    def expectations(self, outcome: str, cause: str | None) -> tuple[Expectation, ...]:
        """Every expectation of the scenario, met or not, given how the run ended."""
        wanted = self.expect
        found = [Expectation("outcome", outcome == wanted.outcome, outcome, wanted.outcome), *self.states()]
        if wanted.cause is not None:
            found.append(Expectation("cause", cause == wanted.cause, cause, wanted.cause.value))
        return (*found, *self.limits())

    def states(self) -> Iterator[Expectation]:
        """The task's expectations of the state at the end."""
        yield from ()

    def limits(self) -> Iterator[Expectation]:
        """The expectations that are limits."""
        wanted = self.expect
        yield from at_most("sim_seconds", self.world.now(), wanted.sim_seconds)
        peak = max(self.world.contact_peaks.values(), default=0.0)
        yield from at_most("unintended_force", peak, wanted.unintended_force)

    def measured(self) -> dict[str, Any]:
        """What the task measured, by ground truth, for the record: values of JSON's types."""
        return {}


def at_most(name: str, value: float | None, limit: float | None) -> Iterator[Expectation]:
    """The expectation that a value is no more than `limit`; none without a limit."""
    if limit is not None:
        yield Expectation(name, value is not None and value <= limit, value and round(value, 4), limit)
