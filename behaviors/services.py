"""The services that leaves are given at `setup`, and the belief that they share."""

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from regrasp.interfaces.devices import Clock
from regrasp.interfaces.services import MotionService, PerceptionService

if TYPE_CHECKING:
    from scipy.spatial.transform import RigidTransform

    from regrasp.interfaces.cell import KnownCell


@dataclass
class LossNotice:
    """A loss of the connector that the robot noticed: `at` which simulated second, `by` which test."""

    at: float
    by: str


@dataclass
class Belief:
    """What the robot believes. Leaves write it, the run's record reads it; its names are those of the record."""

    held: "RigidTransform | None" = None  # tool_from_connector of the hand, None when it holds nothing
    connector: "RigidTransform | None" = None  # world_from_connector as last found for a grasp
    sure: bool = False  # whether the whole of the connector was seen there
    found_by: str | None = None  # the camera that found it last
    vain_searches: int = 0  # searches that failed since the connector was found last
    notices: list[LossNotice] = field(default_factory=list)


@dataclass
class Services:
    """The services of one run. A task's leaves know more of its own."""

    known: "KnownCell"
    clock: Clock
    motion: MotionService
    perception: PerceptionService
    log: Any  # structlog's bound logger
    belief: Belief = field(default_factory=Belief)

    def take_over_map(self) -> None:
        """Let the arms keep clear of the obstacles that are mapped."""
        self.motion.set_obstacles(*self.perception.obstacles())
