"""What the leaves ask of the arms: plan, wait for the plan's latency, follow, stop.

A request returns a `Task` at once; `poll` it every tick. Nothing here reads a wall clock: a plan costs its stated
latency on the simulated clock.
"""

from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from functools import partial
from itertools import chain, product

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform, Rotation, Slerp

from regrasp.interfaces.cause import CauseCode
from regrasp.interfaces.cell import KnownCell
from regrasp.interfaces.devices import Arm, Clock, Gripper
from regrasp.interfaces.trajectory import Trajectory
from regrasp.motion.failure import PlanningError
from regrasp.motion.grasping.grasps import choose_grasp, grasp_candidates
from regrasp.motion.planning.cable_path import natural_ways
from regrasp.motion.planning.planner import plan
from regrasp.motion.planning.straight import straight_line
from regrasp.motion.robots.arm_offsets import joint_offsets
from regrasp.motion.robots.arm_watch import ArmWatch, rest_of
from regrasp.motion.robots.kinematics import ArmKinematics
from regrasp.motion.robots.spheres import JAW_OPENING
from regrasp.motion.scene.bodies import NO_POINTS, Bodies
from regrasp.motion.scene.collision import CollisionModel
from regrasp.motion.task import Task

FloatArray = NDArray[np.float64]
# Points (n, 3) m of what a camera saw from that second on; None while there is no such picture.
Seen = Callable[[float], FloatArray | None]

MARGIN = 0.015  # m between the arm's spheres and anything while it moves freely
JAW_REACH = 0.13  # m round a connector's centre where the jaw may be: half its length, a finger's width, 5 cm of palm
TIGHT_MARGIN = 0.005  # m where nothing is found with `MARGIN`
WAYS = 12  # ways to grasp that the planner may choose from
NEAR_MARGINS = (0.020, 0.014, 0.008, 0.004, 0.0)  # m on straight centimetres near things: the first that leaves a way
LIFTS = (0.0, 0.04, 0.08)  # m by which the middle of a straight way may pass above it: obstacles stand on the floor
APPROACH_SPEED = 0.3  # share of the joints' speed on straight ways near things
OPEN_GAP = 0.05  # m between the pads: 15 mm to each side of the connector, about 8 mm is how far off a pose may be
GRIP_OFFSETS = (-0.02, -0.03, 0.0)  # m along the connector from its centre, tried in turn: near the cable the tip shows
ARRIVED = 0.05  # rad: an arm that ends further from its goal was blocked
SETTLE = 0.10  # s after a trajectory before its end is judged
ARRIVAL = 1.0  # s that a late arm has to come there
FOLLOWS = 3  # times that an arm which does not follow is stopped and led on, each time at half the speed
REST = 1.0  # s between them: what jams may come free
JAW_COMMANDS, JAW_SECONDS = 3, 1.0  # a jaw that does not follow is told again, after so many seconds
LOOK = 1.0  # s that a camera has to show the arm; a sound one needs 0.2
JAW_SLACK = 0.005  # m short of its gap that a jaw counts as open


