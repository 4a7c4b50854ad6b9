"""What the leaves ask of the arms: plan, wait for the plan's latency, follow, stop.

A request returns a `MotionTask` at once; `poll` it every tick. Nothing here reads a wall clock: a plan costs its stated
latency on the simulated clock.
"""

from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field

import numpy as np
from scipy.spatial.transform import RigidTransform

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cable.cell import CableKnown
from regrasp.interfaces.cause import CauseCode
from regrasp.interfaces.devices import Arm, Clock, Gripper
from regrasp.motion.cable.carry_paths import CarryPathParameters, can_continue, carry_paths, first_free
from regrasp.motion.execution import Execution, ExecutionParameters
from regrasp.motion.failure import PlanningError
from regrasp.motion.grasping.approach import PickParameters, find_approaches, pick_candidates, points_beyond
from regrasp.motion.planning.planner import PlannerParameters, plan
from regrasp.motion.planning.straight import straight_line
from regrasp.motion.robots.arm_offsets import JointOffsetParameters, joint_offsets
from regrasp.motion.robots.spheres import JAW_OPENING
from regrasp.motion.scene.collision import Clearances, CollisionModel
from regrasp.motion.scene.planning_scene import NO_POINTS, PlanningScene, PlanningSceneParameters
from regrasp.motion.task import MotionTask

# Points (n, 3) m in the world that a camera saw from that second on; None while there is no such picture.
PointCloudSource = Callable[[float], FloatArray | None]


@dataclass(frozen=True)
class MotionParameters:
    """The parameters of all parts of the motion service."""

    approach_speed: float = 0.3  # share of the joints' speed on straight paths near things; choice
    camera_timeout: float = 1.0  # s that a camera has to show the arm; a sound one needs 0.2
    clearances: Clearances = field(default_factory=Clearances)
    execution: ExecutionParameters = field(default_factory=ExecutionParameters)
    pick: PickParameters = field(default_factory=PickParameters)
    carry: CarryPathParameters = field(default_factory=CarryPathParameters)
    planner: PlannerParameters = field(default_factory=PlannerParameters)
    joint_offsets: JointOffsetParameters = field(default_factory=JointOffsetParameters)
    scene: PlanningSceneParameters = field(default_factory=PlanningSceneParameters)


