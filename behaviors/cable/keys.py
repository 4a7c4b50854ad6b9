"""What the cable's leaves hand on to one another: the robot's belief."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

from regrasp.behaviors.keys import Key

if TYPE_CHECKING:
    from scipy.spatial.transform import RigidTransform


@dataclass(frozen=True)
class Found:
    """Where a camera found the connector."""

    world_from_connector: "RigidTransform"
    whole: bool  # whether the whole of it was seen
    camera: str


@dataclass(frozen=True)
class LossNotice:
    """A loss of the connector that the robot noticed: `at` which simulated second, `by` which test."""

    at: float
    by: str


HELD: "Key[RigidTransform]" = Key("cable/held", "tool_from_connector of the hand, which holds it")
FOUND: Key[Found] = Key("cable/found", "where the connector was found for a grasp, in the world")
VAIN_CARRIES: Key[int] = Key("cable/vain_carries", "carries that failed since it was gripped", default=0)
VAIN_SEARCHES: Key[int] = Key("cable/vain_searches", "searches that failed since it was found last", default=0)
NOTICES: Key[tuple[LossNotice, ...]] = Key("cable/notices", "losses that were noticed, the latest last", default=())
