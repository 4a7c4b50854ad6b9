"""Services that do what a test tells them, on a clock that is turned by hand."""

from collections.abc import Callable, Collection, Generator, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, cast

import numpy as np
import py_trees
from numpy.typing import NDArray
from py_trees.common import Status
from py_trees.parsers.behaviour_tree_xml import parse_behaviour_tree_xml
from scipy.spatial.transform import RigidTransform

from regrasp.behaviors import LEAVES, keys
from regrasp.behaviors.cable.keys import FOUND, HELD, NOTICES, Found, LossNotice
from regrasp.behaviors.cable.services import CableServices
from regrasp.interfaces.cable.cell import CableKnown
from regrasp.interfaces.cable.motion import Grip, PluggedIn, View, Viewpoint
from regrasp.interfaces.cable.sight import Estimate, InHand, NoEstimate, NotSeen, Sightings, TrackHealth, TrackState
from regrasp.interfaces.cause import Cause, CauseCode
from regrasp.interfaces.cell import Box, FixedMount
from regrasp.interfaces.devices import TICK
from regrasp.interfaces.evidence import Evidence
from regrasp.interfaces.frame import RgbdFrame
from regrasp.interfaces.outline import Outline
from regrasp.interfaces.reading import GripperReading
from regrasp.interfaces.request import Request
from regrasp.interfaces.services import Obstacles
from regrasp.motion.cable.viewing import ViewingParameters, approached, views_of
from regrasp.motion.cable.viewpoints import spiral
from regrasp.motion.execution import Execution
from regrasp.motion.failure import PlanningError
from regrasp.motion.grasping.gap_test import GripWatch
from regrasp.perception.cable.in_hand import connector_axis, connector_in_hand
from regrasp.perception.cable.watching import FrameRule, watched
from regrasp.perception.pose.estimate import pose_covariance
from regrasp.perception.pose.fusion import fuse
from regrasp.perception.tracking.slip import distance_slip, seen_at
from regrasp.perception.tracking.stillness import Stillness
from regrasp.perception.tracking.track import ConnectorTrack

VIEWING = ViewingParameters()
LEFT = np.array([0.0, 1.0, 0.0])
Seen = Estimate | NoEstimate | None
Vector = NDArray[np.float64]
PointCloud = Callable[[float], Vector | None]


@dataclass
class Clock:
    t: float = 0.0

    def now(self) -> float:
        return self.t


@dataclass
class Log:
    """Every event with its values."""

    lines: list[tuple[str, dict[str, Any]]] = field(default_factory=list)

    def info(self, event: str, **values: Any) -> None:
        self.lines.append((event, values))

    warning = info

    def of(self, event: str) -> list[dict[str, Any]]:
        return [values for name, values in self.lines if name == event]


@dataclass
class FakeGripper:
    clock: Clock
    gap: float = 0.02
    told: list[tuple[str, float]] = field(default_factory=list)

    def open(self, gap: float) -> None:
        self.told.append(("open", gap))

    def close(self, force: float) -> None:
        self.told.append(("close", force))

    def reading(self) -> GripperReading:
        return GripperReading(self.clock.t, self.gap)