class Motion(Bodies):
    """Requests to the two arms. `seed` makes the planner's draws repeatable."""

    def __init__(
        self, known: KnownCell, arms: Mapping[str, Arm], grippers: Mapping[str, Gripper], clock: Clock, seed: int
    ) -> None:
        super().__init__(known, arms, grippers)
        self._clock, self._seed = clock, seed
        self.planner = plan
        self.remark: Callable[[str], None] = lambda sentence: None  # told of an arm or a jaw that does not follow
        self._watches = {name: ArmWatch(name) for name in arms}
        self._pace = dict.fromkeys(arms, 1.0)  # share of the speed asked for; less for an arm that fell behind
        self._out_of_order: dict[str, PlanningError] = {}

    def move(self, arm: str, goals: FloatArray, *, margin: float = MARGIN, tight: bool = True) -> Task:
        """Plan a way to one of the goals (n, 6) rad, `margin` m from everything, and follow it.

        `tight`: with a smaller margin where nothing else is found.
        """

        def steps() -> Iterator[None]:
            path = self._plan(self.start_model(arm), self.joints(arm), goals, margin, tight)
            yield from self._follow(arm, path, 1.0)

        return self._task(arm, steps())

    def carry(
        self,
        arm: str,
        goals: Sequence[RigidTransform],
        held: RigidTransform,
        *,
        onward: Sequence[RigidTransform] = (),
        speed: float,
    ) -> Task:
        """Bring what `arm` holds (tool_from_connector) to one of the goals (world_from_tool), the first preferred.

        By way of the shapes that the cable takes by itself where that is free, else straight or in a flat arch, else by
        any free way; if it can, with room for a jaw that opens on the way, as on a slip. From the goal the tool must
        also reach the poses `onward` (goal_from_tool) in straight lines.
        """

        def steps() -> Iterator[None]:
            model, q, kin = self.start_model(arm, held), self.joints(arm), self.kinematics[arm]
            tool, release = kin.tool(q), held.inv()
            start = tool * held
            leads_on = partial(_leads_on, kin, onward)
            natural = (path for goal in goals for path in self._natural_paths(kin, q, start, goal * held, release))
            direct = (_through(kin, q, _lifted(tool, goal, lift)) for goal in goals for lift in LIFTS)
            paths = [path for path in chain(natural, direct) if path is not None and leads_on(path[-1])]
            wide = self.model(arm, held=held, opening=JAW_OPENING)
            for jaw, margin in product((wide, model), NEAR_MARGINS):
                for path in paths:
                    if jaw.path_free(path[1:], margin):
                        yield from self._follow(arm, path, speed)
                        return
            configurations = np.array([end for goal in goals for end in kin.ik(goal) if leads_on(end)]).reshape(-1, 6)
            yield from self._follow(arm, self._plan(model, q, configurations), speed)

        return self._task(arm, steps())

    def _natural_paths(
        self, kin: ArmKinematics, q: FloatArray, start: RigidTransform, goal: RigidTransform, release: RigidTransform
    ) -> Iterator[FloatArray]:
        """Joint paths (k, 6) that bring the connector from start to goal by the cable's natural shapes."""
        for poses in natural_ways(self.known, start, goal):
            path = _through(kin, q, [pose * release for pose in poses])
            if path is not None:
                yield path

    def straight(self, arm: str, goal: RigidTransform, *, speed: float = APPROACH_SPEED) -> Task:
        """Move the tool in a straight line to `goal` (world_from_tool), near things as it may be; unchecked."""

        def steps() -> Iterator[None]:
            yield from self._follow(arm, straight_line(self.kinematics[arm], self.joints(arm), goal), speed)

        return self._task(arm, steps())

    def shift(self, arm: str, way: Sequence[float] | FloatArray, *, checked: bool = True) -> Task:
        """Move the tool straight by `way` (3,) m in the world, without turning.

        `checked`: only if nothing but the clip is met; not so where the way begins in a socket's box.
        """

        def steps() -> Iterator[None]:
            kin, q = self.kinematics[arm], self.joints(arm)
            tool = kin.tool(q)
            goal = RigidTransform.from_components(tool.translation + way, tool.rotation)
            path = straight_line(kin, q, goal)
            model = self.start_model(arm, clip=False)
            if checked and not model.path_free(path[1:], NEAR_MARGINS[0]):
                distance, what = min(model.nearest(q) for q in path[1:])
                message = (
                    f"{float(np.linalg.norm(way)):.2f} m straight on the arm is {-1e3 * distance:.0f} mm in {what}"
                )
                raise PlanningError(CauseCode.MOTION_BLOCKED, message)
            yield from self._follow(arm, path, APPROACH_SPEED)

        return self._task(arm, steps())

    def pick(
        self,
        arm: str,
        world_from_connector: RigidTransform,
        *,
        shallow: float = 0.0,
        cable: FloatArray | None = None,
        seen: Seen | None = None,
    ) -> Task:
        """Open the jaw, bring it around the connector near its cable side; the jaw stays open.

        `shallow` metres is by how much the connector lies nearer to the finger tips than the pads' middle. The arm
        keeps clear of the `cable`'s points (n, 3) m, except where the jaw takes hold: pushing the cable moves the
        connector. Before the last straight way it is set right by what a camera has `seen` of it.
        """

        def steps() -> Iterator[None]:
            q = self.joints(arm)
            self.keep_clear(_clear_of(cable, world_from_connector.translation, JAW_REACH))
            model = self.start_model(arm, opening=OPEN_GAP)
            ways = self._ways_to_grasp(arm, model, world_from_connector, shallow)
            self.grippers[arm].open(OPEN_GAP)
            path = self._plan(model, q, np.array([way[0] for way in ways]))
            way = min(ways, key=lambda way: float(np.abs(way[0] - path[-1]).max()))
            yield from self._follow(arm, path, 1.0)
            yield from self._open_jaw(arm, OPEN_GAP - JAW_SLACK)
            offsets = yield from self._offsets(arm, seen)
            way = way - offsets if offsets.any() else way[1:]  # by way of where it should stand now
            yield from self._follow(arm, np.vstack([self.joints(arm), way]), APPROACH_SPEED)
            self.keep_clear(NO_POINTS)

        return self._task(arm, steps())

    def release(self, arm: str) -> Task:
        """Open the jaw; done once it stands wider than a connector."""
        return self._task(arm, self._open_jaw(arm, 2 * self.known.connector.radius + JAW_SLACK))

    def stop(self) -> None:
        """Stop both arms."""
        for arm in self.arms:
            self._halt(arm)

    def give_up(self, arm: str, code: CauseCode, message: str) -> PlanningError:
        """Call an arm or its jaw out of order: every request to it fails with this cause from now on. The error."""
        self.remark(f"{message}: out of order")
        self._out_of_order[arm] = PlanningError(code, message)
        return self._out_of_order[arm]

    def _follow(self, arm: str, path: FloatArray, speed: float) -> Iterator[None]:
        from regrasp.motion.planning.timing import (
            time_path,  # late: it brings matplotlib, which a tree's check does not need
        )

        alone = self._watches[arm].moved_alone(self.arms[arm].reading())
        if alone is not None:
            raise self.give_up(arm, CauseCode.ARM_FAILED, alone)
        for _ in range(FOLLOWS):
            trajectory = time_path(path, speed * self._pace[arm])
            yield from self._pause(self.known.latencies.plan)
            behind, elapsed = yield from self._led(arm, trajectory)
            if behind is None:
                break
            self._halt(arm)
            self.remark(behind)
            self._pace[arm] *= 0.5
            path = rest_of(path, trajectory.sample(elapsed)[0])
            yield from self._pause(REST)
            path = np.vstack([self.joints(arm), path])
        else:
            raise self.give_up(arm, CauseCode.ARM_FAILED, f"{behind}, {FOLLOWS} times")
        yield from self._arrive(arm, path[-1])
        self._watches[arm].leave(self.joints(arm))

    def _led(self, arm: str, trajectory: Trajectory) -> Generator[None, None, tuple[str | None, float]]:
        """Let the arm follow; why it was found off the trajectory, if it was, and after how many seconds."""
        watch, start = self._watches[arm], self._clock.now()
        watch.begin()
        watch.leave(None)
        self.arms[arm].follow(trajectory)
        while self.arms[arm].is_moving():
            yield
            reading, elapsed = self.arms[arm].reading(), self._clock.now() - start
            jumped = watch.jumped(reading)
            if jumped is not None:
                self._halt(arm)
                raise self.give_up(arm, CauseCode.ARM_FAILED, jumped)
            behind = watch.behind(reading, trajectory, elapsed)
            if behind is not None:
                return behind, elapsed
        return None, trajectory.duration

    def _arrive(self, arm: str, goal: FloatArray) -> Iterator[None]:
        """Wait until the arm rests at `goal` (6,) rad. Raises PlanningError when it does not come there."""
        yield from self._pause(SETTLE)
        late = self._clock.now() + ARRIVAL
        while np.max(np.abs(self.joints(arm) - goal)) > ARRIVED and self._clock.now() < late - 1e-9:
            yield
        short = float(np.max(np.abs(self.joints(arm) - goal)))
        if short > ARRIVED:
            message = f"the {arm} arm stopped {short:.2f} rad short of its goal, more than {ARRIVED:.2f}"
            raise PlanningError(CauseCode.MOTION_BLOCKED, message)

    def _open_jaw(self, arm: str, gap: float) -> Iterator[None]:
        """Open the jaw; done once the fingers read `gap` m. Told again when they do not, then given up."""
        gripper = self.grippers[arm]
        for _ in range(JAW_COMMANDS):
            gripper.open(OPEN_GAP)
            end = self._clock.now() + JAW_SECONDS
            while self._clock.now() < end - 1e-9:
                if gripper.reading().gap >= gap:
                    return
                yield
        message = f"the {arm} jaw stands {1e3 * gripper.reading().gap:.1f} mm open, told {JAW_COMMANDS} times to open"
        raise self.give_up(arm, CauseCode.GRIPPER_FAILED, f"{message} to {1e3 * OPEN_GAP:.0f} mm")

    def _offsets(self, arm: str, seen: Seen | None) -> Generator[None, None, FloatArray]:
        """The encoders' offsets (6,) rad of an arm at rest, by a picture taken from now on; 0 if none comes."""
        start = self._clock.now()
        while seen is not None and self._clock.now() < start + LOOK:
            points = seen(start)
            if points is not None:
                return joint_offsets(self.kinematics[arm], self.joints(arm), self.grippers[arm].reading().gap, points)
            yield
        return np.zeros(6)

    def _pause(self, seconds: float) -> Iterator[None]:
        end = self._clock.now() + seconds
        while self._clock.now() < end - 1e-9:
            yield

    def _ways_to_grasp(
        self, arm: str, model: CollisionModel, world_from_connector: RigidTransform, shallow: float
    ) -> list[FloatArray]:
        """Ways in (k, 6) from standoff to grasp of the cheapest candidates that work, at most `WAYS`."""
        kin, q = self.kinematics[arm], self.joints(arm)
        near = self.model(arm, clip=False, opening=OPEN_GAP)
        connector = self.known.connector
        left = [
            grasp
            for offset in GRIP_OFFSETS
            for grasp in grasp_candidates(
                world_from_connector, connector.length, connector.radius, offset, shallow=shallow
            )
        ]
        ways: list[FloatArray] = []
        for near_margin in NEAR_MARGINS:
            rest = left
            while rest and len(ways) < WAYS:
                try:
                    choice = choose_grasp(kin, model, q, rest, margin=MARGIN, near=near, near_margin=near_margin)
                except PlanningError:
                    if not ways and near_margin == NEAR_MARGINS[-1]:
                        raise
                    break
                ways += choice.paths
                rest = rest[rest.index(choice.grasp) + 1 :]
            if ways:
                break
        return ways

    def _plan(
        self,
        model: CollisionModel,
        start: FloatArray,
        goals: FloatArray,
        margin: float = MARGIN,
        tight: bool = True,
    ) -> FloatArray:
        """A path (k, 6) with the full margin, else, if `tight`, with a smaller one."""
        try:
            return self.planner(model, start, goals, self._next_seed(), margin=margin)
        except PlanningError as error:
            if not tight or error.code is CauseCode.OUT_OF_REACH:
                raise
            return self.planner(model, start, goals, self._next_seed(), margin=TIGHT_MARGIN)

    def _task(self, arm: str, steps: Iterator[None]) -> Task:
        def fit() -> Iterator[None]:
            if arm in self._out_of_order:
                raise self._out_of_order[arm]
            yield from steps

        return Task(fit(), lambda: self._halt(arm))

    def _halt(self, arm: str) -> None:
        self.arms[arm].stop()
        self._watches[arm].leave(None)

    def _next_seed(self) -> int:
        self._seed += 1
        return self._seed


