"""Motions at a printer: to the handle of its door, and with it."""

from collections.abc import Callable, Collection, Generator, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation

from regrasp.interfaces.arguments import finite, finite_pose, not_negative, positive, rows, share
from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cause import CauseCode
from regrasp.interfaces.cell import Box, WristMount
from regrasp.interfaces.devices import Arm, Clock, Gripper
from regrasp.interfaces.frame import RgbdFrame
from regrasp.interfaces.printer.actions import PART_AND_BED
from regrasp.interfaces.printer.cell import PrinterKnown
from regrasp.interfaces.printer.target import TargetTracker
from regrasp.interfaces.quote import arm_words, near_words, nearest, quoted
from regrasp.interfaces.request import Request
from regrasp.motion.failure import NO_WAY, GraspEmptyError, PlanningError, StoppedShortError, TouchError
from regrasp.motion.grasping.gap_test import GripWatch
from regrasp.motion.printer.held_box import HeldBox
from regrasp.motion.printer.servoing import Servo, ServoParameters
from regrasp.motion.request import MotionRequest
from regrasp.motion.robots.tool_force import tool_force, tool_wrench
from regrasp.motion.scene.collision import CollisionModel
from regrasp.motion.service import Motion, MotionParameters

_CLOSED = object()  # the end of the steps that close a jaw
# world_from_tool of a hand that points along -x, with its fingers to the left and right of what it takes
TO_THE_PRINTER = Rotation.from_matrix([[-1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0]])


@dataclass(frozen=True)
class PrinterMotionParameters(MotionParameters):
    """Those of every task, of the door, and of the part."""

    straight_margin: float = 0.004  # the arm is off by 2 mm and its rail by 1 mm; what it takes has things close by
    slide_speed: float = 0.2  # share of the rail's speed with the door in hand; choice
    slide_samples: int = 50  # of the way with the door, among which the one nearest to a thing is told; choice
    end_stop: float = 0.02  # m before a slide's goal from which a door that is blocked has come to its stop; choice
    # share of the joints' greatest efforts that is a touch on a slide: the pads came forward as the jaw closed, and
    # strain the arm along the hand by up to 50 N, until the handle slides between them (seeds 605, 670, 672, 711)
    slide_share: float = 0.8
    back_shares: tuple[float, ...] = (1.0, 0.6, 0.3)  # of the way back, the first that is free; choice
    blocked: float = 30.0  # N across with which a door presses that goes no further; choice: it takes 8 N to slide
    relieved: float = 6.0  # N across that may be left when a hand has given way to what it holds; choice
    give: float = 2e-5  # m that it gives way for each N across, and ...
    most_give: float = 0.001  # m at most at once; choice: the arm is off by 2 mm
    gives: int = 10  # times at most
    relieved_moment: float = 0.08  # N m about the upright axis that may be left; choice: a bond bears 0.6
    turn_give: float = 0.002  # rad that a hand turns at once; choice: pads stand up to half a degree askew
    give_time: float = 0.1  # s until the efforts are read again
    first_force: float = 8.0  # N a finger at first: the finger that comes first pushes a part whose bond bears a twist
    # of 0.6 N m, 25 mm off its axis; choice
    part_force: float = 21.0  # N a finger; with 16 N the pads slide off the section of a plate that sticks with 15 N
    # A plate that does not come out: pads that slide off its part's section twist the part off it (seeds 7, 736, 750).
    # One that comes is drawn with 3 N; the pads bear 17 N.
    stuck_force: float = 10.0  # N that a plate resists with ...
    stuck_after: float = 0.004  # m that the hand has gone; choice: a catch lets go after 2 mm
    twist_force: float = 40.0  # N a finger: pads 22 mm deep turn with 0.9 N m at most, and the bond bears 0.6; choice
    no_gravity: float = 0.5  # m/s2 below which what is let go floats
    # N a finger before the hand lets go of what floats. With 3 N askew pads pushed it off with 0.7 mm/s (seed 882).
    soft_force: float = 1.0
    opening_steps: tuple[float, ...] = (0.001, 0.003, 0.006)  # m wider than the section that it opens at first; choice
    twist_steps: int = 4  # straight lines that stand for the arc: of 40 degrees 25 mm out it is 0.1 mm off
    # N m about the bond's axis that are enough: it bears 0.6, and from 1.1 on the pads wedged on the section (seed 3)
    twist_limit: float = 0.9
    servo: ServoParameters = field(default_factory=ServoParameters)
    look_turns: tuple[float, ...] = (0.0, 0.2, -0.2, 0.4)  # rad further down, the first that is free; choice
    sphere_spacing: float = 0.016  # m between the spheres that stand for what the hand holds; choice


