"""What the cable's leaves ask of the arms: unplug, carry, insert, let go, and look for a lost end."""

from collections.abc import Callable, Collection, Generator, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from typing import TypeVar

import numpy as np
from scipy.spatial.transform import RigidTransform

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cable.cell import CableKnown
from regrasp.interfaces.cable.motion import Grip
from regrasp.interfaces.cause import CauseCode
from regrasp.interfaces.cell import Box
from regrasp.interfaces.devices import Arm, Clock, Gripper
from regrasp.interfaces.evidence import Evidence
from regrasp.interfaces.request import Request
from regrasp.motion.arguments import finite_pose
from regrasp.motion.cable.cable_reach import CableReachParameters
from regrasp.motion.cable.cable_shape import cable_course, connector_points
from regrasp.motion.cable.carrying import CarryMotion, CarryMotionParameters
from regrasp.motion.cable.gentle_pull import GentlePullParameters, across_the_cable, pull_gently
from regrasp.motion.cable.plugging import PluggingParameters
from regrasp.motion.cable.seating import SeatingParameters, lying_otherwise, poses_before, seated_pose
from regrasp.motion.failure import GraspEmptyError, PlanningError, TouchError
from regrasp.motion.grasping.approach import pick_candidates
from regrasp.motion.grasping.gap_test import GripWatch
from regrasp.motion.grasping.grasps import Grasp
from regrasp.motion.request import MotionRequest
from regrasp.motion.robots.contact_guard import ContactLimits
from regrasp.motion.robots.poses import angle_between
from regrasp.motion.robots.tool_force import tool_force
from regrasp.motion.scene.collision import CollisionModel
from regrasp.motion.scene.planning_scene import NO_POINTS
from regrasp.motion.service import PointCloudSource

T = TypeVar("T")


@dataclass(frozen=True)
class UnplugParameters:
    """How the plug is gripped and drawn out."""

    draw_out: float = 0.05  # m along the plug's axis; the plug sits 0.015 m deep
    # m by which the plug lies nearer to the finger tips than the pads' middle: they end 12 mm past it, and the panel is
    # 20 mm behind the plug
    shallow: float = 0.008
    retreat: float = 0.06  # m away from the panel then; choice
    # of that, the first that is free; where none is, the way to the clip begins there; choice
    retreat_shares: tuple[float, ...] = (1.0, 0.6, 0.3)


@dataclass(frozen=True)
class CableMotionParameters(CarryMotionParameters):
    """Those of every task, and of what is done with the cable."""

    # Two grasps nearer than so many m and rad are one: what closed on nothing is tried again after all others; choice
    same_grasp: tuple[float, float] = (0.015, 0.35)
    # m straight back from where something was held; the first that is free; choice
    retreats: tuple[float, ...] = (0.10, 0.08, 0.06, 0.05, 0.04, 0.03)
    unplug: UnplugParameters = field(default_factory=UnplugParameters)
    seating: SeatingParameters = field(default_factory=SeatingParameters)
    gentle_pull: GentlePullParameters = field(default_factory=GentlePullParameters)
    cable_reach: CableReachParameters = field(default_factory=CableReachParameters)
    plugging: PluggingParameters = field(default_factory=PluggingParameters)


