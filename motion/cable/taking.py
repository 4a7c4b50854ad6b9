"""How an arm takes hold of the connector: which arm, and with which of the grasps."""

from collections.abc import Callable, Collection, Generator, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from typing import TypeVar, cast

import numpy as np
from scipy.spatial.transform import RigidTransform

from regrasp.interfaces.arguments import finite_pose
from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cable.cell import CableKnown
from regrasp.interfaces.cable.motion import Grip
from regrasp.interfaces.cause import CauseCode
from regrasp.interfaces.cell import Box
from regrasp.interfaces.devices import Arm, Clock, Gripper
from regrasp.interfaces.request import Request
from regrasp.interfaces.wall_time import counts_as
from regrasp.motion.cable.cable_reach import CableReachParameters
from regrasp.motion.cable.cable_section import PullingParameters
from regrasp.motion.cable.cable_shape import cable_course
from regrasp.motion.cable.carrying import CarryMotion, CarryMotionParameters
from regrasp.motion.cable.gentle_pull import GentlePullParameters
from regrasp.motion.cable.plugging import PluggingParameters
from regrasp.motion.cable.seating import SeatingParameters, poses_before
from regrasp.motion.cable.tether import course_length
from regrasp.motion.failure import GraspEmptyError, JawBlockedError, PlanningError, TouchError
from regrasp.motion.grasping.approach import pick_candidates
from regrasp.motion.grasping.gap_test import GripWatch
from regrasp.motion.grasping.grasps import Grasp
from regrasp.motion.planning.straight import can_continue, straight_lines
from regrasp.motion.request import MotionRequest
from regrasp.motion.robots.poses import angle_between, inverse, multiply
from regrasp.motion.scene.collision import CollisionModel
from regrasp.motion.scene.planning_scene import NO_POINTS
from regrasp.motion.service import PointCloudSource

T = TypeVar("T")

NO_GRASP = (CauseCode.NO_COLLISION_FREE_GOAL, CauseCode.OUT_OF_REACH)


@dataclass(frozen=True)
class UnplugParameters:
    """How the plug is gripped and drawn out."""

    # m along the plug's axis, the first that is free, else the last; the plug sits 0.015 m deep; choice
    draw_outs: tuple[float, ...] = (0.05, 0.04, 0.03, 0.02)
    loose: float = 0.02  # m of that after which only the cable pulls, and a touch is felt; choice
    # m by which the plug lies nearer to the finger tips than the pads' middle: they end 12 mm past it, and the panel is
    # 20 mm behind the plug
    shallow: float = 0.008
    retreat: float = 0.06  # m back along the hand then; choice
    # of that, the first that is free; where none is, the way to the clip begins there; choice
    retreat_shares: tuple[float, ...] = (1.0, 0.6, 0.3)


@dataclass(frozen=True)
class CableMotionParameters(CarryMotionParameters):
    """Those of every task, of carrying, of taking hold, and of what is done with the cable then."""

    # Two grasps nearer than so many m and rad are one: what closed on nothing is tried again after all others; choice
    same_grasp: tuple[float, float] = (0.007, 0.35)
    # m and rad between grasps that are both in vain, if the connector could not be carried with one; choice
    alike_in_vain: tuple[float, float] = (0.03, 0.7)
    # m of clearance in the straight way in, from which on an arm has room: one that has less leaves it to another
    # that has; choice, of the near margins
    roomy: float = 0.014
    # m from where a socket or the clip holds a connector, within which one is taken for held; beside it, it is loose.
    # Choice: what cameras find is off by less
    held_within: float = 0.03
    # m by which a loose connector lies nearer to the finger tips than the pads' middle, where no deeper grasp is free:
    # the fingers end 12 mm past that middle; choice
    shallow: float = 0.008
    per_step: int = 12  # kinds of grasps of which it is asked in a tick whether they can stow it; choice: 50 ms
    stow_rolls: int = 12  # angles about the connector that are tried for that: every 30 degrees
    # m from the end of the way on which a hand came in, within which it may go back on it; it draws a plug out by less
    beside_way_in: float = 0.06
    # m straight back from where something was held; the first that is free; choice
    retreats: tuple[float, ...] = (0.10, 0.08, 0.06, 0.05, 0.04, 0.03)
    unplug: UnplugParameters = field(default_factory=UnplugParameters)
    seating: SeatingParameters = field(default_factory=SeatingParameters)
    gentle_pull: GentlePullParameters = field(default_factory=GentlePullParameters)
    cable_reach: CableReachParameters = field(default_factory=CableReachParameters)
    plugging: PluggingParameters = field(default_factory=PluggingParameters)
    pulling: PullingParameters = field(default_factory=PullingParameters)


