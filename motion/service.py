"""What the leaves of every task ask of the arms: plan, wait for the plan's latency, follow, stop.

Each method returns a `MotionRequest` at once; `poll` it every tick. Nothing here reads a wall clock: a plan costs its
stated latency on the simulated clock. Arguments with numbers that are not finite, or of another shape than is said, are
refused with a ValueError at once; what an arm cannot do, with a PlanningError by `poll`.
"""

from collections.abc import Callable, Collection, Generator, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product
from typing import TypeVar

import numpy as np
from scipy.spatial.transform import RigidTransform

from regrasp.interfaces.arguments import finite_pose, not_negative, positive, rows, share, vector
from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cause import CauseCode
from regrasp.interfaces.cell import Box, KnownCell
from regrasp.interfaces.devices import Arm, Clock, Gripper
from regrasp.interfaces.quote import arm_words
from regrasp.interfaces.request import Request
from regrasp.motion.execution import Execution, ExecutionParameters
from regrasp.motion.failure import NO_WAY, PlanningError, StoppedShortError, TouchError
from regrasp.motion.grasping.approach import Cylinder, PickParameters, find_approaches, pick_candidates, points_beyond
from regrasp.motion.grasping.grasps import Grasp
from regrasp.motion.planning.planner import PlannerParameters, plan
from regrasp.motion.planning.separation import SeparationParameters, SpeedBySeparation
from regrasp.motion.planning.straight import can_continue, straight_line, straight_lines
from regrasp.motion.request import MotionRequest
from regrasp.motion.robots.arm_offsets import JointOffsetParameters, joint_offsets
from regrasp.motion.robots.contact_guard import ContactLimits
from regrasp.motion.robots.dynamics import ArmDynamics
from regrasp.motion.robots.poses import multiply
from regrasp.motion.scene.collision import Clearances, CollisionModel
from regrasp.motion.scene.distance_grid import NO_SURFACES
from regrasp.motion.scene.planning_scene import NO_POINTS, PlanningScene, PlanningSceneParameters

# Points (n, 3) m in the world that a camera saw from that second on; None while there is no such picture.
PointCloudSource = Callable[[float], FloatArray | None]

T = TypeVar("T")


@dataclass(frozen=True)
class MotionParameters:
    """The parameters of all parts of the motion service."""

    approach_speed: float = 0.3  # share of the joints' speed on straight paths near things; choice
    optimistic_speed: float = 0.3  # share of the joints' speed on a path that may touch something; choice
    pulling_speed: float = 0.5  # share at most of one that pulls an elastic thing, and feels little else; choice
    straight_margin: float = 0.020  # m that a checked straight way keeps from everything, if it began so far; choice
    limit_margin: float = 0.1  # rad from a joint's limits within which it goes a full turn back instead; choice
    arm_error: float = 0.005  # m that a tool may be off: the ViperX's accuracy by its maker
    touches: int = 6  # that end a motion; after each before it the arm goes on by another way; choice
    same_touch: float = 0.1  # rad or m; a touch at joints so near to those of another is of the same thing; choice
    camera_timeout: float = 1.0  # s that a camera has to show the arm; a sound one needs 0.2
    clearances: Clearances = field(default_factory=Clearances)
    execution: ExecutionParameters = field(default_factory=ExecutionParameters)
    pick: PickParameters = field(default_factory=PickParameters)
    planner: PlannerParameters = field(default_factory=PlannerParameters)
    separation: SeparationParameters = field(default_factory=SeparationParameters)
    joint_offsets: JointOffsetParameters = field(default_factory=JointOffsetParameters)
    scene: PlanningSceneParameters = field(default_factory=PlanningSceneParameters)


