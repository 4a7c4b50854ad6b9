"""What the printer's leaves ask of the robot's services, besides what those of every task do."""

from typing import TYPE_CHECKING, Protocol

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.request import Request
from regrasp.interfaces.services import MotionService, PerceptionService

if TYPE_CHECKING:
    from scipy.spatial.transform import RigidTransform


class PrinterPerceptionService(PerceptionService, Protocol):
    """What is seen of a printer."""

    def see_handle(self, camera: str, since: float) -> FloatArray | None:
        """The middle (3,) m, world, of the handle's front; None while no frame from `since` (s) on shows enough."""
        ...


class PrinterMotionService(MotionService, Protocol):
    """Motions of an arm on a rail at a printer whose door it opens."""

    @property
    def door_opening(self) -> float:
        """How far, m, the door is believed to stand open."""
        ...

    def handle(self, opening: float, before: float = 0.0) -> "RigidTransform":
        """world_from_tool of a hand that takes the handle of a door that stands `opening` m open.

        Or `before` m before that, along the hand.
        """
        ...

    def believe_handle(self, place: FloatArray) -> FloatArray:
        """Take the handle to be at a place (3,) m, of which y and z count; returns how far (3,) m it was off."""
        ...

    def draw_back(self, arm: str, distance: float) -> Request[None]:
        """Draw the hand straight back by `distance` m."""
        ...

    def take_handle(self, arm: str) -> Request[float]:
        """Close the jaw on the handle and give way to it; the answer is the gap (m) between the pads."""
        ...

    def slide_door(self, arm: str, position: float) -> Request[None]:
        """Bring the rail of an arm that holds the handle to a position (m along it): the door goes along."""
        ...
