"""The services that leaves are given at `setup`."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from regrasp.interfaces.devices import Clock
from regrasp.interfaces.services import MotionService, PerceptionService

if TYPE_CHECKING:
    from regrasp.interfaces.cell import KnownCell


@dataclass
class Services:
    """The services of one run. A task's leaves know more of its own."""

    known: "KnownCell"
    clock: Clock
    motion: MotionService
    perception: PerceptionService
    log: Any  # structlog's bound logger

    def take_over_map(self) -> None:
        """Let the arms keep clear of the obstacles that are mapped."""
        self.motion.set_obstacles(*self.perception.obstacles())
