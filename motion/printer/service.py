"""Motions at a printer: to the handle of its door, and with it."""

from collections.abc import Callable, Generator, Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cause import CauseCode
from regrasp.interfaces.cell import Box
from regrasp.interfaces.devices import Arm, Clock, Gripper
from regrasp.interfaces.printer.cell import PrinterKnown
from regrasp.interfaces.request import Request
from regrasp.motion.arguments import finite, positive, share
from regrasp.motion.failure import NO_WAY, GraspEmptyError, PlanningError, TouchError
from regrasp.motion.grasping.gap_test import GripWatch
from regrasp.motion.request import MotionRequest
from regrasp.motion.robots.tool_force import tool_force
from regrasp.motion.service import Motion, MotionParameters

# world_from_tool of a hand that points along -x, with its fingers to the left and right of what it takes
TO_THE_PRINTER = Rotation.from_matrix([[-1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0]])


@dataclass(frozen=True)
class PrinterMotionParameters(MotionParameters):
    """Those of every task, and of the door."""

    slide_speed: float = 0.2  # share of the rail's speed with the door in hand; choice
    back_shares: tuple[float, ...] = (1.0, 0.6, 0.3)  # of the way back, the first that is free; choice
    blocked: float = 30.0  # N across with which a door presses that goes no further; choice: it takes 8 N to slide
    relieved: float = 6.0  # N across that may be left when a hand has given way to what it holds; choice
    give: float = 2e-5  # m that it gives way for each N across, and ...
    most_give: float = 0.001  # m at most at once; choice: the arm is off by 2 mm
    gives: int = 10  # times at most
    give_time: float = 0.1  # s until the efforts are read again


class PrinterMotion(Motion):
    """Moves an arm on a rail, and the door with it. The arm keeps clear of the door where it believes it to stand."""

    parameters: PrinterMotionParameters

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
        self._off, self._slid = np.zeros(3), False  # m from where the handle should be on the door; was it pulled?
        self.believe_door(0.0)

    def believe_door(self, opening: float) -> None:
        """Keep clear of the door as it stands `opening` m open, from now on."""
        self.door_opening = float(np.clip(opening, 0.0, self._door.travel))
        self._boxes = [*self._fixed, *self._parts()]

    def handle(self, opening: float) -> RigidTransform:
        """world_from_tool of a hand that takes the handle of a door that stands `opening` m open."""
        _, handle = self._door.parts(opening)
        return RigidTransform.from_components(np.array(handle.center) + self._off, TO_THE_PRINTER)

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

    def _parts(self) -> tuple[Box, Box]:
        """The door and its handle as believed."""
        panel, handle = self._door.parts(self.door_opening)
        return panel, handle.model_copy(update={"center": tuple((np.array(handle.center) + self._off).tolist())})

    def move_rail(self, arm: str, position: float) -> MotionRequest:
        """Bring an arm's rail to a position (m along it), and let the arm's other joints stand.

        Fails with OUT_OF_REACH past the rail's ends or for an arm without a rail, and as `move` does.
        """
        return self.move(arm, self._with_rail(arm, position)[None], tight=True)

    def go_before(self, arm: str, goal: RigidTransform, standoff: float) -> MotionRequest:
        """Bring the tool along a free path `standoff` m before a pose (world_from_tool)."""
        return self.move_tool(arm, goal * RigidTransform.from_translation([-positive("the standoff", standoff), 0, 0]))

    def reach(self, arm: str, goal: RigidTransform, standoff: float) -> Request[None]:
        """Bring the tool along a free path `standoff` m before a pose (world_from_tool), then straight into it.

        On the straight way the arm may touch the door's handle, which lies between the fingers then.
        """
        positive("the standoff", standoff)
        way = RigidTransform.from_translation([standoff, 0.0, 0.0])
        _, handle = self._parts()

        def steps() -> Iterator[None]:
            yield from self._done(self.move_tool(arm, goal * way.inv(), onward=[way]))
            displacement = goal.translation - self.tool(arm).translation
            yield from self._done(self.shift(arm, displacement, without=[handle]))

        return self._together(arm, steps())

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
                    if error.code not in NO_WAY or isinstance(error, TouchError):
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
            force = self._force_across(arm)
            if abs(force) < values.relieved:
                break
            way = float(np.clip(values.give * force, -values.most_give, values.most_give))
            yield from self._done(self.shift(arm, [0.0, way, 0.0], checked=False))
            end = self._clock.now() + values.give_time
            while self._clock.now() < end - 1e-9:
                yield

    def _force_across(self, arm: str) -> float:
        """The force (N) along y on the hand of an arm at rest, by its drives' efforts."""
        reading, kin = self.arms[arm].reading(), self.kinematics[arm]
        still = np.zeros(len(kin))
        expected = self._dynamics[arm].efforts(reading.positions, still, still, self.arms[arm].gravity())
        at = kin.tool_matrix(reading.positions)[:3, 3]
        return float(tool_force(kin, reading.positions, reading.efforts - expected, at)[1])

    def slide_door(self, arm: str, position: float) -> MotionRequest:
        """Bring the rail of an arm that holds the handle to a position (m along it): the door goes along.

        Where the door stands then is believed by how far the hand went, however the motion ends. It fails with
        GRASP_EMPTY when the hand has lost the handle, and with MOTION_BLOCKED when the door goes no further.
        """
        goal, speed = self._with_rail(arm, position), share("the speed", self.parameters.slide_speed)

        def steps() -> Iterator[None]:
            start, before, self._slid = self.joints(arm), self.door_opening, True
            path = np.array([start, np.where(np.arange(len(goal)) == self._rail(arm), goal, start)])
            model = self.model(arm, without=self._parts())
            if not model.path_free(path, 0.0):
                distance, what = min(model.nearest(q) for q in path)
                raise PlanningError(CauseCode.MOTION_BLOCKED, f"the arm would come {-distance:.3f} m deep into {what}")
            thickness = self._door.handle.size[1]
            watch = GripWatch(self.grippers[arm], thickness, self.parameters.execution.jaw.grip.gap)
            try:
                for _ in self._follow(arm, path, speed, model, self._guard.drawing):
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
            raise trouble

        return self._together(arm, steps())

    def _lost_or_blocked(self, arm: str, gap: str) -> PlanningError:
        """Why the pads of a hand that slides the door stand otherwise than they held, as the sentence `gap` says.

        A door that does not give way forces them apart, and presses on the hand.
        """
        if (force := abs(self._force_across(arm))) > self.parameters.blocked:
            why = f"the door goes no further: it presses on the hand with {force:.0f} N, {gap}"
            return PlanningError(CauseCode.MOTION_BLOCKED, why)
        return GraspEmptyError(f"the hand lost the handle: {gap}")

    def _rail(self, arm: str) -> int:
        rail = self.kinematics[arm].robot.rail
        if rail is None:
            raise PlanningError(CauseCode.OUT_OF_REACH, f"the {arm} arm stands on no rail")
        return 0

    def _with_rail(self, arm: str, position: float) -> FloatArray:
        q, rail = self.joints(arm).copy(), self._rail(arm)
        q[rail] = finite("the rail's position", np.array([position]))[0]
        kin = self.kinematics[arm]
        if not kin.lower[rail] <= q[rail] <= kin.upper[rail]:
            span = f"{kin.lower[rail]:g} to {kin.upper[rail]:g} m"
            raise PlanningError(CauseCode.OUT_OF_REACH, f"the rail goes from {span}, asked for {q[rail]:.3f} m")
        return q