class Motion(PlanningScene):
    """Requests to the two arms. `seed` makes the planner's draws repeatable; `on_anomaly`: see `Execution`."""

    def __init__(
        self,
        known: CableKnown,
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
        self.execution = Execution(arms, grippers, clock, known.latencies.plan, parameters.execution, on_anomaly)
        self._clock, self._seed = clock, seed

    def warm_up(self) -> None:
        """Look for a grasp of the plugged connector and drop it.

        The compiled functions of a pick are then loaded now, and no tick waits for it.
        """
        known = self.known
        plugged = known.cable.socket(known.cable.plugged_into).world_from_plug(known.cable.connector.length)
        for arm in self.arms:
            with suppress(PlanningError):
                self._approaches(arm, self.model(arm), plugged, 0.0)

    def move(self, arm: str, goals: FloatArray, *, margin: float | None = None, tight: bool = True) -> MotionTask:
        """Plan a path to one of the goals (n, 6) rad and follow it, `margin` m from everything (default: as set).

        `tight`: with a smaller margin where nothing else is found.
        """

        def steps() -> Iterator[None]:
            path = self._plan(self.start_model(arm), self.joints(arm), goals, margin, tight)
            yield from self.execution.follow(arm, path, 1.0)

        return self.execution.task(arm, steps())

    def carry(
        self,
        arm: str,
        goals: Sequence[RigidTransform],
        held: RigidTransform,
        *,
        onward: Sequence[RigidTransform] = (),
        speed: float,
    ) -> MotionTask:
        """Bring what `arm` holds (tool_from_connector) to one of the goals (world_from_tool), the first preferred.

        Along the shapes that the cable takes by itself where that is free, else straight or in a flat arch, else along
        any free path. Where possible there is room for a jaw that opens on the way, as after a slip. From the goal the
        tool must also reach the poses `onward` (goal_from_tool) in straight lines.
        """

        def steps() -> Iterator[None]:
            model, q, kin = self.start_model(arm, held), self.joints(arm), self.kinematics[arm]
            clearances, carry = self.parameters.clearances, self.parameters.carry
            candidates = carry_paths(self.known, kin, q, goals, held, carry)
            paths = (path for path in candidates if can_continue(kin, path[-1], onward, carry.step))
            wide = self.model(arm, held=held, opening=JAW_OPENING)
            path = first_free((wide, model), clearances.near_margins, paths)
            if path is None:
                solutions = [end for goal in goals for end in kin.ik(goal)]
                ends = [end for end in solutions if can_continue(kin, end, onward, carry.step)]
                path = self._plan(model, q, np.array(ends).reshape(-1, 6))
            yield from self.execution.follow(arm, path, speed)

        return self.execution.task(arm, steps())

    def straight(self, arm: str, goal: RigidTransform, *, speed: float | None = None) -> MotionTask:
        """Move the tool in a straight line to `goal` (world_from_tool). Whether the way is free is not checked.

        `speed` in (0, 1] of the joints' limits; default: `approach_speed`.
        """

        def steps() -> Iterator[None]:
            path = straight_line(self.kinematics[arm], self.joints(arm), goal)
            yield from self.execution.follow(arm, path, self.parameters.approach_speed if speed is None else speed)

        return self.execution.task(arm, steps())

    def shift(self, arm: str, displacement: Sequence[float] | FloatArray, *, checked: bool = True) -> MotionTask:
        """Move the tool straight by `displacement` (3,) m in the world, without turning it.

        `checked`: only if the arm meets nothing but the clip. A motion that begins in a socket's box cannot be checked.
        """

        def steps() -> Iterator[None]:
            kin, q = self.kinematics[arm], self.joints(arm)
            tool = kin.tool(q)
            goal = RigidTransform.from_components(tool.translation + displacement, tool.rotation)
            path = straight_line(kin, q, goal)
            model = self.start_model(arm, clip=False)
            if checked:
                self._check_shift(model, path, float(np.linalg.norm(displacement)))
            yield from self.execution.follow(arm, path, self.parameters.approach_speed)

        return self.execution.task(arm, steps())

    def pick(
        self,
        arm: str,
        world_from_connector: RigidTransform,
        *,
        shallow: float = 0.0,
        cable: FloatArray | None = None,
        point_cloud: PointCloudSource | None = None,
    ) -> MotionTask:
        """Open the jaw and bring it round the connector near its cable side; the jaw stays open.

        The connector lies `shallow` metres nearer to the finger tips than the pads' middle. The arm keeps clear of the
        `cable`'s points (n, 3) m, except where the jaw takes hold: pushing the cable moves the connector. Before the
        last straight way the arm is corrected by the `point_cloud` that a camera sees of it.
        """

        def steps() -> Iterator[None]:
            q, jaw = self.joints(arm), self.parameters.execution.jaw
            self._keep_clear_of_cable(cable, world_from_connector.translation)
            model = self.start_model(arm, opening=jaw.open_gap)
            approaches = self._approaches(arm, model, world_from_connector, shallow)
            self.grippers[arm].open(jaw.open_gap)
            path = self._plan(model, q, np.array([approach[0] for approach in approaches]))
            approach = min(approaches, key=lambda approach: float(np.abs(approach[0] - path[-1]).max()))
            yield from self.execution.follow(arm, path, 1.0)
            yield from self.execution.open_jaw(arm, jaw.open_gap - jaw.slack)
            offsets = yield from self._measure_offsets(arm, point_cloud)
            # With offsets the arm goes first to where it should stand now.
            approach = approach - offsets if offsets.any() else approach[1:]
            approach = np.vstack([self.joints(arm), approach])
            yield from self.execution.follow(arm, approach, self.parameters.approach_speed)
            self.keep_clear(NO_POINTS)

        return self.execution.task(arm, steps())

    def release(self, arm: str) -> MotionTask:
        """Open the jaw; done once it stands wider than a connector."""
        gap = 2 * self.known.cable.connector.radius + self.parameters.execution.jaw.slack
        return self.execution.task(arm, self.execution.open_jaw(arm, gap))

    def stop(self) -> None:
        """Stop both arms."""
        for arm in self.arms:
            self.execution.halt(arm)

    def give_up(self, arm: str, code: str, message: str) -> PlanningError:
        """Disable an arm or its jaw: every later request to it fails with this cause. Returns the error to raise."""
        return self.execution.give_up(arm, code, message)

    def _check_shift(self, model: CollisionModel, path: FloatArray, length: float) -> None:
        """Raises PlanningError MOTION_BLOCKED with the nearest thing unless a path of `length` m is free."""
        if model.path_free(path[1:], self.parameters.clearances.near_margins[0]):
            return
        distance, what = min(model.nearest(q) for q in path[1:])
        message = f"{length:.2f} m straight on the arm is {-1e3 * distance:.0f} mm in {what}"
        raise PlanningError(CauseCode.MOTION_BLOCKED, message)

    def _keep_clear_of_cable(self, cable: FloatArray | None, connector: FloatArray) -> None:
        """Keep clear of the cable's points (n, 3) m, except those in the jaw's reach of the connector (3,) m."""
        self.keep_clear(NO_POINTS if cable is None else points_beyond(cable, connector, self.parameters.pick.jaw_reach))

    def _measure_offsets(self, arm: str, point_cloud: PointCloudSource | None) -> Generator[None, None, FloatArray]:
        """The encoders' offsets (6,) rad of an arm at rest, by a picture taken from now on; zeros if none comes."""
        start = self._clock.now()
        while point_cloud is not None and self._clock.now() < start + self.parameters.camera_timeout:
            points = point_cloud(start)
            if points is not None:
                q, gap = self.joints(arm), self.grippers[arm].reading().gap
                return joint_offsets(self.kinematics[arm], q, gap, points, self.parameters.joint_offsets)
            yield
        return np.zeros(6)

    def _approaches(
        self, arm: str, model: CollisionModel, world_from_connector: RigidTransform, shallow: float
    ) -> list[FloatArray]:
        """Joint paths (k, 6) rad from standoff to grasp; `model` counts away from the connector."""
        pick = self.parameters.pick
        near = self.model(arm, clip=False, opening=self.parameters.execution.jaw.open_gap)
        candidates = pick_candidates(world_from_connector, self.known.cable.connector, shallow, pick)
        return find_approaches(model, near, self.joints(arm), candidates, self.parameters.clearances, pick)

    def _plan(
        self,
        model: CollisionModel,
        start: FloatArray,
        goals: FloatArray,
        margin: float | None = None,
        tight: bool = True,
    ) -> FloatArray:
        """A path (k, 6) rad with `margin` m (default: as set), else, if `tight`, with the smaller one."""
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
