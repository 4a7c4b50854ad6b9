"""What leaves of every task ask of the robot's services. `motion` and `perception` answer, in tests stand-ins do."""

from collections.abc import Collection, Sequence
from typing import TYPE_CHECKING, NamedTuple, Protocol

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.frame import RgbdFrame
from regrasp.interfaces.outline import Outline
from regrasp.interfaces.request import Request

if TYPE_CHECKING:
    from scipy.spatial.transform import RigidTransform

    from regrasp.interfaces.cell import Box


class Obstacles(NamedTuple):
    """A map of obstacles: voxels by their centres in the world."""

    points: FloatArray  # (n, 3) m, seen to be full
    spacing: float  # m, the voxels' edge
    unseen: FloatArray  # (m, 3) m, behind seen surfaces: assumed to be full until a camera shows them
    shadow: FloatArray  # (k, 3) m, further behind them: assumed to be free, but a thing may reach there


class MotionService(Protocol):
    """Motions of the arms. Each returns a request at once, which fails with PlanningError."""

    def move(self, arm: str, goals: FloatArray, *, margin: float | None = None, tight: bool = True) -> Request[None]:
        """Bring an arm along a free path to one of the goals (k, n), `margin` m from everything."""
        ...

    def sleep(self, arm: str, *, pulling: bool = False) -> Request[None]:
        """Bring an arm to its sleep pose; `pulling`: it may pull something elastic along."""
        ...

    def straight(
        self, arm: str, goal: "RigidTransform", *, speed: float | None = None, pressing: bool = False
    ) -> Request[None]:
        """Move the tool in a straight line to `goal` (world_from_tool), unchecked; `speed` in (0, 1].

        `pressing`: the arm shall touch something there, and only a great force stops it.
        """
        ...

    def shift(
        self,
        arm: str,
        displacement: Sequence[float] | FloatArray,
        *,
        checked: bool = True,
        without: "Collection[Box]" = (),
    ) -> Request[None]:
        """Move the tool straight by `displacement` (3,) m in the world; `checked`: not if the arm
        would touch anything but the boxes `without`."""
        ...

    def close(self, arm: str, thickness: float) -> Request[float]:
        """Close the jaw on a thing of `thickness` m; the answer is the gap (m) at which it holds."""
        ...

    def open_jaw(self, arm: str) -> None:
        """Tell the jaw to open, without waiting for it."""
        ...

    def release(self, arm: str, gap: float) -> Request[None]:
        """Open the jaw; done once it stands `gap` m open."""
        ...

    def stop(self) -> None:
        """Stop all arms."""
        ...

    def joints(self, arm: str) -> FloatArray:
        """The arm's joints (n,) as read."""
        ...

    def tool(self, arm: str) -> "RigidTransform":
        """world_from_tool as read."""
        ...

    def set_obstacles(
        self,
        points: FloatArray,
        spacing: float,
        unseen: FloatArray | None = None,
        shadow: FloatArray | None = None,
    ) -> None:
        """Keep clear of these voxels from now on, see `Obstacles`.

        An arm enters the unseen ones where it finds no other way, and is slow and easily stopped in the shadow.
        """
        ...

    def keep_clear(self, points: FloatArray) -> None:
        """Keep clear of these points (n, 3) m too; they replace an earlier call's."""
        ...


class StillnessService(Protocol):
    """A watch of a camera's pictures."""

    def still(self) -> bool | None:
        """Whether nothing moved of late, the newest frame included; None while it cannot tell."""
        ...


class PerceptionService(Protocol):
    """What the cameras show, by their newest frames."""

    @property
    def fixed_cameras(self) -> tuple[str, ...]:
        """The names of the cameras that no arm carries."""
        ...

    def frame(self, camera: str) -> RgbdFrame | None:
        """The newest frame; None before the first."""
        ...

    def outlines(self, camera: str) -> Sequence[Outline]:
        """What was found last in the pictures of a camera, for the record."""
        ...

    def trouble(self, camera: str) -> str | None:
        """Why a camera is not to be trusted now, in a sentence; None when all is well."""
        ...

    def surface(self, camera: str, since: float) -> FloatArray | None:
        """Points (n, 3) m, world, that a camera shows; None while there is no frame from the time `since` (s) on."""
        ...

    def look_around(self) -> int:
        """Before the work: map what every fixed camera sees; the number of full voxels."""
        ...

    def map_obstacles(self, camera: str) -> int:
        """Map what a camera sees; the number of full voxels."""
        ...

    def map_new_obstacle(self, camera: str) -> int:
        """Map what a camera sees if that is a new thing; its number of voxels, else 0."""
        ...

    def obstacles(self) -> Obstacles:
        """What is mapped: centres (n, 3) m, world, of full voxels, and their edge in m."""
        ...

    def watch_stillness(self, camera: str) -> StillnessService:
        """Begin to watch whether anything moves before a fixed camera."""
        ...