class TakingMotion(CarryMotion):
    """Takes hold of the connector with the arm that can do it best."""

    parameters: CableMotionParameters

    def __init__(
        self,
        known: CableKnown,
        arms: Mapping[str, Arm],
        grippers: Mapping[str, Gripper],
        clock: Clock,
        seed: int,
        parameters: CableMotionParameters = CableMotionParameters(),
        on_anomaly: Callable[[str], None] = lambda sentence: None,
    ) -> None:
        super().__init__(known, arms, grippers, clock, seed, parameters, on_anomaly)
        self._hand = known.cable.hand
        self._missed: list[FloatArray] = []  # grasps (4, 4), connector_from_tool, that failed
        # By arm, grasps (4, 4), connector_from_tool, with which the connector could not be carried to the clip
        self._vain: dict[str, list[FloatArray]] = {arm: [] for arm in self.arms}
        # By arm, the pose (4, 4) of the connector, and whether it can be stowed with a grasp, see `_without_roll`
        self._stows: dict[str, tuple[FloatArray, dict[tuple[float, ...], bool]]] = {}

    @property
    def hand(self) -> str:
        """The arm that handles the cable now; at first the cell's."""
        return self._hand

    def take_with(self, arm: str) -> None:
        """Let an arm of that name handle the cable from now on."""
        self._hand = self.known.arm(arm).name

    def hands_for(self, world_from_connector: RigidTransform, without: Collection[str] = ()) -> Request[list[str]]:
        """The arms, but for those `without`, that can take the loose connector, the best first.

        Where none can, the present hand, or the first that is left.

        Best is one that can stow it with that grasp, then one whose way in leads through seen space, then one that has
        room there, then the cell's hand.
        """
        finite_pose("the connector's pose", world_from_connector)
        first = self.known.cable.hand

        def steps() -> Generator[None, None, list[str]]:
            ease: dict[str, int] = {}
            self._keep_clear_of_cable(world_from_connector)
            arms = sorted(self.arms.keys() - set(without), key=lambda arm: arm != first)
            for arm in arms:
                found = yield from self._ease(arm, world_from_connector)
                if found is not None:
                    ease[arm] = found
            self.keep_clear(NO_POINTS)
            return sorted(ease, key=lambda arm: ease[arm]) or sorted(arms, key=lambda arm: arm != self.hand)[:1]

        return Request(steps())

    def pick_plug(self, plug: RigidTransform, *, point_cloud: PointCloudSource | None = None) -> MotionRequest:
        """`pick` the connector where it is plugged in, world_from_connector: a panel is near.

        Preferably so that the hand is free where it has drawn the plug out. It is drawn into what was seen only with a
        grasp for which there is no other.
        """
        finite_pose("the plug's pose", plug)
        room, meets_seen = self._room_to_draw_out(plug), self._drawn_into_seen(plug)

        def grasps() -> list[list[Grasp]]:
            candidates = sorted(self._candidates(self.hand, plug, self.parameters.unplug.shallow), key=room)
            into = [meets_seen(grasp) for grasp in candidates]
            return [[one for one, is_so in zip(candidates, into, strict=True) if is_so is so] for so in (False, True)]

        kin, axis = self.kinematics[self.hand], plug.rotation.apply([1.0, 0.0, 0.0])

        def can_draw_out(q: FloatArray) -> bool:
            out = kin.tool_matrix(q)
            out[:3, 3] -= self.parameters.unplug.draw_outs[0] * axis
            return straight_lines(kin, q, [out]) is not None

        return self._pick_connector(plug, grasps, None, point_cloud, can_draw_out)

    def pick_loose(
        self,
        world_from_connector: RigidTransform,
        *,
        point_cloud: PointCloudSource | None = None,
    ) -> Request[None]:
        """`pick` the connector where it hangs at the end of its cable, of which the arm keeps clear.

        With a grasp from which the clip can be reached, if there is one.
        """
        finite_pose("the connector's pose", world_from_connector)
        cable = cable_course(self.known, world_from_connector)

        def steps() -> Iterator[None]:
            stows = _at_once(self._stowing(self.hand, world_from_connector))
            deep, shallow = (
                self._candidates(self.hand, world_from_connector, depth) for depth in (0.0, self.parameters.shallow)
            )
            # What can be done with the one can be done with the other.
            kept = [(one, other) for one, other in zip(deep, shallow, strict=True) if stows(one)]
            try:
                if kept:
                    some = [[one for one, _ in kept], [other for _, other in kept]]
                    yield from self._done(self._pick_connector(world_from_connector, lambda: some, cable, point_cloud))
                    return
            except PlanningError as error:
                if error.code not in NO_GRASP or isinstance(error, TouchError):
                    raise
                self._on_anomaly(f"of the grasps from which the clip can be reached: {error}")
            every = [deep, shallow]
            yield from self._done(self._pick_connector(world_from_connector, lambda: every, cable, point_cloud))

        return self._together(self.hand, steps())

    @counts_as("planning")
    def can_pick_loose(self, world_from_connector: RigidTransform) -> bool:
        """Whether an arm has a free grasp of the loose connector, with all space that no camera has seen for full."""
        finite_pose("the connector's pose", world_from_connector)
        self._keep_clear_of_cable(world_from_connector)
        free = any(
            self._has_grasp(arm, world_from_connector, self._candidates(arm, world_from_connector))
            for arm in sorted(self.arms, key=lambda arm: arm != self.hand)
        )
        self.keep_clear(NO_POINTS)
        return free

    def _keep_clear_of_cable(self, connector: RigidTransform) -> None:
        """Keep clear of the cable of the loose connector, but for where a jaw takes hold."""
        self._keep_clear_but_near(cable_course(self.known, connector), connector.translation)

    def grip(self, world_from_connector: RigidTransform) -> Request[Grip]:
        """Close the hand's jaw on the connector; the answer is what it holds then. It fails as `close` does.

        A loose connector is gripped gently at first, but with a grasp that has failed before. One that a socket or the
        clip holds does not give way to a hand that is a little beside.
        """
        finite_pose("the connector's pose", world_from_connector)

        def steps() -> Generator[None, None, Grip]:
            held = self.tool(self.hand).inv() * world_from_connector
            taken, near = held.inv().as_matrix(), self.parameters.same_grasp
            again = any(_alike(taken, other, *near) for other in self._missed)
            gently = not again and not self._is_fixed(world_from_connector)
            thickness = 2 * self.known.cable.connector.radius
            try:
                gap = yield from self.execution.close_jaw(self.hand, thickness, gently)
                if gap > thickness + self.parameters.execution.jaw.grip.wider:
                    raise JawBlockedError(f"the jaw holds something else, too: it stands {1e3 * gap:.1f} mm open", gap)
            except GraspEmptyError as error:
                self._missed.append(taken)
                if isinstance(error, JawBlockedError):
                    self.feel_in_jaw(self.hand, error.gap, thickness)
                raise
            self._missed.clear()
            return Grip(gap, self.tool(self.hand).inv() * world_from_connector)

        return Request(steps())

    def watch_grip(self) -> GripWatch:
        """Begin to watch by the hand's pads whether it holds the connector."""
        return GripWatch(
            self.grippers[self.hand], 2 * self.known.cable.connector.radius, self.parameters.execution.jaw.grip.gap
        )

    def _draw_back(self, arm: str) -> Generator[None, None, str]:
        """Steps that draw a hand straight back as far as is free. They return '', or why no distance was.

        Where none is free, a hand that is still beside where it came in for a grasp goes back the way that it came. One
        that touches something goes no further; what it felt is on the map then.
        """
        why = ""
        for way in self._ways_back(arm):
            try:
                yield from self._done(way)
            except PlanningError as error:
                why = str(error)
                if isinstance(error, TouchError):
                    self.feel(arm, error.touch)
                    break
            else:
                return ""
        return why

    def _ways_back(self, arm: str) -> Iterator[MotionRequest]:
        """The motions straight back, the longest first, and the way on which the arm came in where that is near."""
        for distance in self.parameters.retreats:
            back = self.tool(arm).rotation.apply([-distance, 0.0, 0.0])
            yield self._shift(arm, back, contact=self._guard.leaving)
        way_in, kin, q = self._ways_in.get(arm), self.kinematics[arm], self.joints(arm)
        if way_in is None:
            return
        end = kin.tool_matrix(way_in[-1])
        to_it = straight_lines(kin, q, [end])
        off = float(np.linalg.norm(end[:3, 3] - kin.tool_matrix(q)[:3, 3]))
        if to_it is None or off > self.parameters.beside_way_in:
            return
        if np.abs(to_it[-1] - way_in[-1]).max() < self.parameters.execution.goal_tolerance:
            model, speed = self.start_model(arm, optimistic=True), self.parameters.approach_speed
            back = np.vstack([to_it, way_in[::-1]])
            yield self.execution.request(arm, self._follow(arm, back, speed, model, self._guard.pulling))

    def _ease(self, arm: str, connector: RigidTransform) -> Generator[None, None, int | None]:
        """How easily an arm takes the loose connector, from 0 for best; None: not at all. See `hands_for`."""
        candidates, stows = self._candidates(arm, connector), (yield from self._stowing(arm, connector))
        groups = [list(filter(stows, candidates)), candidates]
        margins, roomy = self.parameters.clearances.near_margins, (self.parameters.roomy,)
        ways = [
            (group, optimistic, near) for group in groups for optimistic in (False, True) for near in (roomy, margins)
        ]
        for n, (group, optimistic, near) in enumerate(ways):
            yield
            if group and self._has_grasp(arm, connector, group, optimistic, near):
                return n
        return None

    @counts_as("planning")
    def _has_grasp(
        self,
        arm: str,
        connector: RigidTransform,
        candidates: Sequence[Grasp],
        optimistic: bool = False,
        near_margins: tuple[float, ...] | None = None,
    ) -> bool:
        """Whether one of the candidates is free for an arm; `near_margins` as in `Clearances`."""
        clearances = self.parameters.clearances
        if near_margins is not None:
            clearances = replace(clearances, near_margins=near_margins)
        model = self.model(arm, opening=self.parameters.execution.jaw.open_gap, optimistic=optimistic)
        with suppress(PlanningError):
            return bool(self._approaches(arm, model, candidates, self._bracket_near(connector), optimistic, clearances))
        return False

    def _candidates(self, arm: str, connector: RigidTransform, shallow: float = 0.0) -> list[Grasp]:
        """Grasps of the connector, see `pick_candidates`."""
        widest = self.known.arm(arm).robot.gripper.opening
        return pick_candidates(connector, self.known.cable.connector, shallow, widest, self.parameters.pick)

    def _stowing(self, arm: str, connector: RigidTransform) -> Generator[None, None, Callable[[Grasp], bool]]:
        """Steps that find which grasps of a connector let an arm bring it into the clip.

        Not those with which it has failed to. A turn about the connector's axis makes no difference: it may lie in the
        clip with any roll. The answers for the connector that was asked about last are kept.
        """
        now, from_connector = connector.as_matrix(), inverse(connector.as_matrix())
        about, answers = self._stows.get(arm, (now, {}))
        if not answers or not np.array_equal(about, now):
            answers = {}
            for grasp in self._candidates(arm, connector):
                held = multiply(inverse(grasp.pose), now)
                key = _without_roll(multiply(from_connector, grasp.pose))
                if key not in answers:
                    answers[key] = self._can_stow(arm, RigidTransform.from_matrix(held))
                    if len(answers) % self.parameters.per_step == 0:
                        yield
            self._stows[arm] = now, answers

        def stows(grasp: Grasp) -> bool:
            taken, near = multiply(from_connector, grasp.pose), self.parameters.alike_in_vain
            in_vain = any(_alike(taken, other, *near) for other in self._vain[arm])
            return not in_vain and answers.get(_without_roll(taken), True)

        return stows

    @counts_as("planning")
    def _can_stow(self, arm: str, held: RigidTransform) -> bool:
        """Whether an arm that holds the connector so (tool_from_connector) can stand before the clip and go in."""
        clip, gap = self.known.cable.clip, 2 * self.known.cable.connector.radius
        models = (
            self.model(arm, held=self.held_spheres(held), opening=gap, optimistic=True),
            self.model(arm, without=clip.bracket, opening=gap, optimistic=True),
        )
        seating = replace(self.parameters.seating, rolls=self.parameters.stow_rolls)
        q = np.array(self.known.arm(arm).sleep)
        goals = poses_before(models, q, clip.world_from_seat, held, seating.straight_in, seating)
        return bool(self._onward(arm, models[0], self._within_cable(goals, held)))

    def _within_cable(self, goals: Sequence[RigidTransform], held: RigidTransform) -> list[RigidTransform]:
        """The goals (world_from_tool) at which the cable is long enough for what is held (tool_from_connector)."""
        longest = self.known.cable.length + self.parameters.tether.stretch
        return [goal for goal in goals if course_length(self.known, (goal * held).as_matrix()) <= longest]

    def _onward(self, arm: str, model: CollisionModel, goals: Sequence[RigidTransform]) -> list[RigidTransform]:
        """The ways in and back out (goal_from_tool) from before the clip, with the longest way out that a goal allows.

        None where from no goal any way leads in and out.
        """
        kin, q, seating = self.kinematics[arm], self.joints(arm), self.parameters.seating
        ends = [end for end in kin.ik_of_all(goals, q) if model.free(end, seating.margin)]
        for retreat in self.parameters.retreats:
            ways = [
                RigidTransform.from_translation([x, 0.0, 0.0]) for x in (seating.distance, seating.distance - retreat)
            ]
            if any(can_continue(kin, end, ways) for end in ends):
                return ways
        return []

    def _room_to_draw_out(self, plug: RigidTransform) -> Callable[[Grasp], int]:
        """How a hand fares that draws out the plug (world_from_connector), by its grasp.

        0: it is free then, 1: it may be, 2: it meets something.
        """
        kin, out = self.kinematics[self.hand], self._drawn_out(plug)
        gap, margin = 2 * self.known.cable.connector.radius, self.parameters.clearances.tight_margin
        models = [self.model(self.hand, opening=gap, optimistic=optimistic) for optimistic in (False, True)]

        def room(grasp: Grasp) -> int:
            ends = kin.ik(out @ grasp.pose)
            free = (any(model.free(q, margin) for q in ends) for model in models)
            return next((n for n, is_free in enumerate(free) if is_free), len(models))

        return room

    def _drawn_into_seen(self, plug: RigidTransform) -> Callable[[Grasp], bool]:
        """Whether a hand that draws out the plug (world_from_connector) may meet a seen surface, by its grasp."""
        kin, out, gap = self.kinematics[self.hand], self._drawn_out(plug), 2 * self.known.cable.connector.radius
        seen = self.model(self.hand, opening=gap, optimistic=True, without=self._boxes)

        def meets(grasp: Grasp) -> bool:
            ends = kin.ik(out @ grasp.pose)
            return bool(len(ends)) and not any(seen.free(q, self.parameters.separation.touching) for q in ends)

        return meets

    def _drawn_out(self, plug: RigidTransform) -> FloatArray:
        """The displacement (4, 4) in the world by which the plug is drawn out at most."""
        out = np.eye(4)
        out[:3, 3] = -self.parameters.unplug.draw_outs[0] * plug.rotation.apply([1.0, 0.0, 0.0])
        return out

    def _bracket_near(self, world_from_connector: RigidTransform) -> Collection[Box]:
        """The clip's bracket, which a hand may touch that takes the connector out of the clip, or no box elsewhere."""
        clip = self.known.cable.clip
        off = float(np.linalg.norm(world_from_connector.translation - np.array(clip.seat)))
        return clip.bracket if off < self.parameters.pick.jaw_reach else ()

    def _is_fixed(self, world_from_connector: RigidTransform) -> bool:
        """Whether the connector is where the clip or a socket holds it."""
        cable = self.known.cable
        held = [cable.clip.world_from_seat, *(s.world_from_plug(cable.connector.length) for s in cable.sockets)]
        offs = np.linalg.norm([pose.translation - world_from_connector.translation for pose in held], axis=1)
        return bool(offs.min() < self.parameters.held_within)

    def _pick_connector(
        self,
        world_from_connector: RigidTransform,
        grasps: Callable[[], Sequence[Sequence[Grasp]]],
        cable: FloatArray | None,
        point_cloud: PointCloudSource | None,
        onward: Callable[[FloatArray], bool] = lambda q: True,
    ) -> MotionRequest:
        """`pick` the connector with one of the `grasps`, of which those of an earlier group are tried first.

        Those that closed on nothing or touched something on the way in are tried after all others.
        """
        connector_from_world, near = inverse(world_from_connector.as_matrix()), self.parameters.same_grasp

        def missed(grasp: Grasp) -> bool:
            return any(_alike(connector_from_world @ grasp.pose, other, *near) for other in self._missed)

        def fresh_first() -> list[list[Grasp]]:
            groups = grasps()
            fresh = [[grasp for grasp in group if not missed(grasp)] for group in groups]
            return [*fresh, [grasp for group in groups for grasp in group if missed(grasp)]]

        return self._pick(
            self.hand,
            world_from_connector,
            fresh_first,
            cable,
            self._bracket_near(world_from_connector),
            point_cloud,
            onward,
            lambda world_from_tool: self._missed.append(connector_from_world @ world_from_tool),
        )


def _at_once(steps: Generator[None, None, T]) -> T:
    """What the steps return, done in one tick."""
    while True:
        try:
            next(steps)
        except StopIteration as end:
            return cast(T, end.value)


def _without_roll(connector_from_tool: FloatArray) -> tuple[float, ...]:
    """What is left of a grasp (4, 4) when a turn about the connector's axis does not count, rounded to 1e-3.

    Where along the axis and how far from it the tool is, how its axes lie to it, and to the line from the axis to it.
    """
    axes, place = connector_from_tool[:3, :3], connector_from_tool[:3, 3]
    return tuple(np.round([place[0], np.hypot(place[1], place[2]), *axes[0]], 3).tolist())


def _alike(pose: FloatArray, other: FloatArray, distance: float, angle: float) -> bool:
    """Whether two poses (4, 4) are nearer than so many m and rad."""
    return bool(np.linalg.norm(pose[:3, 3] - other[:3, 3]) < distance) and angle_between(pose, other) < angle