class PrinterMotion(Motion):
    """Moves an arm on a rail, and the door with it. The arm keeps clear of the door where it believes it to stand."""

    parameters: PrinterMotionParameters
    known: PrinterKnown

    def __init__(
        self,
        known: PrinterKnown,
        arms: Mapping[str, Arm],
        grippers: Mapping[str, Gripper],
        clock: Clock,
        seed: int,
        parameters: PrinterMotionParameters = PrinterMotionParameters(),
        on_anomaly: Callable[[str], None] = lambda sentence: None,
    ) -> None:
        super().__init__(known, arms, grippers, clock, seed, parameters, on_anomaly)
        self._fixed, self._door = [*self._boxes, *known.printer.fixtures()], known.printer.door
        self._held: dict[str, list[HeldBox]] = {}  # by arm
        section = known.printer.part.section
        self._section = RigidTransform.from_components(section.center, TO_THE_PRINTER)  # where it is believed to be
        self.part_speed = 0.0  # m/s, as the servo saw it last
        self._half_section = 0.5 * section.size[0]
        self._off, self._slid = np.zeros(3), False  # m from where the handle should be on the door; was it pulled?
        self.believe_door(known.printer.door.opening)

    def believe_door(self, opening: float) -> None:
        """Keep clear of the door as it stands `opening` m open, from now on."""
        self.door_opening = float(np.clip(opening, 0.0, self._door.travel))
        self._boxes = [*self._fixed, *self._parts()]

    def handle(self, opening: float, before: float = 0.0) -> RigidTransform:
        """world_from_tool of a hand that takes the handle of a door that stands `opening` m open.

        Or `before` m before that, along the hand.
        """
        _, handle = self._door.parts(opening)
        place = np.array(handle.center) + self._off - TO_THE_PRINTER.apply([before, 0.0, 0.0])
        return RigidTransform.from_components(place, TO_THE_PRINTER)

    def believe_handle(self, place: FloatArray) -> FloatArray:
        """Take the handle to be at a place (3,) m, of which only y and z count; returns how far (3,) m it was off.

        Before the door was moved that is told of the handle's place on the door, later of where the door stands.
        """
        off = np.array([0.0, *(finite("the handle's place", place) - self.handle(self.door_opening).translation)[1:]])
        if self._slid:
            self.believe_door(self.door_opening + off[1])
        else:
            self._off = self._off + off
            self.believe_door(self.door_opening)
        return off

    def believe_part(self, section: RigidTransform, moved: Collection[str] = ("part", "section")) -> None:
        """Take the part's gripping section to be at a pose, from now on, and the things `moved` as far off as it."""
        self._section = section
        off = section.translation - self.things(["section"])[0].center
        for box in self.things(moved):
            moved = tuple((np.array(box.center) + off).tolist())
            self._fixed[self._fixed.index(box)] = box.model_copy(update={"center": moved})
        self.believe_door(self.door_opening)

    def believe_held(self, arm: str, names: Collection[str]) -> None:
        """The hand holds the things of these names as they lie now: they go with it, and count as a part of the arm.

        Raises:
            ValueError: there is no thing of such a name.
        """
        tool = self.tool(arm)
        for box in self.things(names):
            self._fixed.remove(box)
            pose = tool.inv() * RigidTransform.from_translation(box.center)
            self._held.setdefault(arm, []).append(HeldBox(box, pose, self.parameters.sphere_spacing))
        self.believe_door(self.door_opening)

    def believe_placed(self, arm: str, names: Collection[str]) -> None:
        """What the hand held of these things stays where it is now: the arm keeps clear of the box about each."""
        tool, held = self.tool(arm), self._held.get(arm, [])
        self._held[arm] = [thing for thing in held if thing.box.name not in names]
        self._fixed += [thing.placed(tool) for thing in held if thing.box.name in names]
        self.believe_door(self.door_opening)

    def model(self, arm: str, *, held: FloatArray | None = None, **options: Any) -> CollisionModel:
        """See `PlanningScene.model`; what the hand is believed to hold goes with it."""
        if held is None and self._held.get(arm):
            held = np.vstack([thing.spheres for thing in self._held[arm]])
        return super().model(arm, held=held, **options)

    def _parts(self) -> tuple[Box, Box]:
        """The door and its handle as believed."""
        panel, handle = self._door.parts(self.door_opening)
        return panel, handle.model_copy(update={"center": tuple((np.array(handle.center) + self._off).tolist())})

    def things(self, names: Collection[str]) -> list[Box]:
        """The boxes of these names that the arm keeps clear of, where they are believed to be.

        Raises:
            ValueError: there is none of such a name.
        """
        there = {box.name: box for box in self._boxes}
        for name in names:
            if name not in there:
                raise ValueError(f"no thing {quoted(name)}; {nearest(name, there)}")
        return [there[name] for name in names]

    def move_rail(self, arm: str, position: float) -> MotionRequest:
        """Bring an arm's rail to a position (m along it), and let the arm's other joints stand.

        Fails with OUT_OF_REACH past the rail's ends or for an arm without a rail, and as `move` does.
        """
        finite("the rail's position", position)

        def steps() -> Iterator[None]:
            yield from self._move_steps(arm, self._with_rail(arm, position)[None])

        return self.execution.request(arm, steps())

    def move_joints(self, arm: str, angles: Sequence[float] | FloatArray) -> MotionRequest:
        """Bring an arm's joints to angles (n,) rad along a free path, and let its rail stand."""
        first = int(self.kinematics[arm].robot.rail is not None)
        (goal,) = rows("the angles", angles, len(self.kinematics[arm]) - first)

        def steps() -> Iterator[None]:
            yield from self._move_steps(arm, np.append(self.joints(arm)[:first], goal)[None])

        return self.execution.request(arm, steps())

    def move_jaw(self, arm: str, gap: float, force: float | None = None) -> MotionRequest:
        """Bring the pads `gap` m from each other, or with a force (N a finger) close them on what is between them.

        Fails with OUT_OF_REACH for a gap or a force that the gripper has not, with GRASP_EMPTY where nothing is between
        the pads that shall press, and as `Execution.set_jaw` does.
        """
        gripper = self.kinematics[arm].robot.gripper
        not_negative("the gap", gap)

        def steps() -> Iterator[None]:
            if force is not None:
                if force > gripper.force:
                    message = f"a finger presses with up to {gripper.force:g} N, asked for {force:g} N"
                    raise PlanningError(CauseCode.OUT_OF_REACH, message)
                yield from self.execution.press_jaw(arm, force)
                stands, slack = self.grippers[arm].reading().gap, self.parameters.execution.jaw.tolerance
                if stands < gripper.closed + slack:
                    raise GraspEmptyError(f"nothing is between the pads: they stand {1e3 * stands:.1f} mm apart")
                return
            if not gripper.closed <= gap <= gripper.opening:
                span = f"{1e3 * gripper.closed:g} to {1e3 * gripper.opening:g} mm"
                message = f"the jaw opens from {span}, asked for {1e3 * gap:g} mm"
                raise PlanningError(CauseCode.OUT_OF_REACH, message)
            yield from self.execution.set_jaw(arm, gap)

        return self.execution.request(arm, steps())

    def reach(
        self,
        arm: str,
        goal: RigidTransform,
        standoff: float = 0.0,
        may_touch: Collection[str] = (),
        onward: Sequence[RigidTransform] = (),
    ) -> Request[None]:
        """Bring the tool along a free path `standoff` m before a pose (world_from_tool), then straight into it.

        On straight ways the arm may touch the things named in `may_touch`, such as what its fingers come round. The arm
        takes joints from which it can go on in straight lines to the poses `onward` (goal_from_tool).
        """
        finite_pose("the tool's pose", goal)
        way = RigidTransform.from_translation([not_negative("the standoff", standoff), 0.0, 0.0])
        spared = self.things(may_touch)

        def steps() -> Iterator[None]:
            after = [way, *(way * pose for pose in onward)] if standoff else list(onward)
            yield from self._done(self.move_tool(arm, goal * way.inv(), onward=after, may_touch=spared))
            if standoff:
                displacement = goal.translation - self.tool(arm).translation
                yield from self._done(self.shift(arm, displacement, without=spared))

        return self._together(arm, steps())

    def _shift(self, arm: str, *args: Any, **options: Any) -> MotionRequest:
        """See `Motion`. A place that was felt and bars the line is forgotten: it is known to centimetres only."""

        def shift() -> MotionRequest:
            return super(PrinterMotion, self)._shift(arm, *args, **options)

        def steps() -> Iterator[None]:
            try:
                yield from self._done(shift())
            except PlanningError as error:
                barred = error.code is CauseCode.MOTION_BLOCKED
                if not barred or isinstance(error, (TouchError, StoppedShortError)) or not self.forget_felt():
                    raise
                yield from self._done(shift())

        return self._together(arm, steps())

    def servo(self, arm: str, target: TargetTracker, before: float) -> MotionRequest:
        """Bring the tool `before` m before a target by what is seen of it on the way, and turn it as the target is.

        Fails with TARGET_NOT_SEEN, TARGET_TOO_FAST, TIMED_OUT, OUT_OF_REACH or MOTION_BLOCKED, and as `straight` does.
        """
        not_negative("the distance before the target", before)

        def steps() -> Iterator[None]:
            start = self.execution.standing(arm)
            model = self.model(arm, without=self.things(PART_AND_BED))
            kin = self.kinematics[arm]
            servo = Servo(kin, start, target, before, self._clock, model, self.parameters.servo)
            self.part_speed = 0.0
            yield from self.execution.stream(
                arm, servo.trajectories(lambda: kin.tool_matrix(self.joints(arm))), self._guard.free
            )
            self.part_speed = servo.target_speed
            if servo.goal is not None:
                self.believe_part(self._section_before(RigidTransform.from_matrix(servo.goal), before))

        return self.execution.request(arm, steps())

    def _section_before(self, tool: RigidTransform, before: float) -> RigidTransform:
        """The section's pose where the tool stands `before` m before its front, and is turned as it."""
        return tool * RigidTransform.from_translation([before + self._half_section, 0.0, 0.0])

    def catch_part(self, arm: str, target: TargetTracker, inside: float, moved: Collection[str]) -> Request[float]:
        """Follow a part that floats, and close the jaw on its section with the pads `inside` m behind its front.

        The things `moved`, such as part and section, are then taken to be as far from where they were as the section.

        Arm and jaw move at once: the hand goes with the part until the pads hold it. The answer is the gap (m) between
        the pads. It fails as `servo` and `close` do.
        """
        positive("the way behind the front", inside)
        thickness, values, kin = self.known.printer.part.section.size[1], self.parameters, self.kinematics[arm]

        def steps() -> Generator[None, None, float]:
            start, model = self.execution.standing(arm), self.model(arm, without=self.things(PART_AND_BED))
            servo = Servo(kin, start, target, -inside, self._clock, model, values.servo)
            closing = self.execution.close_jaw(arm, thickness, force=values.first_force)
            ways = servo.trajectories(
                lambda: kin.tool_matrix(self.joints(arm)), lambda: next(closing, _CLOSED) is _CLOSED
            )
            yield from self.execution.stream(arm, ways, self._guard.free)
            yield from self._give_way(arm)
            yield from self.execution.press_jaw(arm, values.part_force)
            self.believe_part(self._section_before(self.tool(arm), -inside), moved)
            return self.grippers[arm].reading().gap

        return self._together(arm, steps())

    def part_goal(self, before: float) -> RigidTransform:
        """world_from_tool `before` m before the front of the part's section, where that is believed to be."""
        section = self._section
        return section * RigidTransform.from_translation([-self._half_section - before, 0.0, 0.0])

    def leads_on(
        self, arm: str, joints: FloatArray, onward: Sequence[RigidTransform], may_touch: Collection[str]
    ) -> bool:
        """Whether lines from joints (n,) to the poses `onward` (tool_from_goal) are free but for these things."""
        return self._free_onward(self.model(arm, without=self.things(may_touch)), joints, onward)

    def take_part(self, arm: str, deeper: float) -> Request[float]:
        """Go straight on by `deeper` m, close the jaw on the part's section, and let the hand give way to it.

        Gently at first, and the hand gives way as at the door: part and plate give way to little. The answer is the gap
        (m) between the pads. It fails as `shift` and `close` do.
        """
        positive("the way", deeper)
        thickness = self.known.printer.part.section.size[1]

        def steps() -> Generator[None, None, float]:
            way = self.tool(arm).rotation.apply([deeper, 0.0, 0.0])
            yield from self._done(self.shift(arm, way, without=self.things(PART_AND_BED)))
            yield from self._grip(arm, thickness, self.parameters.part_force)
            yield from self._turn_way(arm)
            return self.grippers[arm].reading().gap

        return self._together(arm, steps())

    def _grip(self, arm: str, thickness: float, force: float) -> Iterator[None]:
        """Close on the part gently, give way to it, then press with `force` N a finger."""
        yield from self.execution.close_jaw(arm, thickness, force=self.parameters.first_force)
        yield from self._give_way(arm)
        yield from self.execution.press_jaw(arm, force)

    def tool_at(self, frame: RgbdFrame) -> RigidTransform:
        """world_from_tool at the exposure of a frame of the camera on an arm, by the encoders."""
        mount = self.known.camera(frame.camera).mount
        assert isinstance(mount, WristMount)
        assert frame.joints is not None
        return self.kinematics[mount.arm].tool(frame.joints)

    def draw_back(self, arm: str, distance: float) -> Request[None]:
        """Draw the hand straight back by `distance` m, or by as large a share of that as is free.

        The door's handle does not count: it is between the fingers, or was, and may press on them. Where no share is
        free, the hand stays, and an anomaly says why.
        """
        positive("the distance", distance)

        def steps() -> Iterator[None]:
            for share_of_way in self.parameters.back_shares:
                back = self.tool(arm).rotation.apply([-share_of_way * distance, 0.0, 0.0])
                without = [self._parts()[1]]
                try:
                    yield from self._done(self._shift(arm, back, without=without, contact=self._guard.drawing))
                except PlanningError as error:
                    if error.code not in (*NO_WAY, CauseCode.OUT_OF_REACH) or isinstance(error, TouchError):
                        raise
                    why = str(error)
                else:
                    return
            self._on_anomaly(f"the hand does not draw back: {why}")

        return self._together(arm, steps())

    def take_handle(self, arm: str) -> Request[float]:
        """Close the jaw on the handle, and let the hand give way along y until hardly anything presses on it across.

        The hand is off by millimetres and closes on something that does not give way: one finger comes first, and the
        stiff arm presses with it. The answer is the gap (m) between the pads. It fails as `close` does.
        """
        thickness = self._door.handle.size[1]

        def steps() -> Generator[None, None, float]:
            yield from self.execution.close_jaw(arm, thickness)
            yield from self._give_way(arm)
            return self.grippers[arm].reading().gap

        return self._together(arm, steps())

    def _give_way(self, arm: str) -> Iterator[None]:
        """Steps along y until hardly anything presses on the hand across."""
        values = self.parameters
        for _ in range(values.gives):
            force = float(self._force_on(arm)[1])
            if abs(force) < values.relieved:
                break
            way = float(np.clip(values.give * force, -values.most_give, values.most_give))
            yield from self._done(self.shift(arm, [0.0, way, 0.0], checked=False))
            yield from self._wait(values.give_time)

    def _turn_way(self, arm: str) -> Iterator[None]:
        """Steps that turn the hand about the upright axis until hardly any moment is left.

        Pads that are askew press with their edges, and twist the bond under what they hold.
        """
        values = self.parameters
        for _ in range(values.gives):
            tool = self.tool(arm)
            moment = self._moment_about(arm, tool.translation)
            if abs(moment) < values.relieved_moment:
                break
            turn = Rotation.from_rotvec([0.0, 0.0, np.copysign(values.turn_give, moment)])
            goal = RigidTransform.from_components(tool.translation, turn * tool.rotation)
            yield from self._done(self.straight(arm, goal, pressing=True))
            yield from self._wait(values.give_time)

    def _wait(self, seconds: float) -> Iterator[None]:
        """Steps of so many seconds."""
        end = self._clock.now() + seconds
        while self._clock.now() < end - 1e-9:
            yield

    def _moment_about(self, arm: str, point: FloatArray) -> float:
        """The moment (N m) about the upright axis through a point (3,) m on the hand of an arm that hardly moves."""
        joints, efforts = self._outside_efforts(arm)
        return float(tool_wrench(self.kinematics[arm], joints, efforts, point)[5])

    def _force_on(self, arm: str) -> FloatArray:
        """The force (3,) N on the hand of an arm that hardly moves, world, by its drives' efforts."""
        joints, efforts = self._outside_efforts(arm)
        kin = self.kinematics[arm]
        return tool_force(kin, joints, efforts, kin.tool_matrix(joints)[:3, 3])

    def _outside_efforts(self, arm: str) -> tuple[FloatArray, FloatArray]:
        """The joints (n,) of an arm at rest, and its drives' efforts (n,) less those that it needs by itself."""
        reading, still = self.arms[arm].reading(), np.zeros(len(self.kinematics[arm]))
        expected = self._dynamics[arm].efforts(reading.positions, still, still, self.arms[arm].gravity())
        return reading.positions, reading.efforts - expected

    def slide_door(self, arm: str, position: float) -> MotionRequest:
        """Bring the rail of an arm that holds the handle to a position (m along it): the door goes along.

        Where the door stands then is believed by how far the hand went, however the motion ends. It fails with
        GRASP_EMPTY when the hand has lost the handle, and with MOTION_BLOCKED when the door goes no further. A door
        that goes no further just before the goal has come to its end stop, and that is no failure.
        """
        goal, speed = self._with_rail(arm, position), share("the speed", self.parameters.slide_speed)

        def steps() -> Iterator[None]:
            yield from self._give_way(arm)  # a stop leaves the stiff arm pressing on the handle
            start, before, self._slid = self.joints(arm), self.door_opening, True
            path = np.array([start, np.where(np.arange(len(goal)) == self._rail(arm), goal, start)])
            model = self.model(arm, without=self._parts())
            if not model.path_free(path, 0.0):
                between = np.linspace(path[0], path[1], self.parameters.slide_samples)
                distance, what = min(model.nearest(q) for q in between)
                why = f"on its way with the door the arm {near_words(distance, what)}"
                raise PlanningError(CauseCode.MOTION_BLOCKED, why)
            thickness = self._door.handle.size[1]
            limits = replace(self._guard.drawing, share=self.parameters.slide_share, back_off=False)
            watch = GripWatch(self.grippers[arm], thickness, self.parameters.execution.jaw.grip.gap)
            try:
                for _ in self._follow(arm, path, speed, model, limits):
                    if (evidence := watch.evidence()).detected:
                        self.execution.halt(arm)
                        trouble = self._lost_or_blocked(arm, evidence.sentence)
                        break
                    yield
                else:
                    return
            except TouchError as error:
                trouble = PlanningError(CauseCode.MOTION_BLOCKED, f"the door goes no further: {error}")
            finally:
                went = self.tool(arm).translation[1] - self.kinematics[arm].tool(start).translation[1]
                self.believe_door(before + went)
            yield from self._give_way(arm)
            left = before + goal[self._rail(arm)] - start[self._rail(arm)] - self.door_opening
            if trouble.code is not CauseCode.MOTION_BLOCKED or abs(left) > self.parameters.end_stop:
                raise trouble
            self._on_anomaly(f"{trouble}; {1e3 * abs(left):.0f} mm are left, so this is its end stop")

        return self._together(arm, steps())

    def _lost_or_blocked(self, arm: str, gap: str) -> PlanningError:
        """Why the pads of a hand that slides the door stand otherwise than they held, as the sentence `gap` says.

        A door that does not give way forces them apart, and presses on the hand.
        """
        if (force := abs(float(self._force_on(arm)[1]))) > self.parameters.blocked:
            why = f"the door goes no further: it presses on the hand with {force:.0f} N, {gap}"
            return PlanningError(CauseCode.MOTION_BLOCKED, why)
        return GraspEmptyError(f"the hand lost the handle: {gap}")

    def _rail(self, arm: str) -> int:
        rail = self.kinematics[arm].robot.rail
        if rail is None:
            raise PlanningError(CauseCode.OUT_OF_REACH, f"{arm_words(arm)} stands on no rail")
        return 0

    def _with_rail(self, arm: str, position: float) -> FloatArray:
        q, rail = self.joints(arm).copy(), self._rail(arm)
        q[rail] = finite("the rail's position", np.array([position]))[0]
        kin = self.kinematics[arm]
        if not kin.lower[rail] <= q[rail] <= kin.upper[rail]:
            span = f"{kin.lower[rail]:g} to {kin.upper[rail]:g} m"
            raise PlanningError(CauseCode.OUT_OF_REACH, f"the rail goes from {span}, asked for {q[rail]:.3f} m")
        return q
