"""The services that leaves are given at `setup`."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from regrasp.interfaces.devices import Clock
from regrasp.interfaces.services import MotionService, PerceptionService

if TYPE_CHECKING:
    from regrasp.interfaces.cell import KnownCell
    from regrasp.interfaces.task_network import State, TaskNetwork


@dataclass
class Services:
    """The services of one run. A task's leaves know more of its own."""

    known: "KnownCell"
    clock: Clock
    motion: MotionService
    perception: PerceptionService
    log: Any  # structlog's bound logger
    networks: "Mapping[str, TaskNetwork]" = field(default_factory=dict, kw_only=True)  # that the tree names

    def seen(self, state: "State") -> dict[str, str]:
        """What the robot sees now of what a task network's `state` tells; a task's services know more."""
        return {}

    def take_over_map(self) -> None:
        """Let the arms keep clear of the obstacles that are mapped."""
        self.motion.set_obstacles(*self.perception.obstacles())
