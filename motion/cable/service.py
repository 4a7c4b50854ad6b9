"""What the cable's leaves ask of the arms: unplug, carry, insert, let go, and look for a lost end."""

from collections.abc import Collection, Generator, Iterator, Sequence
from contextlib import suppress
from functools import partial
from typing import TypeVar

import numpy as np
from scipy.spatial.transform import RigidTransform

from regrasp.interfaces.arguments import finite_pose
from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cause import CauseCode
from regrasp.interfaces.cell import Box
from regrasp.interfaces.evidence import Evidence
from regrasp.interfaces.request import Request
from regrasp.motion.cable.cable_shape import cable_course, connector_points
from regrasp.motion.cable.gentle_pull import across_the_cable, pull_gently
from regrasp.motion.cable.pulling_motion import PullingMotion
from regrasp.motion.cable.seating import lying_otherwise, poses_before, seated_pose
from regrasp.motion.failure import PlanningError, TouchError
from regrasp.motion.grasping.approach import pick_candidates
from regrasp.motion.planning.straight import straight_lines
from regrasp.motion.request import MotionRequest
from regrasp.motion.robots.contact_guard import ContactLimits
from regrasp.motion.robots.tool_force import tool_force
from regrasp.motion.scene.planning_scene import NO_POINTS

T = TypeVar("T")


class CableMotion(PullingMotion):
    """Requests to the arm that handles the cable, the hand, and to the one that carries the camera that searches."""

    def warm_up(self) -> None:
        """Look for a grasp of the plugged connector, check its cable, and drop both.

        The compiled functions of a pick and of carrying are then loaded now, and no tick waits for it.
        """
        super().warm_up()
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

    def pull_out(self, plug: RigidTransform) -> MotionRequest:
        """Draw the gripped plug (world_from_connector) out along its axis, and then move the hand back as it came."""
        finite_pose("the plug's pose", plug)
        values = self.parameters.unplug

        def steps() -> Iterator[None]:
            axis, held = plug.rotation.apply([1.0, 0.0, 0.0]), self.tool(self.hand).inv() * plug
            way = next(filter(partial(self._free_along, -axis), values.draw_outs), values.draw_outs[-1])
            try:
                yield from self._done(self.shift(self.hand, -values.loose * axis, checked=False))
                if way > values.loose:
                    rest, limits = (values.loose - way) * axis, self._along_cable(self._guard.drawing, held)
                    yield from self._done(self._shift(self.hand, rest, checked=False, contact=limits))
            except PlanningError as error:
                if error.code is not CauseCode.MOTION_BLOCKED:
                    raise
                self._on_anomaly(f"the plug is drawn out only in part: {error}")
            back = -self.tool(self.hand).rotation.apply([1.0, 0.0, 0.0])
            for share_of_way in values.retreat_shares:
                away = share_of_way * values.retreat * back
                try:
                    yield from self._done(self._shift_held(self.hand, away, held))
                except TouchError:
                    return
                except PlanningError:
                    continue
                return

        return self._together(self.hand, steps())

    def _free_along(self, direction: FloatArray, way: float) -> bool:
        """Whether the hand can go `way` m straight in a direction (3,) and come hardly nearer to anything."""
        kin, q, clearances = self.kinematics[self.hand], self.joints(self.hand), self.parameters.clearances
        goal = kin.tool_matrix(q)
        goal[:3, 3] += way * direction
        path, model = straight_lines(kin, q, [goal]), self.model(self.hand)
        return path is not None and model.path_free(path[1:], min(model.clearance(q) - clearances.nearer, 0.0))

    def carry_to_clip(self, held: RigidTransform, *, forced: bool = True) -> MotionRequest:
        """Bring the held connector (tool_from_connector) before the clip, from where the hand can go in and back out.

        It fails with OUT_OF_REACH when no hand pose there is free, and unless `forced` also when its cable would have
        to be bent by force. After any failure the arm takes the connector with such a grasp only where it has no other.
        """
        finite_pose("the held connector's pose", held)
        seating = self.parameters.seating

        def steps() -> Iterator[None]:
            spheres, clip, q = self.held_spheres(held), self.known.cable.clip, self.joints(self.hand)
            for optimistic in (False, True):
                models = (
                    self.model(self.hand, held=spheres, optimistic=optimistic),
                    self.model(self.hand, without=clip.bracket, optimistic=optimistic),
                )
                goals = poses_before(models, q, clip.world_from_seat, held, seating.straight_in, seating)
                goals = self._within_cable(goals, held) or goals
                if onward := self._onward(self.hand, models[0], goals):
                    break
            else:
                message = "no free hand pose brings the held connector into the clip"
                raise PlanningError(CauseCode.OUT_OF_REACH, message)
            yield from self._done(
                self.carry(self.hand, goals, held, onward=onward, speed=seating.speed_to, forced=forced)
            )

        def noting_in_vain() -> Iterator[None]:
            try:
                yield from steps()
            except PlanningError:
                self._vain[self.hand].append(held.inv().as_matrix())
                raise

        return self._together(self.hand, noting_in_vain())

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
                # The way in was free, whatever the map says of it since.
                before = tool.apply([-self.parameters.seating.clear, 0.0, 0.0])
                way = before - self.tool(self.hand).translation
                limits = self._along_cable(self._guard.pulling, held)
                yield from self._done(self._shift(self.hand, way, checked=False, contact=limits))
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

        return self._together(self.hand, self._draw_back(self.hand))

    def leave_clip(self) -> MotionRequest:
        """Bring the hand to its sleep pose without sweeping the stowed end out of its clip."""
        return self._together(self.hand, self._sleep_clear_of(self.known.cable.clip.world_from_seat))

    def _sleep_clear_of(self, connector: RigidTransform) -> Iterator[None]:
        """Steps that bring the hand to its sleep pose clear of a connector at that place and of its cable."""
        points = connector_points(connector, self.known.cable.connector.length)
        self.keep_clear(np.vstack([points, cable_course(self.known, connector)]))
        yield from self._done(self.sleep(self.hand))
        self.keep_clear(NO_POINTS)