class CableMotion(CarryMotion):
    """Requests to the arm that handles the cable, the hand, and to the one that carries the camera that searches."""

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
        self.hand = known.cable.hand
        self._missed: list[FloatArray] = []  # grasps (4, 4), connector_from_tool, that closed on nothing

    def warm_up(self) -> None:
        """Look for a grasp of the plugged connector, check its cable, and drop both.

        The compiled functions of a pick and of carrying are then loaded now, and no tick waits for it.
        """
        cable = self.known.cable
        plugged = cable.socket(cable.plugged_into).world_from_plug(cable.connector.length)
        for arm in self.arms:
            widest = self.known.arm(arm).robot.gripper.opening
            candidates = pick_candidates(plugged, cable.connector, 0.0, widest, self.parameters.pick)
            with suppress(PlanningError):
                self._approaches(arm, self.model(arm), candidates, cable.clip.bracket)
        q = self.joints(self.hand)
        tether = self._tether(self.hand, self.tool(self.hand).inv() * plugged, q, np.inf, optimistic=False)
        tether.clearance(plugged.as_matrix())
        tether.holds_along(q, q)

    def _shift(
        self,
        arm: str,
        displacement: Sequence[float] | FloatArray,
        checked: bool = True,
        without: Collection[Box] = (),
        held: FloatArray | None = None,
        contact: ContactLimits | None = None,
    ) -> MotionRequest:
        """As in every task; the clip's bracket may be touched, too."""
        without = [*without, *self.known.cable.clip.bracket]
        return super()._shift(arm, displacement, checked, without, held, contact)

    def pick_plug(self, plug: RigidTransform, *, point_cloud: PointCloudSource | None = None) -> MotionRequest:
        """`pick` the connector where it is plugged in, world_from_connector: a panel is near.

        Preferably so that the hand is free where it has drawn the plug out.
        """
        finite_pose("the plug's pose", plug)
        room = self._room_to_draw_out(plug)
        return self._pick_connector(plug, self.parameters.unplug.shallow, None, point_cloud, room)

    def pick_loose(
        self,
        world_from_connector: RigidTransform,
        *,
        point_cloud: PointCloudSource | None = None,
    ) -> MotionRequest:
        """`pick` the connector where it hangs at the end of its cable, of which the arm keeps clear."""
        finite_pose("the connector's pose", world_from_connector)
        cable = cable_course(self.known, world_from_connector)
        return self._pick_connector(world_from_connector, 0.0, cable, point_cloud)

    def can_pick_loose(self, world_from_connector: RigidTransform) -> bool:
        """Whether a grasp of the loose connector is free, with all space that no camera has seen taken for full."""
        finite_pose("the connector's pose", world_from_connector)
        connector, jaw = self.known.cable.connector, self.parameters.execution.jaw
        self._keep_clear_but_near(cable_course(self.known, world_from_connector), world_from_connector.translation)
        widest = self.known.arm(self.hand).robot.gripper.opening
        candidates = pick_candidates(world_from_connector, connector, 0.0, widest, self.parameters.pick)
        model = self.model(self.hand, opening=jaw.open_gap)
        try:
            self._approaches(self.hand, model, candidates, self._bracket_near(world_from_connector))
        except PlanningError:
            return False
        finally:
            self.keep_clear(NO_POINTS)
        return True

    def grip(self, world_from_connector: RigidTransform) -> Request[Grip]:
        """Close the hand's jaw on the connector; the answer is what it holds then. It fails as `close` does."""
        finite_pose("the connector's pose", world_from_connector)

        def steps() -> Generator[None, None, Grip]:
            held = self.tool(self.hand).inv() * world_from_connector
            try:
                gap = yield from self._done(self.close(self.hand, 2 * self.known.cable.connector.radius))
            except GraspEmptyError:
                self._missed.append(held.inv().as_matrix())
                raise
            self._missed.clear()
            return Grip(gap, self.tool(self.hand).inv() * world_from_connector)

        return Request(steps())

    def watch_grip(self) -> GripWatch:
        """Begin to watch by the hand's pads whether it holds the connector."""
        return GripWatch(
            self.grippers[self.hand], 2 * self.known.cable.connector.radius, self.parameters.execution.jaw.grip.gap
        )

    def pull_out(self, plug: RigidTransform) -> MotionRequest:
        """Draw the gripped plug (world_from_connector) out along its axis, and then, where free, away from the panel.

        That is to -x.
        """
        finite_pose("the plug's pose", plug)
        values = self.parameters.unplug

        def steps() -> Iterator[None]:
            axis, held = plug.rotation.apply([1.0, 0.0, 0.0]), self.tool(self.hand).inv() * plug
            try:
                yield from self._done(self.shift(self.hand, -values.draw_out * axis, checked=False))
            except PlanningError as error:
                if error.code is not CauseCode.MOTION_BLOCKED:
                    raise
                self._on_anomaly(f"the plug is drawn out only in part: {error}")
            for share_of_way in values.retreat_shares:
                away = np.array([-share_of_way * values.retreat, 0.0, 0.0])
                try:
                    yield from self._done(self._shift_held(self.hand, away, held))
                except TouchError:
                    return
                except PlanningError:
                    continue
                return

        return self._together(self.hand, steps())

    def carry_to_clip(self, held: RigidTransform) -> MotionRequest:
        """Bring the held connector (tool_from_connector) before the clip, from where the hand can go in and back out.

        It fails with OUT_OF_REACH when no hand pose there is free.
        """
        finite_pose("the held connector's pose", held)
        seating = self.parameters.seating

        def steps() -> Iterator[None]:
            models = self.model(self.hand, held=self.held_spheres(held)), self._model_without_clip()
            seat = self.known.cable.clip.world_from_seat
            goals = poses_before(models, self.joints(self.hand), seat, held, seating.straight_in, seating)
            if not goals:
                message = "no free hand pose brings the held connector into the clip"
                raise PlanningError(CauseCode.OUT_OF_REACH, message)
            in_and_out = (seating.distance, seating.distance - self.parameters.retreats[0])
            onward = [RigidTransform.from_translation([x, 0.0, 0.0]) for x in in_and_out]
            yield from self._done(self.carry(self.hand, goals, held, onward=onward, speed=seating.speed_to))

        return self._together(self.hand, steps())

    @property
    def insertions(self) -> int:
        """How many different tries `insert` knows."""
        return len(self.parameters.seating.tries)

    def insert(self, held: RigidTransform, attempt: int = 0) -> MotionRequest:
        """Bring the held connector (tool_from_connector) straight into the clip, with the roll that turns it least.

        Each `attempt` after the first takes it to lie in the hand a little otherwise.
        """
        finite_pose("the held connector's pose", held)
        seating = self.parameters.seating
        lying = lying_otherwise(held, *seating.tries[attempt])

        def steps() -> Iterator[None]:
            goal = seated_pose(self.tool(self.hand), self.known.cable.clip.world_from_seat, lying, seating.fine_rolls)
            yield from self._done(self.straight(self.hand, goal, speed=seating.speed_in, pressing=True))

        return self._together(self.hand, steps())

    def pull_at_clip(self, held: RigidTransform) -> Request[Evidence]:
        """Pull the inserted connector (tool_from_connector) gently out of the clip.

        The answer says whether the clip holds it. Then the hand is back where it was, else before the clip.
        """
        finite_pose("the held connector's pose", held)
        kin, values = self.kinematics[self.hand], self.parameters.gentle_pull

        def steps() -> Generator[None, None, Evidence]:
            tool = self.tool(self.hand)
            out = across_the_cable(self.known, tool * held, tool.rotation.apply([-1.0, 0.0, 0.0]))

            def go(way: FloatArray) -> Generator[None, None, FloatArray]:
                pose = RigidTransform.from_components(tool.translation + way, tool.rotation)
                yield from self._done(self.straight(self.hand, pose, speed=values.speed, pressing=True))
                return self.arms[self.hand].reading().efforts

            def force(change: FloatArray) -> float:
                q = self.joints(self.hand)
                return -float(tool_force(kin, q, change, kin.tool(q).apply(held.translation)) @ out)

            pull = yield from pull_gently(lambda way: go(way * out), force, values)
            if pull.detected:
                yield from go(np.zeros(3))
            else:
                before = tool.apply([-self.parameters.seating.clear, 0.0, 0.0])
                way = before - self.tool(self.hand).translation
                yield from self._done(self._shift_held(self.hand, way, held))
            return pull

        return self._together(self.hand, steps())

    def let_go(self) -> MotionRequest:
        """Open the hand's jaw; done once it stands wider than a connector."""
        gap = 2 * self.known.cable.connector.radius + self.parameters.execution.jaw.slack
        return self.release(self.hand, gap)

    def draw_back(self) -> Request[str]:
        """Draw the hand straight back as far as is free. The answer is '', or why no distance was.

        What it held may still hang in the jaw: that it pulls is no touch.
        """

        def steps() -> Generator[None, None, str]:
            why = ""
            for distance in self.parameters.retreats:
                back = self.tool(self.hand).rotation.apply([-distance, 0.0, 0.0])
                try:
                    yield from self._done(self._shift(self.hand, back, contact=self._guard.pulling))
                except PlanningError as error:
                    why = str(error)
                else:
                    return ""
            return why

        return self._together(self.hand, steps())

    def leave_clip(self) -> MotionRequest:
        """Bring the hand to its sleep pose without sweeping the stowed end out of its clip."""
        return self._together(self.hand, self._sleep_clear_of(self.known.cable.clip.world_from_seat))

    def _sleep_clear_of(self, connector: RigidTransform) -> Iterator[None]:
        """Steps that bring the hand to its sleep pose clear of a connector at that place and of its cable."""
        points = connector_points(connector, self.known.cable.connector.length)
        self.keep_clear(np.vstack([points, cable_course(self.known, connector)]))
        yield from self._done(self.sleep(self.hand))
        self.keep_clear(NO_POINTS)

    def _model_without_clip(self) -> CollisionModel:
        return self.model(self.hand, without=self.known.cable.clip.bracket)

    def _room_to_draw_out(self, plug: RigidTransform) -> Callable[[Grasp], int]:
        """How a hand fares that draws out the plug (world_from_connector), by its grasp.

        0: it is free then, 1: it may be, 2: it meets something.
        """
        kin, out = self.kinematics[self.hand], np.eye(4)
        out[:3, 3] = -self.parameters.unplug.draw_out * plug.rotation.apply([1.0, 0.0, 0.0])
        gap, margin = 2 * self.known.cable.connector.radius, self.parameters.clearances.tight_margin
        models = [self.model(self.hand, opening=gap, optimistic=optimistic) for optimistic in (False, True)]

        def room(grasp: Grasp) -> int:
            ends = kin.ik(out @ grasp.pose)
            free = (any(model.free(q, margin) for q in ends) for model in models)
            return next((n for n, is_free in enumerate(free) if is_free), len(models))

        return room

    def _bracket_near(self, world_from_connector: RigidTransform) -> Collection[Box]:
        """The clip's bracket, which a hand may touch that takes the connector out of the clip, or no box elsewhere."""
        clip = self.known.cable.clip
        off = float(np.linalg.norm(world_from_connector.translation - np.array(clip.seat)))
        return clip.bracket if off < self.parameters.pick.jaw_reach else ()

    def _pick_connector(
        self,
        world_from_connector: RigidTransform,
        shallow: float,
        cable: FloatArray | None,
        point_cloud: PointCloudSource | None,
        order: Callable[[Grasp], int] | None = None,
    ) -> MotionRequest:
        connector_from_world, near = world_from_connector.inv().as_matrix(), self.parameters.same_grasp

        def missed(grasp: Grasp) -> bool:
            return any(_alike(connector_from_world @ grasp.pose, other, *near) for other in self._missed)

        return self._pick(
            self.hand,
            world_from_connector,
            self.known.cable.connector,
            shallow,
            cable,
            self._bracket_near(world_from_connector),
            point_cloud,
            missed if self._missed else order,
        )


def _alike(pose: FloatArray, other: FloatArray, distance: float, angle: float) -> bool:
    """Whether two poses (4, 4) are nearer than so many m and rad."""
    return bool(np.linalg.norm(pose[:3, 3] - other[:3, 3]) < distance) and angle_between(pose, other) < angle
