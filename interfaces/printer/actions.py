"""The actions of the habitat's four devices (Mounesisohi 2022, sections 4.2.5 to 4.2.8).

A device takes a goal and does it over many ticks. Until the result is there it tells its feedback, and it can be
cancelled at any time; a new goal preempts the one under way. A goal that cannot be done ends with its cause.
"""

from collections.abc import Callable, Generator, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Generic, Literal, Protocol, TypeVar, get_args

from regrasp.interfaces.arguments import finite, finite_pose, not_negative, positive, vector
from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.printer.cause import PrinterCause
from regrasp.interfaces.request import Request, RequestError
from regrasp.interfaces.wall_time import Part

if TYPE_CHECKING:
    from scipy.spatial.transform import RigidTransform

Feedback = TypeVar("Feedback", covariant=True)
Result = TypeVar("Result")
Goal = TypeVar("Goal", contravariant=True)

Approach = Literal["one_step", "two_step", "three_step", "servo"]  # ways to the part; the first three the source's
Free = Literal["part", "both"]  # what has come loose: the part from its plate, or both from the printer
Place = Literal["clamp", "tray"]  # on the desk, where something is put
Target = Literal["obj", "targ"]  # what to look for: the red part, and its blue gripping section
# The source's classes: also the left and the right finger, as the picture shows them.
PartClass = Literal["obj", "targ", "lgrip", "rgrip"]
CLASSES: tuple[PartClass, ...] = get_args(PartClass)
# The part and what it lies on, by their names; a cell's file names the box under the plate so.
PART_AND_BED = ("part", "section", "plate", "plate_bed")


class Action(Request[Result], Generic[Feedback, Result]):
    """A goal under way: `poll` it every tick, `cancel` it at any time; `answer` is its result once it is done.

    `feedback` tells how far it is, at any time. An action that was cancelled counts as done and has no result. One that
    a new goal preempted is stopped, and its `poll` raises RequestError PREEMPTED.
    """

    def __init__(
        self,
        steps: Generator[None, None, Result],
        feedback: Callable[[], Feedback],
        stop: Callable[[], None] = lambda: None,
        part: Part = "planning",
    ) -> None:
        super().__init__(steps, stop, part)
        self.feedback = feedback
        self.cancelled = self._failed = False

    def poll(self) -> bool:
        """See `Request`."""
        try:
            return super().poll()
        except RequestError:
            self._failed = True
            raise

    def cancel(self) -> None:
        """See `Request`. An action that is done, or has failed, stays so."""
        if self._under_way():
            self.cancelled = True
            super().cancel()

    def preempt(self) -> None:
        """Cancel it for the sake of a new goal; see `cancel`."""
        if self._under_way():
            self.cancel()
            self._steps = _preempted()

    def _under_way(self) -> bool:
        return not (self.cancelled or self._failed or hasattr(self, "_answer"))


def _preempted() -> Iterator[None]:
    yield from ()  # makes it a generator, which raises at the next poll
    raise RequestError(PrinterCause.PREEMPTED, "another goal was sent to the device before this one was done")


class Device(Protocol[Goal, Feedback, Result]):
    """A device that does one goal at a time."""

    def send(self, goal: Goal) -> Action[Feedback, Result]:
        """Begin with a goal; one under way is preempted. Raises TypeError for a goal of another device."""
        ...


class Turn(Protocol):
    """Who moves a part of the robot, such as arm and rail together: one action at a time."""

    def take(self, request: Request[Any], feedback: Callable[[], Feedback]) -> Action[Feedback, Any]:
        """A request of the motion service as an action that preempts the one under way."""
        ...


@dataclass(frozen=True)
class PoseGoal:
    """Bring the tool to a pose, world_from_tool; the rail moves too where the arm alone does not reach.

    The last `standoff` m it goes straight along the tool's axis. From the pose the arm must be able to go on in
    straight lines to the poses `onward`, goal_from_tool. On straight ways it may touch the things named in `may_touch`.
    """

    pose: "RigidTransform"
    standoff: float = 0.0
    may_touch: tuple[str, ...] = ()
    onward: tuple["RigidTransform", ...] = ()

    def __post_init__(self) -> None:
        for pose in (self.pose, *self.onward):
            finite_pose("the pose", pose)
        not_negative("the standoff", self.standoff)

    @classmethod
    def at(cls, position: Sequence[float], rpy_deg: Sequence[float], standoff: float = 0.0) -> "PoseGoal":
        """The goal at a position (3,) m, turned by roll, pitch and yaw: about x, then y, then z, all of the world."""
        from scipy.spatial.transform import RigidTransform, Rotation  # late: a tree's check needs no scipy

        turn = Rotation.from_euler("xyz", finite("the turn", rpy_deg), degrees=True)
        return cls(RigidTransform.from_components(vector("the position", position), turn), standoff)


