"""What the printer's leaves ask of the robot's services, besides what those of every task do."""

from typing import TYPE_CHECKING, Protocol

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.request import Request
from regrasp.interfaces.services import MotionService, PerceptionService

if TYPE_CHECKING:
    from collections.abc import Callable

    from scipy.spatial.transform import RigidTransform

    from regrasp.interfaces.frame import RgbdFrame
    from regrasp.interfaces.printer.actions import Sighting
    from regrasp.interfaces.printer.target import TargetTracker


class PrinterPerceptionService(PerceptionService, Protocol):
    """What is seen of a printer."""

    def part_tracker(
        self, tool_of: "Callable[[RgbdFrame], RigidTransform]", gap: "Callable[[], float]", since: float
    ) -> "TargetTracker":
        """What follows the part's section through the camera on the hand, in frames from the time `since` (s) on.

        `tool_of` gives world_from_tool at a frame's exposure, `gap` what the finger encoder reads (m).
        """
        ...

    def offset_by_tables(self, seen: "Sighting") -> FloatArray:
        """Offset (3,) m in the world from the tool to its goal before the part, by the source's tables."""
        ...

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

    def tool_at(self, frame: "RgbdFrame") -> "RigidTransform":
        """world_from_tool at the exposure of a frame of the camera on an arm."""
        ...

    def part_goal(self, before: float) -> "RigidTransform":
        """world_from_tool `before` m before the front of the part's section, where that is believed to be."""
        ...

    def servo(self, arm: str, target: "TargetTracker", before: float) -> Request[None]:
        """Bring the tool `before` m before a target by what is seen of it on the way, and turn it as the target is."""
        ...

    def take_part(self, arm: str, deeper: float) -> Request[float]:
        """Go straight on, close on the part's section and give way to it; the answer is the gap (m) of the pads."""
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
