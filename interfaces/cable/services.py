"""What the cable's leaves ask of the robot's services, besides what those of every task do."""

from collections.abc import Callable, Collection, Iterator, Sequence
from typing import TYPE_CHECKING, Protocol

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cable.motion import Grip, PluggedIn, View, Viewpoint
from regrasp.interfaces.cable.sight import Estimate, InHand, NoEstimate, Sightings, TrackHealth, TrackState
from regrasp.interfaces.evidence import Evidence
from regrasp.interfaces.request import Request
from regrasp.interfaces.services import MotionService, Obstacles, PerceptionService

if TYPE_CHECKING:
    from scipy.spatial.transform import RigidTransform


class GripService(Protocol):
    """A watch of the pads of a jaw that holds something."""

    def evidence(self) -> Evidence:
        """Whether it was lost, the newest reading included; ask every tick."""
        ...


class CableMotionService(MotionService, Protocol):
    """Motions of the hand, the arm that handles the cable, and of the arm that carries the camera that searches.

    `held` is tool_from_connector, `plug` world_from_connector.
    """

    @property
    def hand(self) -> str:
        """The arm that handles the cable now; at first the cell's."""
        ...

    def take_with(self, arm: str) -> None:
        """Let an arm handle the cable from now on."""
        ...

    def hands_for(self, world_from_connector: "RigidTransform", without: Collection[str] = ()) -> Request[list[str]]:
        """The arms, but for those `without`, that can take the loose connector, the best first; one where none can."""
        ...

    def pick_plug(
        self, plug: "RigidTransform", *, point_cloud: Callable[[float], FloatArray | None] | None = None
    ) -> Request[None]:
        """Bring the open jaw round the plugged connector, corrected by points (n, 3) m that a camera sees of the arm.

        `point_cloud` gives those of a picture from that second on, None while there is none.
        """
        ...

    def pick_loose(
        self, world_from_connector: "RigidTransform", *, point_cloud: Callable[[float], FloatArray | None] | None = None
    ) -> Request[None]:
        """As `pick_plug`, where the connector hangs at its cable, of which the arm keeps clear."""
        ...

    def can_pick_loose(self, world_from_connector: "RigidTransform") -> bool:
        """Whether an arm has a free grasp of the loose connector, with all space that no camera has seen for full."""
        ...

    def grip(self, world_from_connector: "RigidTransform") -> Request[Grip]:
        """Close the jaw on the connector; fails with GraspEmptyError when it closes on nothing."""
        ...

    def watch_grip(self) -> GripService:
        """Begin to watch by the pads whether the hand holds the connector."""
        ...

    def pull_cable(self, world_from_connector: "RigidTransform") -> Request[str]:
        """Let an arm take hold of the cable near the loose connector, lift it, and keep hold; the answer is the arm."""
        ...

    def bring_cable(self, arm: str, world_from_connector: "RigidTransform | None") -> Request[None]:
        """Bring what an arm holds of the cable to another place, where its end, which hangs there now, has room."""
        ...

    def let_go_of_cable(self, arm: str) -> Request[None]:
        """Open the jaw of an arm that holds the cable, and bring the arm to its sleep pose."""
        ...

    def pull_out(self, plug: "RigidTransform") -> Request[None]:
        """Draw the gripped plug out of its socket, and go back the way the hand came in."""
        ...

    def carry_to_clip(self, held: "RigidTransform", *, forced: bool = True) -> Request[None]:
        """Bring the held connector before the clip; the cable is bent by force only if `forced`."""
        ...

    @property
    def insertions(self) -> int:
        """How many different tries `insert` knows."""
        ...

    def insert(self, held: "RigidTransform", attempt: int = 0) -> Request[None]:
        """Bring the held connector straight into the clip; at each later `attempt` as if it lay a little otherwise."""
        ...

    def pull_at_clip(self, held: "RigidTransform") -> Request[Evidence]:
        """Pull gently at the inserted connector; whether the clip holds it. If not, the hand goes back before it."""
        ...

    def let_go(self) -> Request[None]:
        """Open the jaw; done once it stands wider than a connector."""
        ...

    def draw_back(self) -> Request[str]:
        """Draw the hand straight back as far as is free. The answer is '', or why no distance was."""
        ...

    def leave_clip(self) -> Request[None]:
        """Bring the hand to its sleep pose without sweeping the stowed end out of its clip."""
        ...

    def check_socket(self, name: str) -> None:
        """Raises PlanningError unless the cable lets its end lie in the socket of that name."""
        ...

    def carry_to_socket(self, held: "RigidTransform", name: str) -> Request[None]:
        """Bring the held connector before the socket of that name."""
        ...

    def plug_in(self, held: "RigidTransform", name: str) -> Request[PluggedIn]:
        """Push the held connector into the socket before it, by force sensing, until a gentle pull does not move it."""
        ...

    def leave_socket(self, name: str) -> Request[None]:
        """Draw the open hand back from the plugged connector, and bring it to its sleep pose."""
        ...

    def search_views(self, last_seen: FloatArray | None) -> tuple[FloatArray, Iterator[Viewpoint]]:
        """Where a search begins, (3,) m in the world, and its viewpoints; None: the connector was never seen."""
        ...

    def rest_views(self) -> "list[RigidTransform]":
        """Viewpoints (world_from_camera) that show the connector where its cable hangs by itself, the best first."""
        ...

    def view(self, world_from_camera: "RigidTransform") -> View:
        """The viewpoint, or one near, if the camera can be brought there. Raises PlanningError if not."""
        ...

    def view_of(self, place: FloatArray, world_from_camera: "RigidTransform") -> View:
        """A view of a `place` (3,) m that was glimpsed from a camera. Raises PlanningError when there is none."""
        ...

    def best_view(
        self, world_from_connector: "RigidTransform", taken: Sequence[FloatArray] = (), past: str | None = None
    ) -> View:
        """A view of the whole connector from a side that is not among the lines of sight `taken` (3,).

        `past`: the arm that holds it, past which its ends show. Raises PlanningError when there is none.
        """
        ...

    def go_to_view(self, view: View) -> Request[None]:
        """Bring the camera to a view."""
        ...