class FakeMotion:
    """A motion takes `seconds`, after which its `error` is raised if there is one."""

    insertions = 5
    hand = ""

    def __init__(self, clock: Clock, known: CableKnown) -> None:
        self.clock, self.known = clock, known
        self.seconds = 0.2
        self.error: Exception | None = None
        self.hand = known.cable.hand
        self.hands: list[str] = [known.cable.hand]  # that can take the connector
        self.tool_pose = RigidTransform.from_translation([0.3, 0.0, 0.4])
        self.grippers = {arm.name: FakeGripper(clock) for arm in known.arms}
        self.execution = Execution({}, self.grippers, {}, {}, clock, 0.0)  # for its jaws
        self.moves: list[tuple[str, Vector]] = []
        self.shifts: list[tuple[str, Vector]] = []
        self.cancelled: list[str] = []
        self.plugged: list[tuple[str, RigidTransform]] = []  # sockets, and how the hand held the connector
        self.inserted: list[tuple[int, RigidTransform]] = []  # which try, and how the hand held the connector
        self.clip_stiffness: Callable[[int], float] = lambda insertion: 1600.0  # N/m, after so many insertions
        self.forced: list[bool] = []  # for each carry, whether the cable might be bent by force
        self.pulled: list[str] = []  # arms that hold the cable
        self.brought = 0  # how often the cable was brought elsewhere
        self.stopped = 0
        self.rest: list[RigidTransform] = []
        self.reachable: Callable[[RigidTransform], bool] = lambda pose: True

    def take_with(self, arm: str) -> None:
        self.hand = arm

    def hands_for(self, world_from_connector: RigidTransform, without: Collection[str] = ()) -> Request[list[str]]:
        def steps() -> Generator[None, None, list[str]]:
            yield from self._steps()
            return [arm for arm in self.hands if arm not in without]

        return Request(steps())

    def work(self, arm: str) -> Request[None]:
        """Any motion of an arm."""
        return Request(self._steps(), lambda: self.cancelled.append(arm))

    def move(self, arm: str, goals: Vector, *, margin: float | None = None, tight: bool = True) -> Request[None]:
        self.moves.append((arm, goals))
        return self.work(arm)

    def sleep(self, arm: str, *, pulling: bool = False) -> Request[None]:
        return self.move(arm, np.array([self.known.arm(arm).sleep]))

    def shift(
        self,
        arm: str,
        displacement: Sequence[float] | Vector,
        *,
        checked: bool = True,
        without: Collection[Box] = (),
    ) -> Request[None]:
        self.shifts.append((arm, np.asarray(displacement)))
        return self.work(arm)

    def straight(
        self, arm: str, goal: RigidTransform, *, speed: float | None = None, pressing: bool = False
    ) -> Request[None]:
        return self.work(arm)

    def close(self, arm: str, thickness: float) -> Request[float]:
        return Request(self.execution.close_jaw(arm, thickness))

    def open_jaw(self, arm: str) -> None:
        self.grippers[arm].open(0.05)

    def release(self, arm: str, gap: float) -> Request[None]:
        self.grippers[arm].open(0.05)
        return self.work(arm)

    def stop(self) -> None:
        self.stopped += 1

    def joints(self, arm: str) -> Vector:
        return np.zeros(6)

    def tool(self, arm: str) -> RigidTransform:
        return self.tool_pose

    def set_obstacles(
        self, points: Vector, spacing: float, unseen: Vector | None = None, shadow: Vector | None = None
    ) -> None:
        pass

    def keep_clear(self, points: Vector) -> None:
        pass

    def pick_plug(self, plug: RigidTransform, *, point_cloud: PointCloud | None = None) -> Request[None]:
        return self.work(self.hand)

    def pick_loose(
        self, world_from_connector: RigidTransform, *, point_cloud: PointCloud | None = None
    ) -> Request[None]:
        return self.work(self.hand)

    def can_pick_loose(self, world_from_connector: RigidTransform) -> bool:
        return True

    def grip(self, world_from_connector: RigidTransform) -> Request[Grip]:
        def steps() -> Generator[None, None, Grip]:
            closing = self.close(self.hand, 2 * self.known.cable.connector.radius)
            while not closing.poll():
                yield
            return Grip(closing.answer, self.tool_pose.inv() * world_from_connector)

        return Request(steps())

    def pull_cable(self, world_from_connector: RigidTransform) -> Request[str]:
        def steps() -> Generator[None, None, str]:
            yield from self._steps()
            self.pulled.append(arm := "left")
            return arm

        return Request(steps())

    def bring_cable(self, arm: str, world_from_connector: RigidTransform | None) -> Request[None]:
        self.brought += 1
        return Request(self._steps())

    def let_go_of_cable(self, arm: str) -> Request[None]:
        self.pulled.remove(arm)
        return self.release(arm, 0.025)

    def watch_grip(self) -> GripWatch:
        return GripWatch(self.grippers[self.hand], 2 * self.known.cable.connector.radius)

    def pull_out(self, plug: RigidTransform) -> Request[None]:
        return self.work(self.hand)

    def carry_to_clip(self, held: RigidTransform, *, forced: bool = True) -> Request[None]:
        self.forced.append(forced)
        return self.work(self.hand)

    def insert(self, held: RigidTransform, attempt: int = 0) -> Request[None]:
        self.inserted.append((attempt, held))
        return self.work(self.hand)

    def pull_at_clip(self, held: RigidTransform) -> Request[Evidence]:
        def steps() -> Generator[None, None, Evidence]:
            yield from self._steps()
            stiffness = self.clip_stiffness(len(self.inserted))
            return Evidence(stiffness > 600.0, "pull", stiffness, 600.0, f"it rose by {stiffness:.0f} N/m")

        return Request(steps(), lambda: self.cancelled.append(self.known.cable.hand))

    def let_go(self) -> Request[None]:
        return self.release(self.hand, 0.025)

    def draw_back(self) -> Request[str]:
        back = self.shift(self.hand, [-0.1, 0.0, 0.0])

        def steps() -> Generator[None, None, str]:
            try:
                while not back.poll():
                    yield
            except PlanningError as error:
                return str(error)
            return ""

        return Request(steps(), back.cancel)

    def leave_clip(self) -> Request[None]:
        return self.sleep(self.hand)

    def check_socket(self, name: str) -> None:
        if self.error:
            raise self.error

    def carry_to_socket(self, held: RigidTransform, name: str) -> Request[None]:
        return self.work(self.hand)

    def plug_in(self, held: RigidTransform, name: str) -> Request[PluggedIn]:
        def steps() -> Generator[None, None, PluggedIn]:
            self.plugged.append((name, held))
            yield from self._steps()
            return PluggedIn(2, np.array([0.0025, 0.00433]), 9.8765)

        return Request(steps(), lambda: self.cancelled.append(self.hand))

    def leave_socket(self, name: str) -> Request[None]:
        return self.sleep(self.hand)

    def search_views(self, last_seen: Vector | None) -> tuple[Vector, Iterator[Viewpoint]]:
        panel = next(box for box in self.known.boxes if box.name == "back_panel")
        start, overview = np.array(panel.center) if last_seen is None else last_seen, self.known.camera("rear")
        assert isinstance(overview.mount, FixedMount)
        return start, spiral(start, overview.mount.world_from_camera, overview.intrinsics, VIEWING.spiral)

    def rest_views(self) -> list[RigidTransform]:
        return self.rest

    def view(self, world_from_camera: RigidTransform) -> View:
        return self._first_view([world_from_camera])

    def view_of(self, place: Vector, world_from_camera: RigidTransform) -> View:
        return self._first_view(views_of(place, world_from_camera, VIEWING.spiral.distance))

    def best_view(
        self, world_from_connector: RigidTransform, taken: Sequence[Vector] = (), past: str | None = None
    ) -> View:
        return self._first_view([world_from_connector])

    def go_to_view(self, view: View) -> Request[None]:
        return self.move(self.known.search_mount.arm, view.joints)

    def _first_view(self, views: Sequence[RigidTransform]) -> View:
        """Not real joints: the camera's place and zeros, so that a test sees where the eye goes."""
        for pose in approached(views, VIEWING.approaches):
            if self.reachable(pose):
                return View(pose, np.append(pose.translation, np.zeros(3))[None])
        raise PlanningError(CauseCode.OUT_OF_REACH, "no free place to look from")

    def _steps(self) -> Iterator[None]:
        end = self.clock.t + self.seconds
        while self.clock.t < end - 1e-9:
            yield
        if self.error:
            raise self.error


