"""What the leaves ask of the arms: plan, wait for the plan's latency, follow, stop.

A request returns a `Task` at once; `poll` it every tick. Nothing here reads a wall clock: a plan costs its stated
latency on the simulated clock.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from itertools import chain

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform

from interfaces.cause import CauseCode
from interfaces.cell import Connector, KnownCell, WristMount
from interfaces.devices import Arm, Clock, Gripper
from interfaces.frame import RgbdFrame
from motion.cable_path import natural_ways
from motion.collision import CollisionModel
from motion.distance_grid import DistanceGrid
from motion.failure import PlanningError
from motion.grasps import choose_grasp, grasp_candidates
from motion.kinematics import ArmKinematics
from motion.planner import plan
from motion.straight import straight_line
from motion.timing import time_path

FloatArray = NDArray[np.float64]

MARGIN = 0.015  # m between the arm's spheres and anything while it moves freely
JAW_REACH = 0.13  # m round a connector's centre where the jaw may be: half its length, a finger's width, 5 cm of palm
NO_POINTS = np.empty((0, 3))
# m on the way of a held connector, which starts and ends near things; voxels are a margin themselves
TIGHT_MARGIN = 0.005  # m where nothing is found with that
WAYS = 12  # ways to grasp that the planner may choose from
# m on the last straight centimetres and on the way of a held connector, which start and end near things: the first that
# leaves a way. Voxels are a margin themselves.
NEAR_MARGINS = (0.008, 0.004, 0.0)
APPROACH_SPEED = 0.3  # share of the joints' speed on straight ways near things
OPEN_GAP = 0.05  # m between the pads: 15 mm to each side of the connector, about 8 mm is how far off a pose may be
GRIP_OFFSETS = (-0.02, -0.03, 0.0)  # m along the connector from its centre, tried in turn: near the cable the tip shows
ARRIVED = 0.05  # rad: an arm that ends further from its goal was blocked
GRID_BORDER = 0.2  # m around the voxels: no sphere of an arm is thicker
ARM_MARGIN = 0.025  # m round an arm where seen points are its own: 13 mm of depth, half a voxel's diagonal, 5 mm of arm
SETTLE = 0.10  # s after a trajectory before its end is judged


class Task:
    """Work of an arm under way, one step a `poll`."""

    def __init__(self, steps: Iterator[None], stop: Callable[[], None]) -> None:
        self._steps, self._stop = steps, stop

    def poll(self) -> bool:
        """Whether it is done. Raises PlanningError with the cause when it cannot be."""
        try:
            next(self._steps)
        except StopIteration:
            return True
        return False

    def cancel(self) -> None:
        """Stop the arm where it is."""
        self._steps = iter(())
        self._stop()


class Motion:
    """The two arms and what they must not touch. `seed` makes the planner's draws repeatable."""

    def __init__(
        self, known: KnownCell, arms: Mapping[str, Arm], grippers: Mapping[str, Gripper], clock: Clock, seed: int
    ) -> None:
        self.known, self.arms, self.grippers, self._clock = known, arms, grippers, clock
        self.kinematics: dict[str, ArmKinematics] = {
            spec.name: ArmKinematics(RigidTransform.from_translation(spec.base)) for spec in known.arms
        }
        self._cameras: dict[str, WristMount] = {
            c.mount.arm: c.mount for c in known.cameras if isinstance(c.mount, WristMount)
        }
        self._boxes = known.solids()
        self._grid: DistanceGrid | None = None
        self._points = self._cable = NO_POINTS
        self._spacing = 0.01
        self._seed = seed

    def set_obstacles(self, points: FloatArray, spacing: float) -> None:
        """Keep clear of occupied voxels from now on: centres (n, 3) m and edge m.

        Points where an arm is now, or sleeps, do not count: what was seen there was an arm.
        """
        self._points, self._spacing = points, spacing
        for spec in self.known.arms:
            for q in (self.joints(spec.name), np.array(spec.sleep)):
                self._points = _away_from(self._points, self.model(spec.name, others=False).spheres(q), ARM_MARGIN)
        self._rebuild_grid()

    def keep_clear(self, points: FloatArray) -> None:
        """Keep clear of these points (n, 3) m too, in place of an earlier call's: a cable, a stowed connector."""
        self._cable = points
        self._rebuild_grid()

    def _rebuild_grid(self) -> None:
        points = np.vstack([self._points, self._cable])
        if not len(points):
            self._grid = None
            return
        lower, upper = points.min(axis=0) - GRID_BORDER, points.max(axis=0) + GRID_BORDER
        self._grid = DistanceGrid.from_points(points, lower, upper, self._spacing)

    def _start_model(
        self, arm: str, held: RigidTransform | None = None, *, clip: bool = True, opening: float | None = None
    ) -> CollisionModel:
        """`model` for a motion that begins now: seen points that the arm touches where it stands were none.

        Voxels are coarse and cameras err by millimetres; a hand that came in beside an obstacle must get out again.
        """
        model = self.model(arm, held=held, clip=clip, opening=opening)
        distance, what = model.nearest(self.joints(arm))
        if what == "seen surface" and distance < TIGHT_MARGIN:
            spheres = model.spheres(self.joints(arm))
            self._points = _away_from(self._points, spheres, TIGHT_MARGIN + 2 * self._spacing)
            self._cable = _away_from(self._cable, spheres, TIGHT_MARGIN + 2 * self._spacing)
            self._rebuild_grid()
            model = self.model(arm, held=held, clip=clip, opening=opening)
        return model

    def joints(self, arm: str) -> FloatArray:
        """The arm's joints (6,) rad as read."""
        return self.arms[arm].reading().positions

    def tool(self, arm: str) -> RigidTransform:
        """world_from_tool as read."""
        return self.kinematics[arm].tool(self.joints(arm))

    def camera_pose(self, frame: RgbdFrame) -> RigidTransform:
        """world_from_camera of a frame as the robot believes it."""
        mount = self.known.camera(frame.camera).mount
        if isinstance(mount, WristMount):
            assert frame.joints is not None
            return self.kinematics[mount.arm].wrist(frame.joints) * mount.wrist_from_camera
        return mount.world_from_camera

    def spheres(self) -> list[tuple[FloatArray, FloatArray]]:
        """The arms' bodies now: centres (n, 3) m and radii (n,) m of each."""
        both = [self.model(name, others=False).spheres(self.joints(name)) for name in self.arms]
        return [(s[:, :3], s[:, 3]) for s in both]

    def model(
        self,
        arm: str,
        *,
        held: RigidTransform | None = None,
        others: bool = True,
        clip: bool = True,
        opening: float | None = None,
    ) -> CollisionModel:
        """What `arm` must not touch now.

        `held` is tool_from_connector while it carries the connector; without `clip` the clip's bracket may be touched.
        The jaw is as the fingers read, or `opening` m wide.
        """
        other = None
        if others:
            name = next(n for n in self.arms if n != arm)
            other = self.model(name, others=False).spheres(self.joints(name))
        boxes = self._boxes if clip else [b for b in self._boxes if b not in self.known.clip.bracket]
        camera = self._cameras.get(arm)
        return CollisionModel(
            self.kinematics[arm],
            boxes,
            camera_offset=camera.offset if camera else None,
            other_arm=other,
            grid=self._grid if others else None,
            carried=None if held is None else _connector_spheres(held, self.known.connector),
            opening=self.grippers[arm].reading().gap if opening is None else opening,
        )

    def move(self, arm: str, goals: FloatArray, *, margin: float = MARGIN, tight: bool = True) -> Task:
        """Plan a way to one of the goals (n, 6) rad, `margin` m from everything, and follow it.

        `tight`: with a smaller margin where nothing else is found.
        """

        def steps() -> Iterator[None]:
            path = self._plan(self._start_model(arm), self.joints(arm), goals, margin, tight)
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

        By way of the shapes that the cable takes by itself where that is free, else straight, else by any free way.
        From the goal the tool must also reach the poses `onward` (goal_from_tool) in straight lines.
        """

        def steps() -> Iterator[None]:
            model, q, kin = self._start_model(arm, held), self.joints(arm), self.kinematics[arm]
            start, release = kin.tool(q) * held, held.inv()
            leads_on = partial(_leads_on, kin, onward)
            natural = (path for goal in goals for path in self._natural_paths(kin, q, start, goal * held, release))
            direct = (_through(kin, q, [goal]) for goal in goals)
            paths = [path for path in chain(natural, direct) if path is not None and leads_on(path[-1])]
            for margin in NEAR_MARGINS:
                for path in paths:
                    if model.path_free(path[1:], margin):
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
            model = self._start_model(arm, clip=False)
            if checked and not model.path_free(path[1:], NEAR_MARGINS[0]):
                distance, what = min(model.nearest(q) for q in path[1:])
                message = (
                    f"{float(np.linalg.norm(way)):.2f} m straight on the arm is {-1e3 * distance:.0f} mm in {what}"
                )
                raise PlanningError(CauseCode.MOTION_BLOCKED, message)
            yield from self._follow(arm, path, APPROACH_SPEED)

        return self._task(arm, steps())

    def pick(
        self, arm: str, world_from_connector: RigidTransform, *, shallow: float = 0.0, cable: FloatArray | None = None
    ) -> Task:
        """Open the jaw, bring it around the connector near its cable side; the jaw stays open.

        `shallow` metres is by how much the connector lies nearer to the finger tips than the pads' middle. The arm
        keeps clear of the `cable`'s points (n, 3) m, except where the jaw takes hold: pushing the cable moves the
        connector.
        """

        def steps() -> Iterator[None]:
            q = self.joints(arm)
            self.keep_clear(_clear_of(cable, world_from_connector.translation, JAW_REACH))
            model = self._start_model(arm, opening=OPEN_GAP)
            ways = self._ways_to_grasp(arm, model, world_from_connector, shallow)
            self.grippers[arm].open(OPEN_GAP)
            path = self._plan(model, q, np.array([way[0] for way in ways]))
            way = min(ways, key=lambda way: float(np.abs(way[0] - path[-1]).max()))
            yield from self._follow(arm, path, 1.0)
            yield from self._follow(arm, np.vstack([self.joints(arm), way[1:]]), APPROACH_SPEED)
            self.keep_clear(NO_POINTS)

        return self._task(arm, steps())

    def sees(self, world_from_camera: RigidTransform, points: FloatArray) -> bool:
        """Whether nothing known or seen stands between a camera and any of the points (n, 3) m."""
        eye = world_from_camera.translation
        shares = np.linspace(0.15, 0.85, 24)[:, None, None]
        rays = (eye + shares * (points - eye)).reshape(-1, 3)
        for box in self._boxes:
            if np.any(np.all(np.abs(rays - box.center) < 0.5 * np.array(box.size), axis=1)):
                return False
        return self._grid is None or bool(np.min(self._grid.at(rays)) > 0.0)

    def stop(self) -> None:
        """Stop both arms."""
        for arm in self.arms.values():
            arm.stop()

    def _follow(self, arm: str, path: FloatArray, speed: float) -> Iterator[None]:
        trajectory = time_path(path, speed)
        start = self._clock.now() + self.known.latencies.plan
        while self._clock.now() < start - 1e-9:
            yield
        self.arms[arm].follow(trajectory)
        while self.arms[arm].is_moving():
            yield
        end = self._clock.now() + SETTLE
        while self._clock.now() < end - 1e-9:
            yield
        short = float(np.max(np.abs(self.joints(arm) - path[-1])))
        if short > ARRIVED:
            message = f"the {arm} arm stopped {short:.2f} rad short of its goal, more than {ARRIVED:.2f}"
            raise PlanningError(CauseCode.MOTION_BLOCKED, message)

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
            return plan(model, start, goals, self._next_seed(), margin=margin)
        except PlanningError as error:
            if not tight or error.code is CauseCode.OUT_OF_REACH:
                raise
            return plan(model, start, goals, self._next_seed(), margin=TIGHT_MARGIN)

    def _task(self, arm: str, steps: Iterator[None]) -> Task:
        return Task(steps, self.arms[arm].stop)

    def _next_seed(self) -> int:
        self._seed += 1
        return self._seed


def _connector_spheres(held: RigidTransform, connector: Connector) -> FloatArray:
    """Spheres (3, 4) that cover a carried connector, in the tool frame."""
    along = (0.5 * connector.length - connector.radius) * np.array([-1.0, 0.0, 1.0])
    centers = held.apply(np.column_stack([along, np.zeros(3), np.zeros(3)]))
    return np.column_stack([centers, np.full(3, 1.2 * connector.radius)])


def _leads_on(kin: ArmKinematics, onward: Sequence[RigidTransform], q: FloatArray) -> bool:
    """Whether the tool at joints (6,) can go on in straight lines to the poses `onward`, in its own frame."""
    tool = kin.tool(q)
    return _through(kin, q, [tool * then for then in onward]) is not None


def _clear_of(points: FloatArray | None, place: FloatArray, radius: float) -> FloatArray:
    """The points (n, 3) further than `radius` m from a place (3,)."""
    if points is None:
        return NO_POINTS
    return points[np.linalg.norm(points - place, axis=1) > radius]


def _through(kin: ArmKinematics, q: FloatArray, poses: Sequence[RigidTransform]) -> FloatArray | None:
    """Joint path (k, 6) from `q` (6,) that leads the tool through the poses; None where it cannot follow."""
    path = q[None]
    try:
        for pose in poses:
            path = np.vstack([path, straight_line(kin, path[-1], pose, 0.02)[1:]])
    except PlanningError:
        return None
    return path


def _away_from(points: FloatArray, spheres: FloatArray, margin: float) -> FloatArray:
    """The points (n, 3) further than `margin` m from the spheres (m, 4)."""
    distance = np.linalg.norm(points[:, None] - spheres[None, :, :3], axis=2)
    return points[np.all(distance > spheres[:, 3] + margin, axis=1)]