class CablePerceptionService(PerceptionService, Protocol):
    """Where the connector is, how it lies in the hand, whether it got lost."""

    @property
    def last(self) -> Estimate | None:
        """The newest estimate of any camera, however old."""
        ...

    def look(self, camera: str) -> Estimate | NoEstimate | None:
        """The connector's pose by the newest frame, or why there is none; None before the first frame."""
        ...

    def watch(
        self,
        camera: str,
        seconds: float,
        *,
        settle: float = 0.0,
        later: bool = False,
        on_mapped: Callable[[], None] | None = None,
    ) -> Request[Sightings]:
        """Look every tick for `seconds` after `settle` seconds; the answer holds one result a frame.

        A frame of the very first moment counts unless only `later` ones shall. With `on_mapped` the obstacles in view
        are mapped on the way, and this is called then.
        """
        ...

    def fuse(self, estimates: Sequence[Estimate]) -> Estimate:
        """One estimate from several of a connector at rest. Raises ValueError without any."""
        ...

    def expect_in_hand(self, tool: "RigidTransform | None", held: "RigidTransform | None" = None) -> None:
        """From now on the hand at `tool` (world_from_tool) may hide the connector, which it holds so; None ends it."""
        ...

    def use(self, technique: str) -> None:
        """Look by this technique from now on. Raises ValueError if the cell lacks what it needs."""
        ...

    def check(self) -> TrackHealth:
        """The thesis's three questions: is there a pose, is it fresh, is it live?"""
        ...

    def state(self) -> tuple[TrackState, str]:
        """What is known of the connector now, and a sentence."""
        ...

    def slipped(self, tool: "RigidTransform") -> Evidence | None:
        """Whether the connector is seen far from the hand at `tool` (world_from_tool); None while it is not seen."""
        ...

    def stowed(self, estimate: Estimate) -> Evidence:
        """Whether a connector seen so lies in the clip."""
        ...

    def plugged(self, estimate: Estimate, socket: str) -> Evidence:
        """Whether a connector seen so lies in the socket of that name."""
        ...

    def in_hand(
        self, seen: Sequence[Estimate], tool: "RigidTransform", held: "RigidTransform", *, least_turn_deg: float = 0.0
    ) -> InHand | None:
        """How the connector lies in the hand at `tool` that was believed to hold it so; None where too little shows.

        A turn by less than `least_turn_deg` is taken for an error of the sight.
        """
        ...

    def obstacles_beside(self, world_from_connector: "RigidTransform") -> Obstacles:
        """`obstacles` without unseen voxels near the connector."""
        ...
