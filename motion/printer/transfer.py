"""Motions with the printed part in the hand: out of the printer, into the clamp, off its plate, and to the tray."""

from collections.abc import Collection, Generator, Iterator, Sequence

import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation

from regrasp.interfaces.arguments import finite, not_negative, positive, vector
from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cause import CauseCode
from regrasp.interfaces.cell import WristMount
from regrasp.interfaces.printer.cause import PrinterCause
from regrasp.interfaces.quote import nearest, quoted
from regrasp.interfaces.request import Request
from regrasp.motion.failure import NO_WAY, GraspEmptyError, PlanningError, TouchError
from regrasp.motion.grasping.gap_test import GripWatch
from regrasp.motion.planning.straight import straight_lines
from regrasp.motion.printer.held_box import HeldBox
from regrasp.motion.printer.service import TO_THE_PRINTER, PrinterMotion
from regrasp.motion.request import MotionRequest


class TransferMotion(PrinterMotion):
    """Carries the part, with or without its plate. What the hand holds counts as a part of the arm."""

    def held_goal(self, arm: str, name: str, place: FloatArray) -> RigidTransform:
        """world_from_tool with which the held thing of this name has its middle at a place (3,) m.

        It is turned there as it was when the hand took it.

        Raises:
            ValueError: the hand is not believed to hold such a thing.
        """
        there = RigidTransform.from_translation(vector("the place", place))
        return there * self._held_thing(arm, name).tool_from_box.inv()

    def look_at(self, arm: str, place: Sequence[float], distance: float, pitch: float) -> Request[None]:
        """Bring the camera `distance` m before a place (3,) m; the hand points to the printer's side, and down.

        By `pitch` rad, or where no such pose is free, by the next of `look_turns` more. Fails as `carry` does.
        """
        vector("the place", place)

        def steps() -> Iterator[None]:
            for more in self.parameters.look_turns:
                goal = self._look_goal(arm, np.array(place), distance, pitch + more)
                try:
                    yield from self._done(self.carry(arm, goal))
                except PlanningError as error:
                    if error.code not in (*NO_WAY, CauseCode.OUT_OF_REACH) or isinstance(error, TouchError):
                        raise
                    failed = error
                else:
                    return
            raise failed

        return self._together(arm, steps())

    def _look_goal(self, arm: str, place: FloatArray, distance: float, pitch: float) -> RigidTransform:
        """world_from_tool whose camera looks at a place (3,) m from `distance` m before it, `pitch` rad downwards."""
        kin, mount = self.kinematics[arm], self.known.camera(self.known.printer.camera).mount
        assert isinstance(mount, WristMount)
        joints = self.joints(arm)
        tool_from_camera = kin.tool(joints).inv() * kin.mount(joints) * mount.mount_from_camera
        turn = TO_THE_PRINTER * Rotation.from_rotvec([0.0, positive("the pitch", pitch), 0.0])
        before = tool_from_camera.apply([0.0, 0.0, positive("the distance", distance)])
        return RigidTransform.from_components(place - turn.apply(before), turn)

    def draw_out(self, arm: str, distance: float) -> Request[None]:
        """Draw the part that the hand holds straight back, with its plate, by `distance` m.

        Part and plate then count as held. Fails with PLATE_STUCK when the plate resists with more than `stuck_force`,
        with GRASP_EMPTY when the hand loses them, and as `shift` does. In the first two cases all counts as where it
        was in the printer, and in the first the jaw lets go.
        """
        way = self.tool(arm).rotation.apply([-positive("the distance", distance), 0.0, 0.0])
        spared = self.things(["plate_bed"])

        def steps() -> Iterator[None]:
            stood, section = [*self._fixed], self._section
            if not self._held.get(arm):  # else it goes on where it was stopped
                self.believe_held(arm, ("plate", "part", "section"))
            request = self._shift(arm, way, without=spared, contact=self._guard.drawing)
            try:
                yield from self._unless_stuck(arm, request, way / distance)
            except PlanningError as error:
                if error.code == PrinterCause.PLATE_STUCK or isinstance(error, GraspEmptyError):
                    self._held[arm], self._fixed, self._section = [], stood, section
                    self.believe_door(self.door_opening)
                raise

        return self._together(arm, steps())

    def _unless_stuck(self, arm: str, request: MotionRequest, direction: FloatArray) -> Iterator[None]:
        """Pull the plate out in a direction (3,) by a request; raises PLATE_STUCK if it does not come."""
        values, begin = self.parameters, self.tool(arm).translation
        for _ in self._holding(arm, request):
            gone, pull = (self.tool(arm).translation - begin) @ direction, -self._force_on(arm) @ direction
            if gone > values.stuck_after and pull > values.stuck_force:
                request.cancel()
                break
            yield
        else:
            return
        while self.arms[arm].is_moving():
            yield
        yield from self.execution.set_jaw(arm, self.known.printer.part.section.size[1] + values.opening_steps[-1])
        why = f"the plate does not come: it resists with {pull:.0f} N after {1e3 * gone:.0f} mm"
        raise PlanningError(PrinterCause.PLATE_STUCK, why)

    def carry(
        self, arm: str, goal: RigidTransform, onward: Collection[RigidTransform] = (), may_touch: Collection[str] = ()
    ) -> Request[None]:
        """Bring the tool with what it holds to a pose, from which it must go on straight to `onward` (goal_from_tool).

        Fails with GRASP_EMPTY when the hand loses what it holds, and as `move_tool` does.
        """
        spared = self.things(may_touch)
        request = self.move_tool(arm, goal, onward=list(onward), may_touch=spared)
        return self._together(arm, self._holding(arm, request))

    def move_held(self, arm: str, way: FloatArray, may_touch: Collection[str]) -> Request[None]:
        """Bring what the hand holds straight on by (3,) m; it may touch the things of these names, and its plate.

        Fails with GRASP_EMPTY when the hand loses what it holds, and as `shift` does.
        """
        spared = self.things([*may_touch, *(box.name for box in self._boxes if box.name == "plate")])
        request = self._shift(arm, vector("the way", way), without=spared, contact=self._guard.drawing)
        return self._together(arm, self._holding(arm, request))

    def holds(self, arm: str, thickness: float) -> bool:
        """Whether the pads stand as far apart as a thing of `thickness` m asks for that they hold."""
        gap, slack = self.grippers[arm].reading().gap, self.parameters.execution.jaw.grip.gap.tolerance
        return thickness - slack < gap < 2.0 * thickness

    def believe_lost(self, arm: str) -> None:
        """The hand has lost what it held: each thing is taken to be where the hand lost it, from now on."""
        held = {thing.box.name: thing for thing in self._held.get(arm, [])}
        if "section" in held:
            section = self.tool(arm) * held["section"].tool_from_box
            self._section = RigidTransform.from_components(section.translation, self.tool(arm).rotation)
        self.believe_placed(arm, held)

    def grip_part(self, arm: str) -> Request[float]:
        """Close the jaw on the section between the pads, and give way to it; the part then counts as held.

        Gently first: the finger that comes first presses on a part that is bonded to a clamped plate. The answer is the
        gap (m) between the pads. It fails as `close` does.
        """
        values, thickness = self.parameters, self.known.printer.part.section.size[1]

        def steps() -> Generator[None, None, float]:
            self.believe_lost(arm)
            yield from self._grip(arm, thickness, values.twist_force)
            self.believe_held(arm, ("part", "section"))
            return self.grippers[arm].reading().gap

        return self._together(arm, steps())

    def floats(self, arm: str) -> bool:
        """Whether what the hand lets go floats: there is no gravity."""
        return float(np.linalg.norm(self.arms[arm].gravity())) < self.parameters.no_gravity

    def release_part(self, arm: str, gap: float) -> Request[None]:
        """Open the jaw to `gap` m; what it held then counts as lying where it is.

        Where there is no gravity it presses softly before that, and opens in small steps: pads that spring off a part
        that floats push it away. Where there is some, a part that is held softly would slip.
        """
        values, thickness = self.parameters, self.known.printer.part.section.size[1]
        not_negative("the gap", gap)

        def steps() -> Iterator[None]:
            if self.floats(arm):
                yield from self.execution.press_jaw(arm, values.soft_force)
                for wider in values.opening_steps:
                    yield from self.execution.set_jaw(arm, min(thickness + wider, gap))
            yield from self.execution.set_jaw(arm, gap)
            self.believe_lost(arm)

        return self._together(arm, steps())

    def twist(self, arm: str, angle: float) -> Request[None]:
        """Turn the held part by an angle (rad) about the upright axis through its middle, and back.

        Its plate is clamped: the bond between the two bears the twist, and breaks. Fails with BOND_HOLDS where the part
        turns back with more than `twist_limit`: the pads would wedge on its section, and slide off it.
        """
        finite("the angle", np.array([angle]))

        def steps() -> Iterator[None]:
            tool, limit = self.tool(arm), self.parameters.twist_limit
            middle = RigidTransform.from_translation(self._held_thing(arm, "part").placed(tool).center)
            angles = np.linspace(0.0, angle, self.parameters.twist_steps + 1)
            turns = [RigidTransform.from_rotation(Rotation.from_rotvec([0.0, 0.0, a])) for a in angles]
            arc = [(middle * turn * middle.inv() * tool).as_matrix() for turn in turns]
            moment = 0.0
            for _ in self._turned(arm, arc):
                moment = self._moment_about(arm, middle.translation)
                if abs(moment) > limit:
                    self.execution.halt(arm)
                    break
                yield
            while self.arms[arm].is_moving():
                yield
            yield from self._turned(arm, arc[:1] if abs(moment) > limit else arc[::-1])
            if abs(moment) > limit:
                why = f"the part turns back with {abs(moment):.1f} N m (at most {limit:g} N m)"
                raise PlanningError(PrinterCause.BOND_HOLDS, why)

        return self._together(arm, steps())

    def _turned(self, arm: str, poses: list[FloatArray]) -> Iterator[None]:
        """Steps along straight lines through poses (4, 4) of the tool, which turns the part."""
        path = straight_lines(self.kinematics[arm], self.joints(arm), poses)
        if path is None:
            raise PlanningError(CauseCode.OUT_OF_REACH, "the arm cannot turn the part so far")
        speed = self.parameters.approach_speed
        yield from self._follow(arm, path, speed, self.model(arm), self._guard.pressing)

    def _held_thing(self, arm: str, name: str) -> HeldBox:
        held = {thing.box.name: thing for thing in self._held.get(arm, [])}
        if name not in held:
            raise ValueError(f"the hand holds no {quoted(name)}; {nearest(name, held) if held else 'it holds nothing'}")
        return held[name]

    def _holding(self, arm: str, request: MotionRequest) -> Iterator[None]:
        """Do a request with what the hand holds. Raises GraspEmptyError when the hand loses it."""
        watch = GripWatch(
            self.grippers[arm], self.known.printer.part.section.size[1], self.parameters.execution.jaw.grip.gap
        )
        while not request.poll():
            if (evidence := watch.evidence()).detected:
                request.cancel()
                raise GraspEmptyError(f"the hand lost the part: {evidence.sentence}")
            yield
