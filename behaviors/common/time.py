"""Simulated time in a tree: waiting, and a limit for what stands below."""

from typing import Any, ClassVar

from py_trees.common import Status
from py_trees.decorators import Decorator
from py_trees.ports import PortsMixin

from regrasp.behaviors.leaf import LeafPort, LeafSteps, StepsLeaf, WithServices
from regrasp.interfaces.cause import CauseCode


class Wait(StepsLeaf):
    """SUCCESS once `seconds` of simulated time have passed."""

    INPUT_PORTS: ClassVar[dict[str, Any]] = {
        "seconds": LeafPort(data_type=float, above=0.0, description="simulated seconds to wait")
    }
    RETURNS = frozenset({Status.RUNNING, Status.SUCCESS})

    def steps(self) -> LeafSteps:
        """See the class."""
        yield from self.wait(self.get_input("seconds"))


class TimeLimit(WithServices, PortsMixin, Decorator):
    """The child's status; FAILURE, and the child is stopped, when it still runs after `seconds` of simulated time.

    py_trees' own Timeout reads the wall clock: a slow machine would change the run.
    """

    INPUT_PORTS: ClassVar[dict[str, Any]] = {
        "seconds": LeafPort(data_type=float, above=0.0, description="simulated seconds that the child may take")
    }
    OUTPUT_PORTS: ClassVar[dict[str, Any]] = {}

    def initialise(self) -> None:
        """Begin to count."""
        self._seconds = self.get_input("seconds")
        self._end = self.services.clock.now() + self._seconds

    def update(self) -> Status:
        """See the class."""
        child: Status = self.decorated.status
        if child is not Status.RUNNING or self.services.clock.now() < self._end - 1e-9:
            return child
        name = self.decorated.name.rsplit(".", 1)[-1]
        self.decorated.stop(Status.INVALID)
        return self.fail(CauseCode.TIMED_OUT, f"{name} still ran after {self._seconds:g} simulated seconds")