def _leads_on(kin: ArmKinematics, onward: Sequence[RigidTransform], q: FloatArray) -> bool:
    """Whether the tool at joints (6,) can go on in straight lines to the poses `onward`, in its own frame."""
    tool = kin.tool(q)
    return _through(kin, q, [tool * then for then in onward]) is not None


def _clear_of(points: FloatArray | None, place: FloatArray, radius: float) -> FloatArray:
    """The points (n, 3) further than `radius` m from a place (3,)."""
    if points is None:
        return NO_POINTS
    return points[np.linalg.norm(points - place, axis=1) > radius]


def _lifted(start: RigidTransform, goal: RigidTransform, lift: float) -> list[RigidTransform]:
    """The way from start to goal, through the middle raised by `lift` m if there is any."""
    if not lift:
        return [goal]
    middle = 0.5 * (start.translation + goal.translation) + [0.0, 0.0, lift]
    turn = Slerp([0.0, 1.0], Rotation.concatenate([start.rotation, goal.rotation]))(0.5)
    return [RigidTransform.from_components(middle, turn), goal]


def _through(kin: ArmKinematics, q: FloatArray, poses: Sequence[RigidTransform]) -> FloatArray | None:
    """Joint path (k, 6) from `q` (6,) that leads the tool through the poses; None where it cannot follow."""
    path = q[None]
    try:
        for pose in poses:
            path = np.vstack([path, straight_line(kin, path[-1], pose, 0.02)[1:]])
    except PlanningError:
        return None
    return path
