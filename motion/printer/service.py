"""Motions at a printer: to the handle of its door, and with it."""

from collections.abc import Callable, Generator, Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cause import CauseCode
from regrasp.interfaces.devices import Arm, Clock, Gripper
from regrasp.interfaces.printer.cell import PrinterKnown
from regrasp.interfaces.request import Request
from regrasp.motion.arguments import finite, positive, share
from regrasp.motion.failure import GraspEmptyError, PlanningError, TouchError
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
        self._fixed, self._door = list(self._boxes), known.printer.door
        self.believe_door(0.0)

    def believe_door(self, opening: float) -> None:
        """Keep clear of the door as it stands `opening` m open, from now on."""
        self.door_opening = float(np.clip(opening, 0.0, self._door.travel))
        self._boxes = [*self._fixed, *self._door.parts(self.door_opening)]

    def handle(self, opening: float) -> RigidTransform:
        """world_from_tool of a hand that takes the handle of a door that stands `opening` m open."""
        _, handle = self._door.parts(opening)
        return RigidTransform.from_components(handle.center, TO_THE_PRINTER)

    def move_rail(self, arm: str, position: float) -> MotionRequest:
        """Bring an arm's rail to a position (m along it), and let the arm's other joints stand.

        Fails with OUT_OF_REACH past the rail's ends or for an arm without a rail, and as `move` does.
        """
        return self.move(arm, self._with_rail(arm, position)[None], tight=True)

    def reach(self, arm: str, goal: RigidTransform, standoff: float) -> Request[None]:
        """Bring the tool along a free path `standoff` m before a pose (world_from_tool), then straight into it.

        On the straight way the arm may touch the door's handle, which lies between the fingers then.
        """
        positive("the standoff", standoff)
        way = RigidTransform.from_translation([standoff, 0.0, 0.0])
        _, handle = self._door.parts(self.door_opening)

        def steps() -> Iterator[None]:
            yield from self._done(self.move_tool(arm, goal * way.inv(), onward=[way]))
            displacement = goal.translation - self.tool(arm).translation
            yield from self._done(self.shift(arm, displacement, without=[handle]))

        return self._together(arm, steps())

    def take_handle(self, arm: str) -> Request[float]:
        """Close the jaw on the handle, and let the hand give way along y until hardly anything presses on it across.

        The hand is off by millimetres and closes on something that does not give way: one finger comes first, and the
        stiff arm presses with it. The answer is the gap (m) between the pads. It fails as `close` does.
        """
        thickness, values = self._door.handle.size[1], self.parameters

        def steps() -> Generator[None, None, float]:
            yield from self.execution.close_jaw(arm, thickness)
            for _ in range(values.gives):
                force = self._force_across(arm)
                if abs(force) < values.relieved:
                    break
                way = float(np.clip(values.give * force, -values.most_give, values.most_give))
                yield from self._done(self.shift(arm, [0.0, way, 0.0], checked=False))
                end = self._clock.now() + values.give_time
                while self._clock.now() < end - 1e-9:
                    yield
            return self.grippers[arm].reading().gap

        return self._together(arm, steps())

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
            start, before = self.joints(arm), self.door_opening
            path = np.array([start, np.where(np.arange(len(goal)) == self._rail(arm), goal, start)])
            model = self.model(arm, without=self._door.parts(self.door_opening))
            if not model.path_free(path, 0.0):
                distance, what = min(model.nearest(q) for q in path)
                raise PlanningError(CauseCode.MOTION_BLOCKED, f"the arm would come {-distance:.3f} m deep into {what}")
            thickness = self._door.handle.size[1]
            watch = GripWatch(self.grippers[arm], thickness, self.parameters.execution.jaw.grip.gap)
            try:
                for _ in self._follow(arm, path, speed, model, self._guard.drawing):
                    if (evidence := watch.evidence()).detected:
                        self.execution.halt(arm)
                        raise GraspEmptyError(f"the hand lost the handle: {evidence.sentence}")
                    yield
            except TouchError as error:
                raise PlanningError(CauseCode.MOTION_BLOCKED, f"the door goes no further: {error}") from None
            finally:
                went = self.tool(arm).translation[1] - self.kinematics[arm].tool(start).translation[1]
                self.believe_door(before + went)

        return self.execution.request(arm, steps())

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