@dataclass
class FakeStillness:
    """Whether frames from its beginning on stand still."""

    frame: Callable[[], RgbdFrame | None]
    since: float
    stillness: Stillness = field(default_factory=Stillness)

    def still(self) -> bool | None:
        frame = self.frame()
        return None if frame is None or frame.stamp < self.since else self.stillness.feed(frame)


class FakePerception:
    """`shows` says what a camera sees at a second; a result is new fifteen times a second."""

    fixed_cameras: tuple[str, ...] = ("rear",)

    def __init__(self, clock: Clock, known: CableKnown) -> None:
        self.clock, self.known = clock, known
        self.shows: Callable[[str, float], Seen] = lambda camera, stamp: None
        self.frames: Callable[[float], RgbdFrame | None] = lambda stamp: None
        self.track = ConnectorTrack()
        self.axis: Vector | None = None
        self.looks: list[float] = []
        self.troubles: dict[str, str] = {}

    @property
    def last(self) -> Estimate | None:
        return self.track.last

    def frame(self, camera: str) -> RgbdFrame | None:
        return self.frames(np.floor(self.clock.t * 15 + 1e-6) / 15)

    def outlines(self, camera: str) -> list[Outline]:
        return []

    def trouble(self, camera: str) -> str | None:
        return self.troubles.get(camera)

    def surface(self, camera: str, since: float) -> Vector | None:
        return np.empty((0, 3))

    def look_around(self) -> int:
        self.look("rear")
        return 0

    def map_obstacles(self, camera: str) -> int:
        return 0

    def map_new_obstacle(self, camera: str) -> int:
        return 0

    def obstacles(self) -> Obstacles:
        return Obstacles(np.empty((0, 3)), 0.01, np.empty((0, 3)), np.empty((0, 3)))

    def watch_stillness(self, camera: str) -> FakeStillness:
        return FakeStillness(lambda: self.frame(camera), self.clock.t)

    def look(self, camera: str) -> Seen:
        self.looks.append(self.clock.t)
        result = self.shows(camera, np.floor(self.clock.t * 15 + 1e-6) / 15)
        if result is not None:
            self.track.feed(result)
        return result

    def watch(
        self,
        camera: str,
        seconds: float,
        *,
        settle: float = 0.0,
        later: bool = False,
        on_mapped: Callable[[], None] | None = None,
    ) -> Request[Sightings]:
        return watched(self, self.clock, camera, FrameRule(self.clock.t, seconds, settle, later), on_mapped)

    def fuse(self, estimates: Sequence[Estimate]) -> Estimate:
        return fuse(estimates)

    def expect_in_hand(self, tool: RigidTransform | None, held: RigidTransform | None = None) -> None:
        self.track.set_holding_tool(None if tool is None else tool.translation)
        self.axis = None if tool is None or held is None else connector_axis(tool * held)

    def use(self, technique: str) -> None:
        """One technique is like the other."""

    def check(self) -> TrackHealth:
        return self.track.check(self.clock.t)

    def state(self) -> tuple[TrackState, str]:
        return self.track.state(self.clock.t)

    def slipped(self, tool: RigidTransform) -> Evidence | None:
        if self.track.last is None or self.state()[0] is not TrackState.VISIBLE:
            return None
        return distance_slip(tool.translation, self.track.last.position)

    def stowed(self, estimate: Estimate) -> Evidence:
        return seen_at(estimate.position, np.array(self.known.cable.clip.seat), 0.04)

    def plugged(self, estimate: Estimate, socket: str) -> Evidence:
        plug = self.known.cable.socket(socket).world_from_plug(self.known.cable.connector.length)
        return seen_at(estimate.position, plug.translation, 0.04)

    def in_hand(
        self, seen: Sequence[Estimate], tool: RigidTransform, held: RigidTransform, *, least_turn_deg: float = 0.0
    ) -> InHand | None:
        return connector_in_hand(seen, self.known.cable.connector.length, tool, held, least_turn_deg)

    def obstacles_beside(self, world_from_connector: RigidTransform) -> Obstacles:
        return self.obstacles()