@dataclass(frozen=True)
class PoseRelGoal:
    """Move the tool straight from where it is by an offset (3,) m along the world's axes, without turning it."""

    offset: tuple[float, float, float]
    may_touch: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        vector("the offset", self.offset)


@dataclass(frozen=True)
class JointGoal:
    """Bring the arm's joints, without the rail, to these angles (rad) along a free path."""

    angles: tuple[float, ...]

    def __post_init__(self) -> None:
        finite("the angles", self.angles)


ManipulatorGoal = PoseGoal | PoseRelGoal | JointGoal


@dataclass(frozen=True, eq=False)
class ManipulatorState:
    """Where the arm is: joints (n,), rail first, and world_from_tool, both as read."""

    joints: FloatArray
    tool: "RigidTransform"

    def __str__(self) -> str:
        x, y, z = self.tool.translation
        return f"the tool is at {x:.3f}, {y:.3f}, {z:.3f} m"


@dataclass(frozen=True)
class GripperGoal:
    """Bring the pads to `gap` m from each other; or with a `force`, close until they press with it (N a finger)."""

    gap: float = 0.0
    force: float | None = None

    def __post_init__(self) -> None:
        not_negative("the gap", self.gap)
        if self.force is not None:
            positive("the force", self.force)


@dataclass(frozen=True)
class GripperState:
    """The gap (m) between the pads, as read."""

    gap: float

    def __str__(self) -> str:
        return f"the jaw stands {1e3 * self.gap:.1f} mm open"


@dataclass(frozen=True)
class RailGoal:
    """Bring the rail to a position, m along it; the arm's other joints stand."""

    position: float

    def __post_init__(self) -> None:
        finite("the rail's position", self.position)


@dataclass(frozen=True)
class RailState:
    """Where the rail is, m along it, as read."""

    position: float

    def __str__(self) -> str:
        return f"the rail is at {self.position:.3f} m"


@dataclass(frozen=True)
class ClampGoal:
    """Close the clamp's jaws on what lies between them, or open them."""

    closed: bool


@dataclass(frozen=True)
class ClampState:
    """How far (m) each jaw of the clamp has gone in from where it is open, as read."""

    travel: tuple[float, float]

    def __str__(self) -> str:
        return f"the clamp's jaws have gone in by {' and '.join(f'{1e3 * way:.1f}' for way in self.travel)} mm"


@dataclass(frozen=True)
class ImageGoal:
    """Find a target in the newest picture of the hand's camera; give up after `seconds` (simulated)."""

    target: Target = "obj"
    seconds: float = 1.0

    def __post_init__(self) -> None:
        positive("the seconds", self.seconds)
        if self.target not in ("obj", "targ"):
            raise ValueError(f"no target {self.target!r}; there are obj, the part, and targ, its gripping section")


@dataclass(frozen=True)
class ImageFeedback:
    """How many pictures were looked at so far."""

    pictures: int

    def __str__(self) -> str:
        return f"looked at {self.pictures} pictures"


@dataclass(frozen=True)
class Sighting:
    """A target in a picture: its box's centre from the picture's centre, px right and down, and its area, px2.

    `box` is (u0, v0, u1, v1) px, by the edges of pixels: pixel u covers u - 0.5 to u + 0.5. `confidence` is the
    network's, 0 to 1; None: it saw nothing, and the target was found by its colour.
    """

    offset: tuple[float, float]
    area: float
    stamp: float  # s, of the picture
    box: tuple[float, float, float, float]
    confidence: float | None = None


@dataclass(frozen=True)
class PlaceView:
    """What a picture shows of a place that something shall take up: points of the surface on it, and of what is above.

    `height` (m) is how far the highest things there rise over the place's floor.
    """

    points: int
    above: int
    height: float


class GripperDevice(Device[GripperGoal, GripperState, GripperState], Protocol):
    """The gripper."""

    def state(self) -> GripperState:
        """The gap between the pads, as read."""
        ...


class Clamp(Protocol):
    """A clamp with two jaws, which press on what is between them."""

    def close(self) -> None:
        """Close the jaws, and press from now on."""
        ...

    def open(self) -> None:
        """Open the jaws."""
        ...

    def travel(self) -> tuple[float, float]:
        """How far, m, each jaw has gone in from where it is open, as read."""
        ...


ClampDevice = Device[ClampGoal, ClampState, ClampState]
Manipulator = Device[ManipulatorGoal, ManipulatorState, ManipulatorState]
Rail = Device[RailGoal, RailState, RailState]
ImageAnalyzer = Device[ImageGoal, ImageFeedback, Sighting]
