"""How an arm pulls at the cable: it brings the connector out of a place where no jaw gets round it."""

from collections.abc import Generator, Iterator
from contextlib import suppress
from itertools import product

import numpy as np
from scipy.spatial.transform import RigidTransform

from regrasp.interfaces.arguments import finite_pose
from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cause import CauseCode
from regrasp.interfaces.request import Request
from regrasp.motion.cable.cable_section import CableSection, section_of_cable
from regrasp.motion.cable.cable_shape import cable_course
from regrasp.motion.cable.taking import TakingMotion
from regrasp.motion.failure import PlanningError, TouchError
from regrasp.motion.grasping.approach import pick_candidates


class PullingMotion(TakingMotion):
    """Takes hold of the cable of a connector that cannot be taken where it lies."""

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
            return arm

        def stop() -> None:
            for arm in self.arms:
                self.execution.halt(arm)

        return Request(steps(), stop)

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
                yield from self._follow(arm, path, self._pace(True), model, self._guard.pulling)
                return
            except TouchError:
                return
            except PlanningError:
                yield

    def _lifted(self, arm: str, tool: RigidTransform, lift: float, reach: float) -> FloatArray:
        """Joint angles (n, joints) that hold the tool (world_from_tool) `lift` m higher, and aside of it.

        No further than `reach` m from the cable's anchor, and with the jaw turned as it is all the way there.
        """
        values, q = self.parameters.pulling, self.joints(arm)
        kin, anchor = self.kinematics[arm], self.known.cable.anchor[0]
        places = [np.add(tool.translation, [x, y, lift]) for x, y in product(values.aside, repeat=2)]
        near = [place for place in places if np.linalg.norm(place - anchor) < reach]
        goals = [RigidTransform.from_components(place, tool.rotation) for place in near]
        ends = kin.ik_of_all(goals, q)
        return ends[np.abs(ends - q).max(axis=1) < values.turn]

    def _leave_cable(self, arm: str) -> Iterator[None]:
        """Open a jaw, draw it straight back as far as is free, and bring the arm to its sleep pose."""
        yield from self._done(self.release(arm, 2 * self._section().radius + self.parameters.execution.jaw.slack))
        yield from self._draw_back(arm)
        yield from self._done(self.sleep(arm, pulling=True))