class Belief:
    """What the keys of the cable's leaves hold, to read and to write from outside."""

    @property
    def held(self) -> RigidTransform | None:
        return keys.value_of(HELD, None)

    @held.setter
    def held(self, pose: RigidTransform | None) -> None:
        _put(HELD, pose)

    @property
    def found(self) -> Found | None:
        return keys.value_of(FOUND, None)

    @found.setter
    def found(self, found: Found | None) -> None:
        _put(FOUND, found)

    @property
    def notices(self) -> tuple[LossNotice, ...]:
        return keys.value_of(NOTICES)

    @notices.setter
    def notices(self, notices: tuple[LossNotice, ...]) -> None:
        _put(NOTICES, notices)


def _put(key: keys.Key[Any], value: Any) -> None:
    """Let the key hold the value; None: nothing."""
    if value is None:
        py_trees.blackboard.Blackboard.storage.pop(key.path, None)
    else:
        keys.put(key, value)


@dataclass
class Stage:
    """The fakes of one test on an empty blackboard, and the services made of them."""

    known: CableKnown
    folder: Path
    clock: Clock = field(default_factory=Clock)
    log: Log = field(default_factory=Log)

    belief: Belief = field(default_factory=Belief)

    def __post_init__(self) -> None:
        py_trees.blackboard.Blackboard.clear()
        self.motion = FakeMotion(self.clock, self.known)
        self.perception = FakePerception(self.clock, self.known)
        self.services = CableServices(self.known, self.clock, self.motion, self.perception, self.log)

    @property
    def causes(self) -> tuple[Cause, ...]:
        """The causes so far."""
        return keys.causes()

    def tree(self, body: str) -> py_trees.trees.BehaviourTree:
        """The tree of this XML element, set up; unchecked: a test may write the keys that a leaf needs."""
        path = self.folder / "tree.xml"
        path.write_text(f'<root main_tree_to_execute="M"><BehaviorTree ID="M">{body}</BehaviorTree></root>')
        tree = py_trees.trees.BehaviourTree(parse_behaviour_tree_xml(str(path), node_registry=dict(LEAVES)))
        tree.setup(services=self.services)
        return tree

    def run(self, tree: py_trees.trees.BehaviourTree, seconds: float) -> Status:
        """Tick until the tree ends, at most so long."""
        end = self.clock.t + seconds
        tree.tick()
        while tree.root.status is Status.RUNNING and self.clock.t < end - 1e-9:
            self.clock.t += TICK
            tree.tick()
        return cast(Status, tree.root.status)


def seen(stamp: float, position: Vector, camera: str = "rear", whole: bool = True) -> Estimate:
    """An estimate with a little of the noise that shows that a camera lives."""
    place = position + 1e-4 * np.sin(50.0 * stamp) * np.ones(3)
    pose = RigidTransform.from_translation(place)
    return Estimate(
        stamp, camera, place, LEFT, pose, pose_covariance(LEFT, 0.002, 0.02), 500, 600, 0.09 if whole else 0.04, whole
    )


def unseen(stamp: float, camera: str = "rear") -> NoEstimate:
    return NoEstimate(stamp, camera, NotSeen.NO_COLOR, "no pixel has the connector's colour")
