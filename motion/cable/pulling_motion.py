"""How an arm pulls at the cable: it brings the connector out of a place where no jaw gets round it."""

from collections.abc import Generator, Iterator, Sequence
from contextlib import suppress
from itertools import product

import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.transform import RigidTransform

from regrasp.interfaces.arguments import finite_pose
from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cause import CauseCode
from regrasp.interfaces.quote import arm_words
from regrasp.interfaces.request import Request
from regrasp.motion.cable.cable_section import CableSection, section_of_cable
from regrasp.motion.cable.cable_shape import cable_course
from regrasp.motion.cable.taking import TakingMotion
from regrasp.motion.failure import PlanningError, TouchError
from regrasp.motion.grasping.approach import pick_candidates


class PullingMotion(TakingMotion):
    """Takes hold of the cable of a connector that cannot be taken where it lies."""

    _been: list[FloatArray]  # where (3,) m the tool was that holds the cable
    _below: float  # m of cable and connector that hang from it

    def pull_cable(self, world_from_connector: RigidTransform) -> Request[str]:
        """Let an arm take hold of the cable near the loose connector, and lift it; the answer is the arm.

        It keeps hold. The request fails with NO_COLLISION_FREE_GOAL where no grasp of the cable is free either, and as
        `pick` and `close` do; then the arm sleeps.
        """
        finite_pose("the connector's pose", world_from_connector)

        def steps() -> Generator[None, None, str]:
            section = self._section()
            arm, place, pose = yield from self._grasp_of_cable(world_from_connector)
            try:
                yield from self._done(self.pick(arm, pose, section))
                yield from self._done(self.close(arm, 2 * section.radius))
            except PlanningError:
                yield from self._leave_cable(arm)
                raise
            yield from self._lift(arm, place)
            self._been, self._below = [self.tool(arm).translation], place + self.known.cable.connector.length
            return arm

        def stop() -> None:
            for arm in self.arms:
                self.execution.halt(arm)

        return Request(steps(), stop)

    def bring_cable(self, arm: str, world_from_connector: RigidTransform | None) -> Request[None]:
        """Bring what an arm holds of the cable to another place, where its end has room and may be taken.

        `world_from_connector` is where the connector hangs now, None where that is not known. The arm takes it along as
        it hangs. The request fails with NO_COLLISION_FREE_GOAL where no way leads to any place. A touch ends it.
        """
        if world_from_connector is not None:
            finite_pose("the connector's pose", world_from_connector)

        def steps() -> Iterator[None]:
            q = self.joints(arm)
            model, places = self.start_model(arm, optimistic=True), self._roomy_places(arm, world_from_connector)
            for some in self._takeable_first(arm, places, world_from_connector):
                yield
                if not len(some):
                    continue
                try:
                    path = self._plan(model, q, self._holding_at(arm, some))
                except PlanningError:
                    continue
                with suppress(TouchError):
                    yield from self._follow(arm, path, self.parameters.pulling.speed, model, self._guard.lifting)
                self._been.append(self.tool(arm).translation)
                return
            message = f"no way leads {arm_words(arm)} to another place with what it holds of the cable"
            raise PlanningError(CauseCode.NO_COLLISION_FREE_GOAL, message)

        return self._together(arm, steps())

    def _takeable_first(self, arm: str, places: FloatArray, connector: RigidTransform | None) -> Iterator[FloatArray]:
        """The places (n, 3) m in groups: one by one those where another arm can take the connector, then all.

        A group is empty where none is found in a tick.
        """
        values, now = self.parameters.pulling, self.tool(arm)
        if connector is not None:
            for place in places[: values.asked]:
                there = RigidTransform.from_components(place, now.rotation) * now.inv() * connector
                others = (other for other in self.arms if other != arm)
                found = any(
                    self._has_grasp(one, there, self._candidates(one, there), optimistic=True) for one in others
                )
                yield place[None] if found else places[:0]
        for first in range(0, len(places), values.at_once):
            yield places[first : first + values.at_once]

    def _roomy_places(self, arm: str, connector: RigidTransform | None) -> FloatArray:
        """Places (n, 3) m for the tool of an arm that holds the cable, those with the most room for its end first.

        Not where it was before, and no further from the cable's anchor than the cable reaches. An end of which nobody
        knows where it hangs is taken to hang down.
        """
        values, known, now = self.parameters.pulling, self.known.cable, self.tool(arm).translation
        grid = now + np.array([*product(values.onward, repeat=3)])
        near = np.linalg.norm(grid - known.anchor[0], axis=1) < known.length - (self._below - known.connector.length)
        fresh = np.linalg.norm(grid[:, None] - np.array(self._been)[None], axis=2).min(axis=1) > values.apart
        places = grid[near & fresh]
        seen = np.vstack([self._points, self._unseen])
        if not len(places) or not len(seen):
            return places
        shares, end = np.linspace(0.0, 1.0, 5)[:, None], np.array([0.0, 0.0, -self._below])
        if connector is not None:
            end = connector.apply([0.5 * known.connector.length, 0.0, 0.0]) - now
        to_seen = np.asarray(cKDTree(seen).query(places[:, None] + shares * end, distance_upper_bound=values.room)[0])
        room = np.minimum(to_seen, values.room).min(axis=1)
        return np.asarray(places[np.lexsort([np.linalg.norm(places - now, axis=1), -room.round(2)])])

    def let_go_of_cable(self, arm: str) -> Request[None]:
        """Open the jaw of an arm that holds the cable, and bring the arm to its sleep pose."""
        return self._together(arm, self._leave_cable(arm))

    def _section(self) -> CableSection:
        return CableSection(self.parameters.pulling.straight, self.known.cable.radius)

    def _grasp_of_cable(self, connector: RigidTransform) -> Generator[None, None, tuple[str, float, RigidTransform]]:
        """The arm, m along the cable and the section's pose (world_from_section) of the best free grasp of the cable.

        Through seen space rather than past it, then near the connector, then with another arm than the cell's hand:
        that takes the connector then.
        """
        section, hand = self._section(), self.known.cable.hand
        for optimistic in (False, True):
            for place in self.parameters.pulling.places:
                pose = section_of_cable(cable_course(self.known, connector, 0.005), place)
                for arm in sorted(self.arms, key=lambda arm: arm == hand):
                    yield
                    widest = self.known.arm(arm).robot.gripper.opening
                    candidates = pick_candidates(pose, section, 0.0, widest, self.parameters.pick)
                    if self._has_grasp(arm, pose, candidates, optimistic):
                        return arm, place, pose
        ends = f"{self.parameters.pulling.places[0]:.2f} to {self.parameters.pulling.places[-1]:.2f} m"
        message = f"no grasp of the cable is free, {ends} from the connector"
        raise PlanningError(CauseCode.NO_COLLISION_FREE_GOAL, message)

    def _lift(self, arm: str, place: float) -> Iterator[None]:
        """Lift what is held `place` m along the cable, as far as the cable reaches and a way is free.

        A touch ends it: what is lifted in part, or falls from there, may lie where it can be taken.
        """
        values, tool = self.parameters.pulling, self.tool(arm)
        # The closed jaw bends the cable and may press on what lies beside it. Loosen it before a touch can be felt.
        with suppress(PlanningError):
            yield from self._done(self._shift(arm, [0.0, 0.0, values.loose], contact=self._guard.pressing))
        for lift in values.lifts:
            try:
                model, q = self.start_model(arm, optimistic=True), self.joints(arm)
                path = self._plan(model, q, self._lifted(arm, tool, lift, self.known.cable.length - place))
                yield from self._follow(arm, path, self.parameters.pulling.speed, model, self._guard.lifting)
                return
            except TouchError:
                return
            except PlanningError:
                yield

    def _lifted(self, arm: str, tool: RigidTransform, lift: float, reach: float) -> FloatArray:
        """Joint angles (n, joints) that hold the tool (world_from_tool) `lift` m higher, and aside of it.

        No further than `reach` m from the cable's anchor, and with the jaw turned as it is all the way there.
        """
        values, anchor = self.parameters.pulling, self.known.cable.anchor[0]
        places = [np.add(tool.translation, [x, y, lift]) for x, y in product(values.aside, repeat=2)]
        return self._holding_at(arm, [place for place in places if np.linalg.norm(place - anchor) < reach])

    def _holding_at(self, arm: str, places: Sequence[FloatArray] | FloatArray) -> FloatArray:
        """Joint angles (n, joints) that hold the tool at these places (m) with the jaw turned as it is."""
        q, turned = self.joints(arm), self.tool(arm).rotation
        goals = [RigidTransform.from_components(place, turned) for place in places]
        ends = self.kinematics[arm].ik_of_all(goals, q)
        return ends[np.abs(ends - q).max(axis=1) < self.parameters.pulling.turn]

    def _leave_cable(self, arm: str) -> Iterator[None]:
        """Open a jaw, draw it straight back as far as is free, and bring the arm to its sleep pose."""
        yield from self._done(self.release(arm, 2 * self._section().radius + self.parameters.execution.jaw.slack))
        yield from self._draw_back(arm)
        yield from self._done(self.sleep(arm, pulling=True))