class Motion(PlanningScene):
    """Requests to the arms. `seed` makes the planner's draws repeatable; `on_anomaly`: see `Execution`."""

    def __init__(
        self,
        known: KnownCell,
        arms: Mapping[str, Arm],
        grippers: Mapping[str, Gripper],
        clock: Clock,
        seed: int,
        parameters: MotionParameters = MotionParameters(),
        on_anomaly: Callable[[str], None] = lambda sentence: None,
    ) -> None:
        super().__init__(known, arms, grippers, parameters.scene)
        self.parameters = parameters
        self.planner = plan
        chains = {name: kin.chain for name, kin in self.kinematics.items()}
        dynamics = {spec.name: ArmDynamics(spec.robot, spec.world_from_base) for spec in known.arms}
        self._dynamics = dynamics
        self.execution = Execution(
            arms, grippers, chains, dynamics, clock, known.latencies.plan, parameters.execution, on_anomaly
        )
        self._on_anomaly, self._guard = on_anomaly, parameters.execution.guard
        self._clock, self._seed = clock, seed
        self._ways_in: dict[str, FloatArray] = {}  # an arm's joints (k, n) on its last way in for a grasp

    def warm_up(self) -> None:
        """Load the compiled functions of collision checks and of the timing now, so that no tick waits for it."""
        for arm in self.arms:
            model, q = self.model(arm), self.joints(arm)
            model.free(q, 0.0)
            model.along(q[None], q[None], NO_SURFACES)

    def move(self, arm: str, goals: FloatArray, *, margin: float | None = None, tight: bool = True) -> MotionRequest:
        """Plan a path to one of the goals (k, n) and follow it, `margin` m from everything (default: as set).

        `tight`: with a smaller margin where nothing else is found.
        """
        goals = rows("the goals' joints", goals, len(self.kinematics[arm]))
        _check_margin(margin)
        return self.execution.request(arm, self._move_steps(arm, goals, margin, tight))

    def move_tool(
        self,
        arm: str,
        world_from_tool: RigidTransform,
        *,
        onward: Sequence[RigidTransform] = (),
        may_touch: Collection[Box] | None = None,
        margin: float | None = None,
    ) -> MotionRequest:
        """As `move`, to any joints that bring the tool to a pose. A rail stays where it is if that will do.

        From there the tool must also reach the poses `onward` (goal_from_tool) in straight lines. With `may_touch`,
        joints come first from which these lines keep `straight_margin` from everything but these boxes.
        """
        for pose in (world_from_tool, *onward):
            finite_pose("the tool's pose", pose)
        _check_margin(margin)

        def steps(optimistic: bool) -> Iterator[None]:
            kin, q = self.kinematics[arm], self.joints(arm)
            model = self.start_model(arm, optimistic=optimistic)

            def path_to(ends: FloatArray) -> FloatArray:
                ends = kin.turned_off_limits(ends, self.parameters.limit_margin)
                goals = [end for end in ends if can_continue(kin, end, onward)]
                if may_touch is not None:
                    near = self.model(arm, without=may_touch)
                    goals = [end for end in goals if self._free_onward(near, end, onward)] or goals
                try:
                    return self._plan(model, q, np.array(goals).reshape(-1, len(kin)), margin)
                except PlanningError:
                    if goals:
                        raise
                    raise self._unreachable(arm, world_from_tool.translation, len(ends)) from None

            try:
                path = path_to(kin.ik(world_from_tool, q))
            except PlanningError:
                if kin.robot.rail is None:
                    raise
                path = path_to(kin.ik(world_from_tool))
            yield from self._follow(arm, path, self._pace(optimistic), model)

        return self.execution.request(arm, self._tries(arm, steps))

    def sleep(self, arm: str, *, pulling: bool = False) -> MotionRequest:
        """Bring an arm to its sleep pose, out of the cameras' and the other arms' way.

        `pulling`: it may have caught on something elastic. Where it feels a touch each time, it goes on as if it had,
        slowly, and pulls that along; where it still feels one each time, it pulls as hard as at a plug in its socket.
        """
        goals = np.array([self.known.arm(arm).sleep])
        if not pulling:
            return self.move(arm, goals)

        def steps() -> Iterator[None]:
            try:
                yield from self._move_steps(arm, goals, contact=self._guard.leaving, touches=2)
            except (TouchError, StoppedShortError) as error:
                self._on_anomaly(f"{error}: something elastic may hold it")
                self.forget_felt()
                # What is felt from now on is that thing: no touch of it makes the arm more careful at the next.
                try:
                    yield from self._move_steps(arm, goals, contact=self._guard.pulling, felt=False)
                except TouchError as held:
                    self._on_anomaly(f"{held}: the arm pulls harder")
                    self.forget_felt()
                    yield from self._move_steps(arm, goals, contact=self._guard.drawing, felt=False)

        return self.execution.request(arm, steps())

    def straight(
        self, arm: str, goal: RigidTransform, *, speed: float | None = None, pressing: bool = False
    ) -> MotionRequest:
        """Move the tool in a straight line to `goal` (world_from_tool). Whether the way is free is not checked.

        `speed` in (0, 1] of the joints' limits; default: `approach_speed`. `pressing`: it shall touch something there.
        """
        finite_pose("the tool's pose", goal)
        of_limits = share("the speed", self.parameters.approach_speed if speed is None else speed)

        def steps() -> Iterator[None]:
            path = straight_line(self.kinematics[arm], self.joints(arm), goal)
            contact = self._guard.pressing if pressing else None
            yield from self._follow(arm, path, of_limits, self.model(arm), contact)

        return self.execution.request(arm, steps())

    def shift(
        self,
        arm: str,
        displacement: Sequence[float] | FloatArray,
        *,
        checked: bool = True,
        without: Collection[Box] = (),
    ) -> MotionRequest:
        """Move the tool straight by `displacement` (3,) m in the world, without turning it.

        `checked`: only if the arm meets nothing but the boxes `without`. A motion that begins in a box cannot be
        checked; there the arm may press or pull.
        """
        return self._shift(arm, displacement, checked, without)

    def pick(
        self,
        arm: str,
        world_from_cylinder: RigidTransform,
        cylinder: Cylinder,
        *,
        shallow: float = 0.0,
        clear_of: FloatArray | None = None,
        without: Collection[Box] = (),
        point_cloud: PointCloudSource | None = None,
    ) -> MotionRequest:
        """Open the jaw and bring it round a cylinder; the jaw stays open.

        The cylinder lies `shallow` metres nearer to the finger tips than the pads' middle. The arm keeps clear of the
        points `clear_of` (n, 3) m, except where the jaw takes hold: pushing a cable moves the connector. On the last
        straight way it may touch the boxes `without`. Before that it is corrected by the `point_cloud` that a camera
        sees of it.
        """
        widest = self.known.arm(arm).robot.gripper.opening

        def grasps() -> list[list[Grasp]]:
            return [pick_candidates(world_from_cylinder, cylinder, shallow, widest, self.parameters.pick)]

        return self._pick(arm, world_from_cylinder, grasps, clear_of, without, point_cloud)

    def close(self, arm: str, thickness: float) -> Request[float]:
        """Close the jaw on a thing of `thickness` m; the answer is the gap (m) between the pads that hold it.

        It fails with GraspEmptyError when the jaw closes on nothing, and with GRIPPER_FAILED when it does not move.
        When it is cancelled the jaw keeps its force.
        """
        positive("the thickness", thickness)
        return Request(self.execution.close_jaw(arm, thickness))

    def open_jaw(self, arm: str) -> None:
        """Tell the jaw to open, without waiting for it."""
        self.grippers[arm].open(self.parameters.execution.jaw.open_gap)

    def release(self, arm: str, gap: float) -> MotionRequest:
        """Open the jaw; done once it stands `gap` m open."""
        not_negative("the gap", gap)
        return self.execution.request(arm, self.execution.open_jaw(arm, gap))

    def stop(self) -> None:
        """Stop all arms."""
        for arm in self.arms:
            self.execution.halt(arm)

    def give_up(self, arm: str, code: str, message: str) -> PlanningError:
        """Disable an arm or its jaw: every later request to it fails with this cause. Returns the error to raise."""
        return self.execution.give_up(arm, code, message)

    def _together(self, arm: str, steps: Generator[None, None, T] | Iterator[None]) -> Request[T]:
        """Steps that do other requests to `arm`, as one. Each of those fails if the arm is out of order."""
        return Request(steps, lambda: self.execution.halt(arm))

    def _done(self, request: Request[T]) -> Generator[None, None, T]:
        """Steps that do a request and return its answer."""
        while not request.poll():
            yield
        return request.answer

    def _move_steps(
        self,
        arm: str,
        goals: FloatArray,
        margin: float | None = None,
        tight: bool = True,
        contact: ContactLimits | None = None,
        touches: int | None = None,
        felt: bool = True,
    ) -> Iterator[None]:
        """The steps of `move`.

        `contact` says what counts as a touch (default: of an arm that moves freely), `touches` how many end it, and
        `felt` whether a place that was felt counts as near, as a seen one does.
        """

        def steps(optimistic: bool) -> Iterator[None]:
            model = self.start_model(arm, optimistic=optimistic)
            path = self._plan(model, self.joints(arm), goals, margin, tight)
            yield from self._follow(arm, path, self._pace(optimistic), model, contact, felt)

        yield from self._tries(arm, steps, touches)

    def _shift(
        self,
        arm: str,
        displacement: Sequence[float] | FloatArray,
        checked: bool = True,
        without: Collection[Box] = (),
        held: FloatArray | None = None,
        contact: ContactLimits | None = None,
    ) -> MotionRequest:
        """`shift`, checked with the spheres `held` (see `model`); `contact` as in `_move`."""
        way = vector("the displacement", displacement)

        def steps() -> Iterator[None]:
            kin, q = self.kinematics[arm], self.joints(arm)
            tool = kin.tool(q)
            goal = RigidTransform.from_components(tool.translation + way, tool.rotation)
            path = straight_line(kin, q, goal)
            if checked:
                # Where it stands no camera sees: at this speed it may go back through what it hides.
                model = self.start_model(arm, held=held, without=without, optimistic=True)
                self._check_shift(model, path, float(np.linalg.norm(way)))
            else:
                model = self.model(arm, held=held)
            limits = contact if checked or contact else self._guard.pressing
            yield from self._follow(arm, path, self.parameters.approach_speed, model, limits)

        return self.execution.request(arm, steps())

    def _pick(
        self,
        arm: str,
        world_from_cylinder: RigidTransform,
        grasps: Callable[[], Sequence[Sequence[Grasp]]],
        clear_of: FloatArray | None,
        without: Collection[Box],
        point_cloud: PointCloudSource | None,
        onward: Callable[[FloatArray], bool] = lambda q: True,
        on_touch: Callable[[FloatArray], None] = lambda world_from_tool: None,
    ) -> MotionRequest:
        """`pick` with one of the `grasps`, which come in groups: of the first group in which any is free.

        Where there are any, it takes hold with joints (n,) that are well for what comes then, as `onward` says.
        `on_touch` is told of a grasp (4, 4) on whose straight way in the arm touched something.
        """
        finite_pose("the cylinder's pose", world_from_cylinder)
        near_points = None if clear_of is None else rows("the points to keep clear of", clear_of, 3)

        def steps(optimistic: bool) -> Iterator[None]:
            q, jaw = self.joints(arm), self.parameters.execution.jaw
            self._keep_clear_but_near(near_points, world_from_cylinder.translation)
            model = self.start_model(arm, opening=jaw.open_gap, optimistic=optimistic)
            try:
                approaches = self._first_approaches(arm, model, grasps(), without, optimistic)
            except PlanningError as error:
                if error.code is not CauseCode.OUT_OF_REACH:
                    raise
                where = self._how_far(arm, world_from_cylinder.translation)
                raise PlanningError(error.code, f"{error} of {arm_words(arm)}: {where}") from None
            approaches = [path for path in approaches if onward(path[-1])] or approaches
            self.grippers[arm].open(jaw.open_gap)
            path = self._plan(model, q, np.array([approach[0] for approach in approaches]))
            approach = min(approaches, key=lambda approach: float(np.abs(approach[0] - path[-1]).max()))
            yield from self._follow(arm, path, self._pace(optimistic), model)
            yield from self.execution.open_jaw(arm, jaw.open_gap - jaw.slack)
            offsets = yield from self._measure_offsets(arm, point_cloud)
            # With offsets the arm goes first to where it should stand now.
            approach = approach - offsets if offsets.any() else approach[1:]
            approach = np.vstack([self.joints(arm), approach])
            try:
                yield from self._follow(arm, approach, self.parameters.approach_speed, model)
            except TouchError:
                on_touch(self.kinematics[arm].tool_matrix(approach[-1]))
                raise
            self._ways_in[arm] = approach
            self.keep_clear(NO_POINTS)

        return self.execution.request(arm, self._tries(arm, steps))

    def _follow(
        self,
        arm: str,
        path: FloatArray,
        speed: float,
        model: CollisionModel,
        contact: ContactLimits | None = None,
        felt: bool = True,
    ) -> Iterator[None]:
        """`Execution.follow`, slowly where the arm, as it is in `model`, comes near to what was seen or felt.

        Also near to space that no camera has seen, however the map was read for the path. An arm that pulls something
        elastic goes no faster than `pulling_speed`. `felt`: see `_move_steps`.
        """
        if contact is not None and contact.elastic:
            speed = min(speed, self.parameters.pulling_speed)
        surfaces = self.all_mapped(felt) or (None if felt else NO_SURFACES)
        allowed = None if surfaces is None else SpeedBySeparation(model, surfaces, self.parameters.separation)
        yield from self.execution.follow(arm, path, speed, contact, allowed)

    def _tries(
        self, arm: str, steps: Callable[[bool], Iterator[None]], most: int | None = None, forgetting: bool = True
    ) -> Iterator[None]:
        """The steps, from the beginning after each touch, with what was felt on the map.

        Raises the last TouchError after the `most` touches (default: as set), or where the only way left meets again
        what was felt and forgotten.

        They are told whether the map is to be read optimistically (see `model`): where nothing is found otherwise.
        Where nothing is found even so, what was felt is forgotten, if `forgetting`: it may have been a little beside.
        """
        touched: list[FloatArray] = []  # joints (n,)
        optimistic, forgot = False, 0
        while True:
            try:
                yield from steps(optimistic)
            except TouchError as error:
                place, q = self.feel(arm, error.touch), error.touch.joints
                again = any(np.abs(q - other).max() < self.parameters.same_touch for other in touched[:forgot])
                touched.append(q)
                if again or len(touched) == (self.parameters.touches if most is None else most):
                    raise
                self._on_anomaly(f"felt at {place.round(3).tolist()}: {arm_words(arm)} looks for another way")
            except PlanningError as error:
                if error.code not in NO_WAY or isinstance(error, StoppedShortError):
                    raise
                if optimistic and not (forgetting and self.forget_felt()):
                    raise
                if optimistic:
                    forgot = len(touched)
                optimistic = not optimistic
            else:
                return

    def _pace(self, optimistic: bool) -> float:
        """The share of the joints' speed for a path, by how the map was read."""
        return self.parameters.optimistic_speed if optimistic else 1.0

    def _unreachable(self, arm: str, place: FloatArray, ends: int) -> PlanningError:
        """The error for a pose of the tool at `place` (3,) m that `ends` joint angles reach, none with a way on."""
        if ends:
            why = f"{ends} joint angles bring the tool of {arm_words(arm)} there, but from none it can go straight on"
        else:
            why = f"no joint angles bring the tool of {arm_words(arm)} there: {self._how_far(arm, place)}"
        return PlanningError(CauseCode.OUT_OF_REACH, why)

    def _how_far(self, arm: str, place: FloatArray) -> str:
        """How far a place (3,) m is from an arm's base, in words."""
        kin = self.kinematics[arm]
        distance = float(np.linalg.norm(place - kin.base[:3, 3]))
        return f"{distance:.2f} m from its base, and its links measure {kin.reach:.2f} m"

    def _free_onward(self, model: CollisionModel, q: FloatArray, onward: Sequence[RigidTransform]) -> bool:
        """Whether straight lines from joints (n,) to the poses `onward` (goal_from_tool) are free in a model."""
        kin = model.kinematics
        tool = kin.tool_matrix(q)
        path = straight_lines(kin, q, [multiply(tool, pose.as_matrix()) for pose in onward])
        return path is not None and model.path_free(path, self.parameters.straight_margin)

    def _check_shift(self, model: CollisionModel, path: FloatArray, length: float) -> None:
        """Raises PlanningError MOTION_BLOCKED with the nearest thing unless a path of `length` m is free.

        Free is hardly nearer to anything than where the path begins, or `straight_margin` from everything.
        """
        values = self.parameters
        if model.path_free(path[1:], min(model.clearance(path[0]) - values.clearances.nearer, values.straight_margin)):
            return
        distance, what = min(model.nearest(q) for q in path[1:])
        near = f"comes within {1e3 * distance:.0f} mm of" if distance > 0 else f"is {-1e3 * distance:.0f} mm in"
        message = f"{length:.2f} m straight on the arm {near} {what}"
        raise PlanningError(CauseCode.MOTION_BLOCKED, message)

    def _keep_clear_but_near(self, points: FloatArray | None, place: FloatArray) -> None:
        """Keep clear of the points (n, 3) m, except those in the jaw's reach of a place (3,) m."""
        self.keep_clear(NO_POINTS if points is None else points_beyond(points, place, self.parameters.pick.jaw_reach))

    def _measure_offsets(self, arm: str, point_cloud: PointCloudSource | None) -> Generator[None, None, FloatArray]:
        """The encoders' offsets (n,) of an arm at rest, by a picture taken from now on; zeros if none comes."""
        start = self._clock.now()
        while point_cloud is not None and self._clock.now() < start + self.parameters.camera_timeout:
            points = point_cloud(start)
            if points is not None:
                q, gap = self.joints(arm), self.grippers[arm].reading().gap
                return joint_offsets(self.kinematics[arm], q, gap, points, self.parameters.joint_offsets)
            yield
        return np.zeros(len(self.kinematics[arm]))

    def _first_approaches(
        self,
        arm: str,
        model: CollisionModel,
        groups: Sequence[Sequence[Grasp]],
        without: Collection[Box],
        optimistic: bool,
    ) -> list[FloatArray]:
        """`_approaches` of the first group that has any; where none has, raises the error of the first one."""
        errors: list[PlanningError] = []
        for candidates in filter(len, groups):
            try:
                return self._approaches(arm, model, candidates, without, optimistic)
            except PlanningError as error:
                errors.append(error)
        raise errors[0]

    def _approaches(
        self,
        arm: str,
        model: CollisionModel,
        candidates: Sequence[Grasp],
        without: Collection[Box],
        optimistic: bool = False,
        clearances: Clearances | None = None,
    ) -> list[FloatArray]:
        """Joint paths (k, n) from standoff to grasp; `model` counts away from what is grasped.

        They touch the boxes `without` only if there are no others. Known boxes are rigid: nearer to them than the arm
        errs they lead only where the map is read optimistically and there are no others. `clearances`: default as set.
        """
        clearances, pick = clearances or self.parameters.clearances, self.parameters.pick
        gap, q = self.parameters.execution.jaw.open_gap, self.joints(arm)
        spared = ((), without) if without else ((),)
        most = self.parameters.arm_error
        errors = (most, 0.5 * most, 0.0) if optimistic else (most,)
        for grown, boxes in product(errors, spared):
            near = self.model(arm, without=boxes, opening=gap, optimistic=optimistic, grown=grown)
            try:
                return find_approaches(model, near, q, candidates, clearances, pick)
            except PlanningError as found:
                error = found
        raise error

    def _plan(
        self,
        model: CollisionModel,
        start: FloatArray,
        goals: FloatArray,
        margin: float | None = None,
        tight: bool = True,
    ) -> FloatArray:
        """A path (k, n) with `margin` m (default: as set), else, if `tight`, with the smaller one."""
        planner, clearances = self.parameters.planner, self.parameters.clearances
        wide = clearances.margin if margin is None else margin
        try:
            return self.planner(model, start, goals, self._next_seed(), wide, planner)
        except PlanningError as error:
            if not tight or error.code is CauseCode.OUT_OF_REACH:
                raise
            return self.planner(model, start, goals, self._next_seed(), clearances.tight_margin, planner)

    def _next_seed(self) -> int:
        self._seed += 1
        return self._seed


def _check_margin(margin: float | None) -> None:
    if margin is not None:
        not_negative("the margin", margin)
