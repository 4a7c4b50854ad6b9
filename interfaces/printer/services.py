"""What the printer's leaves ask of the robot's services, besides what those of every task do."""

from typing import TYPE_CHECKING, Protocol

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.request import Request
from regrasp.interfaces.services import MotionService, PerceptionService

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Sequence

    from scipy.spatial.transform import RigidTransform

    from regrasp.interfaces.cell import Box
    from regrasp.interfaces.frame import RgbdFrame
    from regrasp.interfaces.printer.actions import PlaceView, Sighting
    from regrasp.interfaces.printer.target import TargetTracker


class PrinterPerceptionService(PerceptionService, Protocol):
    """What is seen of a printer."""

    def part_tracker(
        self,
        tool_of: "Callable[[RgbdFrame], RigidTransform]",
        gap: "Callable[[], float]",
        since: float,
        say: "Callable[..., None]" = lambda event, **values: None,
    ) -> "TargetTracker":
        """What follows the part's section through the camera on the hand, in frames from the time `since` (s) on.

        `tool_of` gives world_from_tool at a frame's exposure, `gap` what the finger encoder reads (m), and `say` is
        told what the record should show.
        """
        ...

    def offset_by_tables(self, seen: "Sighting") -> FloatArray:
        """Offset (3,) m in the world from the tool to its goal before the part, by the source's tables."""
        ...

    def see_handle(self, camera: str, since: float) -> FloatArray | None:
        """The middle (3,) m, world, of the handle's front; None while no frame from `since` (s) on shows enough."""
        ...

    def see_place(self, camera: str, since: float, place: "Box") -> "PlaceView | None":
        """What stands on a place, the box that something shall take up; None while no frame from `since` (s) on."""
        ...


class PrinterMotionService(MotionService, Protocol):
    """Motions of an arm on a rail at a printer whose door it opens."""

    @property
    def door_opening(self) -> float:
        """How far, m, the door is believed to stand open."""
        ...

    @property
    def part_speed(self) -> float:
        """How fast, m/s, the last approach by sight saw the part move at its end."""
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

    def catch_part(self, arm: str, target: "TargetTracker", inside: float, moved: "Collection[str]") -> Request[float]:
        """Follow a part that floats with the things `moved`, and close on its section `inside` m behind its front."""
        ...

    def held_goal(self, arm: str, name: str, place: FloatArray) -> "RigidTransform":
        """world_from_tool with which the held thing of this name has its middle at a place (3,) m, turned as taken."""
        ...

    def draw_out(self, arm: str, distance: float) -> Request[None]:
        """Draw the part that the hand holds straight back, with its plate, by `distance` m."""
        ...

    def look_at(self, arm: str, place: "Sequence[float]", distance: float, pitch: float) -> Request[None]:
        """Bring the camera `distance` m before a place (3,) m, about `pitch` rad down, with what the hand holds."""
        ...

    def carry(
        self,
        arm: str,
        goal: "RigidTransform",
        onward: "Collection[RigidTransform]" = (),
        may_touch: "Collection[str]" = (),
    ) -> Request[None]:
        """Bring the tool with what it holds to a pose, from which it must go on straight to `onward`."""
        ...

    def move_held(self, arm: str, way: FloatArray, may_touch: "Collection[str]") -> Request[None]:
        """Bring what the hand holds straight on by (3,) m; it may touch the things of these names, and its plate."""
        ...

    def believe_held(self, arm: str, names: "Collection[str]") -> None:
        """The hand holds the things of these names as they lie now: they go with it, and count as a part of the arm."""
        ...

    def believe_lost(self, arm: str) -> None:
        """The hand has lost what it held: each thing is taken to be where the hand lost it, from now on."""
        ...

    def believe_door(self, opening: float) -> None:
        """Keep clear of the door as it stands `opening` m open, from now on."""
        ...

    def holds(self, arm: str, thickness: float) -> bool:
        """Whether the pads stand as far apart as a thing of `thickness` m asks for that they hold."""
        ...

    def grip_part(self, arm: str) -> Request[float]:
        """Close the jaw on the section between the pads; the part then counts as held. The answer is the gap (m)."""
        ...

    def floats(self, arm: str) -> bool:
        """Whether what the hand lets go floats: there is no gravity."""
        ...

    def release_part(self, arm: str, gap: float) -> Request[None]:
        """Open the jaw softly to `gap` m; what the hand held then counts as lying where it is."""
        ...

    def twist(self, arm: str, angle: float) -> Request[None]:
        """Turn the held part by an angle (rad) about the upright axis through its middle, and back."""
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
