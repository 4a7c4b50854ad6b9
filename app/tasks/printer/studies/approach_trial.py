"""A trial of an approach: the hand is put where it starts, goes to the printed part, and takes it."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from scipy.spatial.transform import RigidTransform

from regrasp.app.tasks.printer.studies.approach_calibration import without_errors
from regrasp.app.tasks.printer.studies.hand_placed import HandPlaced
from regrasp.app.tasks.printer.studies.reach import STARTS
from regrasp.behaviors.printer.approach import approach_steps
from regrasp.interfaces.devices import TICK
from regrasp.interfaces.printer.actions import Approach
from regrasp.interfaces.printer.cell import PrinterCell
from regrasp.interfaces.request import Request, RequestError

Block = Literal["A", "A0", "B", "C"]


@dataclass(frozen=True)
class ApproachParameters:
    """What is drawn in the blocks B and C, and how a trial goes. Lengths in m."""

    part_off: float = 0.03  # B: on the plate, to each side
    part_yaw_deg: float = 15.0  # B: to each side
    start_x: tuple[float, float] = (0.20, 0.45)  # B: as far as the source's nearest and farthest start
    start_y: tuple[float, float] = (-0.35, 0.65)  # B: shares of the distance, as the source's starts
    start_z: tuple[float, float] = (-0.33, 0.33)
    draws: int = 50  # B: of a start, until the arm reaches one
    drift: float = 0.020  # C: m/s
    drift_angle_deg: tuple[float, float] = (20.0, 160.0)  # C: from y to z; the plate is below
    drift_time: float = 8.0  # C: s at most
    drift_way: float = 0.1  # C: at most
    before: float = 0.02  # the goal, before the section's front
    deeper: float = 0.027  # from the goal to the grasp
    limit: float = 30.0  # s for an approach
    trace: float = 0.1  # s between the samples of the way


@dataclass(frozen=True)
class Trial:
    """A trial: error (3,) m of the tool from its goal along x, y and z, None if the approach failed, and why.

    `settle` (s) is when the approach had ended, `path` the tool's way (k, 4): s, and m from the goal.
    """

    block: Block
    approach: Approach
    start: str
    seed: int
    error: tuple[float, float, float] | None
    why: str
    settle: float
    grasped: bool | None
    path: list[tuple[float, float, float, float]] = field(default_factory=list, repr=False)

    def __str__(self) -> str:
        if self.error is None:
            return f"{self.approach} {self.start}: {self.why}"
        end = "" if self.grasped is None else ", grasped" if self.grasped else ", not grasped"
        return f"{self.approach} {self.start}: {1e3 * float(np.linalg.norm(self.error)):.1f} mm{end}"


def run_trial(
    cell: PrinterCell, block: Block, approach: Approach, start: str, seed: int, parameters: ApproachParameters
) -> list[Trial]:
    """The trial."""
    rng = np.random.default_rng([seed, *block.encode()])
    if block == "A0":
        cell = without_errors(cell)
    if block == "B":
        cell = _with_part_off(cell, rng, parameters)
    with HandPlaced(cell, seed, before=parameters.before) as hand:
        nominal = hand.services.motion.part_goal(parameters.before)
        _put(hand, nominal, start, rng, parameters)
        hand.world.advance(0.5)  # until there are pictures from here
        return [_Trial(hand, block, approach, start, seed, rng, parameters).run()]


def _with_part_off(cell: PrinterCell, rng: np.random.Generator, parameters: ApproachParameters) -> PrinterCell:
    most = parameters.part_off
    off = {
        "part_off": tuple(rng.uniform(-most, most, 2).tolist()),
        "part_yaw_deg": float(rng.uniform(-parameters.part_yaw_deg, parameters.part_yaw_deg)),
    }
    printer = cell.hidden.printer.model_copy(update=off)
    return cell.model_copy(update={"hidden": cell.hidden.model_copy(update={"printer": printer})})


def _put(
    hand: HandPlaced, nominal: RigidTransform, start: str, rng: np.random.Generator, parameters: ApproachParameters
) -> None:
    """Put the hand where it starts; a start is drawn until the arm reaches it."""
    onward = (nominal, nominal * RigidTransform.from_translation([parameters.deeper, 0.0, 0.0]))
    if start in STARTS:
        hand.place(RigidTransform.from_translation(STARTS[start]) * nominal, onward)
        return
    for left in reversed(range(parameters.draws)):
        x = rng.uniform(*parameters.start_x)
        offset = [x, x * rng.uniform(*parameters.start_y), x * rng.uniform(*parameters.start_z)]
        try:
            hand.place(RigidTransform.from_translation(offset) * nominal, onward)
        except RequestError:
            if not left:
                raise
        else:
            return


class _Trial:
    def __init__(
        self,
        hand: HandPlaced,
        block: Block,
        approach: Approach,
        start: str,
        seed: int,
        rng: np.random.Generator,
        parameters: ApproachParameters,
    ) -> None:
        self._hand, self._parameters = hand, parameters
        self._what: tuple[Block, Approach, str, int] = (block, approach, start, seed)
        self._begin, self._path = hand.world.now(), list[tuple[float, float, float, float]]()
        self._drift: Any = None
        if block == "C":
            angle = np.deg2rad(rng.uniform(*parameters.drift_angle_deg))
            self._drift = parameters.drift * np.array([0.0, np.cos(angle), np.sin(angle)])
            hand.world.objects.part.float_off(self._drift)

    def run(self) -> Trial:
        """The approach, and the grasp of a part that stands."""
        hand, block = self._hand, self._what[0]
        grasped = None if block == "C" else False
        try:
            self._do(approach_steps(hand.services, self._what[1], self._parameters.before))
        except RequestError as error:
            return Trial(*self._what, None, f"{error.code}: {error}", self._seconds(), grasped, self._path)
        x, y, z = self._off().tolist()
        settle, path = self._seconds(), list(self._path)
        if block != "C":
            grasped = self._grasps()
        return Trial(*self._what, (x, y, z), "", settle, grasped, path)

    def _grasps(self) -> bool:
        hand = self._hand
        try:
            self._do(iter([hand.services.motion.take_part(hand.name, self._parameters.deeper)]))
        except RequestError:
            return False
        return bool(hand.world.objects.part.held_by(hand.arm))

    def _do(self, requests: Iterator[Request[Any]]) -> None:
        """Do the requests one after the other."""
        for request in requests:
            while not request.poll():
                self._hand.world.advance(TICK)
                seconds = self._seconds()
                if self._drift is not None and seconds > self._drift_ends():
                    self._hand.world.objects.part.float_off(np.zeros(3))
                    self._drift = None
                if not self._path or seconds > self._path[-1][0] + self._parameters.trace - 1e-9:
                    x, y, z = self._off().round(5).tolist()
                    self._path.append((round(seconds, 3), x, y, z))
                if seconds > 2 * self._parameters.limit:
                    request.cancel()

    def _drift_ends(self) -> float:
        return min(self._parameters.drift_time, self._parameters.drift_way / self._parameters.drift)

    def _off(self) -> Any:
        return self._hand.tool().translation - self._hand.goal.translation

    def _seconds(self) -> float:
        return float(self._hand.world.now() - self._begin)
