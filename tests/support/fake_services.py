"""Services that do what a test tells them, on a clock that is turned by hand."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import py_trees
from numpy.typing import NDArray
from py_trees.common import Status
from scipy.spatial.transform import RigidTransform

from regrasp.behaviors import LEAVES, keys
from regrasp.behaviors.services import Belief, Services
from regrasp.interfaces.cable.cell import CableKnown
from regrasp.interfaces.cause import Cause
from regrasp.interfaces.frame import RgbdFrame
from regrasp.interfaces.reading import GripperReading
from regrasp.motion.failure import PlanningError
from regrasp.motion.service import MotionParameters
from regrasp.motion.task import MotionTask
from regrasp.perception.pose.estimate import Estimate, NoEstimate, pose_covariance
from regrasp.perception.pose.segmentation import NotSeen
from regrasp.perception.tracking.track import ConnectorTrack
from regrasp.trees import load_tree

TICK = 0.05
LEFT = np.array([0.0, 1.0, 0.0])
Seen = Estimate | NoEstimate | None
Vector = NDArray[np.float64]


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

    def __init__(self, clock: Clock) -> None:
        self.clock = clock
        self.parameters = MotionParameters()
        self.seconds = 0.2
        self.error: Exception | None = None
        self.hand = RigidTransform.from_translation([0.3, 0.0, 0.4])
        self.grippers = {"left": FakeGripper(clock), "right": FakeGripper(clock)}
        self.moves: list[tuple[str, Vector]] = []
        self.shifts: list[tuple[str, Vector]] = []
        self.cancelled: list[str] = []
        self.stopped = 0
        self.reachable: Callable[[RigidTransform], bool] = lambda pose: True
        view = SimpleNamespace(ik_view=self._views)
        self.kinematics = {"left": view, "right": view}

    def move(self, arm: str, goals: Vector, *, margin: float = 0.0, tight: bool = True) -> MotionTask:
        self.moves.append((arm, goals))
        return MotionTask(self._steps(), lambda: self.cancelled.append(arm))

    def shift(self, arm: str, way: Vector) -> MotionTask:
        self.shifts.append((arm, way))
        return MotionTask(self._steps(), lambda: self.cancelled.append(arm))

    def straight(self, arm: str, goal: RigidTransform, *, speed: float = 1.0) -> MotionTask:
        return MotionTask(self._steps(), lambda: self.cancelled.append(arm))

    def sees(self, world_from_camera: RigidTransform, points: Vector) -> bool:
        return True

    def release(self, arm: str) -> MotionTask:
        self.grippers[arm].open(0.05)
        return MotionTask(self._steps(), lambda: self.cancelled.append(arm))

    def give_up(self, arm: str, code: str, message: str) -> PlanningError:
        return PlanningError(code, message)

    def tool(self, arm: str) -> RigidTransform:
        return self.hand

    def model(self, arm: str) -> Any:
        return SimpleNamespace(free=lambda q, margin: True)

    def set_obstacles(self, points: Vector, spacing: float) -> None:
        pass

    def stop(self) -> None:
        self.stopped += 1

    def _views(self, pose: RigidTransform, mount: RigidTransform) -> Vector:
        """Not real joints: the camera's place and zeros, so that a test sees where the eye goes."""
        return np.append(pose.translation, np.zeros(3))[None] if self.reachable(pose) else np.empty((0, 6))

    def _steps(self) -> Iterator[None]:
        end = self.clock.t + self.seconds
        while self.clock.t < end - 1e-9:
            yield
        if self.error:
            raise self.error


class FakePerception:
    """`shows` says what a camera sees at a second; a result is new fifteen times a second."""

    def __init__(self, clock: Clock) -> None:
        self.clock = clock
        self.shows: Callable[[str, float], Seen] = lambda camera, stamp: None
        self.frames: Callable[[float], RgbdFrame | None] = lambda stamp: None
        self.track = ConnectorTrack()
        self.axis: Vector | None = None
        self.looks: list[float] = []
        self.troubles: dict[str, str] = {}
        self.occupancy = SimpleNamespace(occupied_points=lambda: np.empty((0, 3)), voxel_size=0.01)

    def expect_in_hand(self, position: Vector | None, axis: Vector | None) -> None:
        self.track.set_holding_tool(position)
        self.axis = axis

    def use(self, technique: str) -> None:
        """One technique is like the other."""

    def look(self, camera: str) -> Seen:
        self.looks.append(self.clock.t)
        result = self.shows(camera, np.floor(self.clock.t * 15 + 1e-6) / 15)
        if result is not None:
            self.track.feed(result)
        return result

    def frame(self, camera: str) -> RgbdFrame | None:
        return self.frames(np.floor(self.clock.t * 15 + 1e-6) / 15)

    def trouble(self, camera: str) -> str | None:
        return self.troubles.get(camera)

    def map_new_obstacle(self, camera: str) -> int:
        return 0

    def map_obstacles(self, camera: str) -> int:
        return 0


class Causes(Sequence[Cause]):
    """The causes so far, at any time."""

    def __getitem__(self, index: Any) -> Any:
        return keys.causes()[index]

    def __len__(self) -> int:
        return len(keys.causes())


@dataclass
class Stage:
    """The fakes of one test on an empty blackboard, and the services made of them."""

    known: CableKnown
    folder: Path
    clock: Clock = field(default_factory=Clock)
    log: Log = field(default_factory=Log)
    belief: Belief = field(default_factory=Belief)
    causes: Causes = field(default_factory=Causes)

    def __post_init__(self) -> None:
        py_trees.blackboard.Blackboard.clear()
        self.motion = FakeMotion(self.clock)
        self.perception = FakePerception(self.clock)
        self.services = Services(
            self.known, self.clock, cast(Any, self.motion), cast(Any, self.perception), self.log, self.belief
        )

    def tree(self, body: str) -> py_trees.trees.BehaviourTree:
        """The tree of this XML element, set up."""
        path = self.folder / "tree.xml"
        path.write_text(f'<root main_tree_to_execute="M"><BehaviorTree ID="M">{body}</BehaviorTree></root>')
        tree = py_trees.trees.BehaviourTree(load_tree(path, LEAVES))
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
