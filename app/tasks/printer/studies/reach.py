"""`regrasp study reach`: whether the habitat's arm reaches all places of its job, and how long planning takes.

For every seed the places are off as they are believed with the errors of cameras, arm and rail. The arm goes through
its whole job, from the door's handle to the tray, by the motion service that the leaves use; it is at each trajectory's
end at once, so nothing but the planning is tried. Times are those of the thread's processor.
"""

import statistics
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import TypeAdapter
from scipy.spatial.transform import RigidTransform, Rotation

from regrasp.app.campaigns.digest import digest_of
from regrasp.app.campaigns.statistics import wilson_interval
from regrasp.app.campaigns.table import print_table
from regrasp.app.files.resources import shipped
from regrasp.app.scenario.cell_file import load_cell
from regrasp.app.studies.figures import write_figures
from regrasp.app.studies.scene_tasks import SceneTask, run_tasks
from regrasp.app.studies.standing import InstantArm, RunningClock, StandingGripper
from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cause import CauseCode
from regrasp.interfaces.devices import TICK
from regrasp.interfaces.printer.actions import PART_AND_BED, Action, JointGoal, PoseGoal, PoseRelGoal, RailGoal
from regrasp.interfaces.printer.cell import PrinterCell
from regrasp.interfaces.request import Request, RequestError
from regrasp.motion.planning.planner import plan
from regrasp.motion.printer.devices import ArmManipulator, ArmRail, OneAtATime
from regrasp.motion.printer.service import TO_THE_PRINTER, PrinterMotion

KIND = "seeds of a reach study"
CELL = "habitat"

# Table 4-5 of the source: where the tool starts, m from the goal before the gripping section
STARTS = {
    "20-LL": (0.20, 0.005, 0.025),
    "25-UR": (0.25, -0.06, -0.045),
    "30-LL": (0.30, 0.20, 0.075),
    "30-BA": (0.30, 0.0, 0.0),
    "35-UR": (0.35, -0.098, -0.10),
    "40-LL": (0.40, 0.27, 0.13),
    "45-UR": (0.45, -0.16, -0.15),
    "45-CE": (0.45, 0.028, 0.041),
}


@dataclass(frozen=True)
class ReachParameters:
    """How far the places are off, and how the hand comes to them. Lengths in m."""

    rail: float = 0.001  # standard deviation
    distance: float = 0.45  # from where the hand's camera looks at a place: the largest of the starts'
    before: float = 0.02  # the goal, before the section's front
    deeper: float = 0.04  # from the goal to the grasp
    # Along y from a place to the arm's base while the hand works there: choice, of 0.1 m steps the ones from which the
    # straight ways leave the Jacobian's least singular value the largest, 0.13 at the clamp to 0.17 at the section.
    beside_handle: float = -0.20
    beside_section: float = -0.25
    beside_clamp: float = 0.15
    beside_tray: float = -0.10
    handle_standoff: float = 0.08
    handle_back: float = 0.10
    out: float = 0.32  # that part and plate are drawn out of the printer
    above: float = 0.05  # the clamp and the tray, before the hand goes down
    lowest: float = 1.30  # z of the tool over the desk
    tolerance: float = 0.001  # that a planned path may end beside its place
    twist_deg: float = 40.0  # that breaks the bond


@dataclass(frozen=True)
class Place:
    """A place of the job: why it was not reached, "" if it was; processor ms of each plan on the way to it."""

    name: str
    why: str
    plan_ms: list[float] = field(default_factory=list)


@dataclass(frozen=True)
class ReachRow:
    """The places of a seed, in the job's order."""

    seed: int
    places: list[Place]

    def __str__(self) -> str:
        missed = [f"{place.name}: {place.why}" for place in self.places if place.why]
        return "; ".join([f"{len(self.places) - len(missed)} of {len(self.places)} places reached", *missed])


_ROWS: TypeAdapter[list[ReachRow]] = TypeAdapter(list[ReachRow])


def run_reach(seeds: range, jobs: int, out: Path | None, parameters: ReachParameters = ReachParameters()) -> int:
    """Go through the job for every seed.

    Progress goes to stderr, the table to stdout, the figures to out/reach.json; each seed is kept in `out` as it ends.
    Returns the exit code of `run_tasks`.

    Raises:
        OSError: `out` cannot be written.
    """
    cell = load_cell(shipped("cell")[CELL])
    assert isinstance(cell, PrinterCell)
    digest = digest_of(cell.model_dump(mode="json"), parameters.__dict__)
    tasks = {
        f"seed {seed}": SceneTask(partial(run_seed, cell, seed, parameters), digest_of(seed, digest)) for seed in seeds
    }
    rows, code = run_tasks(tasks, jobs, out, KIND, _ROWS)
    if out is not None and rows:
        figures = reach_figures(rows) | {"rows": _ROWS.dump_python(rows, mode="json")}
        write_figures(out / "reach.json", seeds, figures)
    _print(rows)
    return code


def run_seed(cell: PrinterCell, seed: int, parameters: ReachParameters) -> list[ReachRow]:
    """The seed's row."""
    return [ReachRow(seed, list(_Job(cell, seed, parameters).places()))]


def reach_figures(rows: Sequence[ReachRow]) -> dict[str, Any]:
    """The figures of reach.json, of all places and of each. Counts are [k, n], times processor ms; None: no plan."""
    by_name: dict[str, list[Place]] = {}
    for place in (place for row in rows for place in row.places):
        by_name.setdefault(place.name, []).append(place)
    return {
        "all": _figures([place for places in by_name.values() for place in places]),
        "places": {name: _figures(places) for name, places in by_name.items()},
    }


def _figures(places: Sequence[Place]) -> dict[str, Any]:
    times = [ms for place in places for ms in place.plan_ms]
    return {
        "reached": [sum(not place.why for place in places), len(places)],
        "plans": len(times),
        "plan_ms": {
            "median": statistics.median(times) if times else None,
            "p95": float(np.quantile(times, 0.95)) if times else None,
        },
    }


class _Job:
    """The job of one seed with an arm that is at once where it shall go."""

    def __init__(self, cell: PrinterCell, seed: int, parameters: ReachParameters) -> None:
        self._cell, self._seed, self._parameters = cell, seed, parameters
        known = cell.known
        self._arm, self._printer = known.printer.hand, known.printer
        spec = known.arm(self._arm)
        self._sleep = spec.sleep
        self._clock = RunningClock(TICK)
        arms = {self._arm: InstantArm(self._arm, np.array(spec.sleep))}
        self._jaw = StandingGripper(0.05)
        self.motion = PrinterMotion(known, arms, {self._arm: self._jaw}, self._clock, seed)
        self.motion.warm_up()
        turn = OneAtATime()
        self._manipulator = ArmManipulator(self.motion, self._arm, turn)
        self._rail = ArmRail(self.motion, self._arm, turn)
        self._times: list[float] = []
        self.motion.planner = self._timed  # type: ignore[assignment]  # with all its arguments
        self._rng = np.random.default_rng(seed)

    def places(self) -> Iterator[Place]:
        """The places in the order of the job; one that is not reached does not end it."""
        for name, steps in self._places():
            self._times, why = [], ""
            try:
                for request in steps:
                    self._finish(request)
            except RequestError as error:
                why = f"{error.code}: {error}"
            yield Place(name, why, self._times)

    def _places(self) -> Iterator[tuple[str, Iterator[Request[Any]]]]:
        travel = self._printer.door.travel
        yield "handle, door closed", self._handle(0.0)
        yield "handle, door open", self._handle(travel)
        goal = self._goal()  # the hand stays level, as at the handle
        goal = RigidTransform.from_components(self._off(goal.translation, self._parameters.distance), goal.rotation)
        seen = goal.translation - self._goal().translation + self._printer.part.section.center
        self.motion.believe_part(RigidTransform.from_components(seen, goal.rotation), PART_AND_BED)
        yield "before the printer", iter([self._rail_to(goal, self._parameters.beside_section)])
        for name, offset in STARTS.items():
            yield f"start {name}", iter([self._go(RigidTransform.from_translation(offset) * goal)])
        along = RigidTransform.from_translation
        deeper = self._parameters.deeper
        onward = along([deeper, 0.0, 0.0]), along([deeper - self._parameters.out, 0.0, 0.0])
        yield "goal", iter([self._go(goal, *onward, may_touch=PART_AND_BED)])
        yield "section", iter([self._by(-self._parameters.deeper, 0.0, 0.0, "section", "part")])
        yield "out of the printer", self._draw_out()
        yield "clamp", self._to_clamp()
        yield "twist in the clamp", self._twist()
        yield "tray", self._to_tray()
        yield "sleep", self._to_sleep()

    def _handle(self, opening: float) -> Iterator[Request[Any]]:
        values = self._parameters
        self.motion.believe_door(opening)
        self.motion.believe_handle(self._off(self.motion.handle(opening).translation, values.distance))
        handle = self.motion.handle(opening)
        yield self._rail_to(handle, values.beside_handle)
        yield self._manipulator.send(PoseGoal(handle, values.handle_standoff, ("door_handle",)))
        yield self._by(values.handle_back, 0.0, 0.0, "door_handle")

    def _goal(self) -> RigidTransform:
        section = self._printer.part.section
        front = section.center[0] + 0.5 * section.size[0] + self._parameters.before
        return RigidTransform.from_components([front, *section.center[1:]], TO_THE_PRINTER)

    def _draw_out(self) -> Iterator[Request[Any]]:
        self._jaw.gap = self._printer.part.section.size[1]
        self.motion.believe_held(self._arm, ["plate", "part", "section"])
        yield self._by(self._parameters.out, 0.0, 0.0, "plate_bed")

    def _to_clamp(self) -> Iterator[Request[Any]]:
        """Over the clamp, and down until the plate lies in it."""
        values, printer = self._parameters, self._printer
        grasp = np.array(printer.part.section.center) - printer.plate.center
        grasp[0] += self._goal().translation[0] - values.deeper - printer.part.section.center[0]
        place = np.array(printer.clamp.center) + grasp + [0.0, 0.0, values.above]
        pose = RigidTransform.from_components(self._off(place, 0.0), TO_THE_PRINTER)
        yield self._rail_to(pose, values.beside_clamp)
        down = RigidTransform.from_translation([0.0, 0.0, -values.above])
        clamp = ("clamp_bed", "clamp_left", "clamp_right")
        yield self._go(pose, down, pose.inv() * self._twisted(pose * down), may_touch=clamp)
        yield self._by(0.0, 0.0, -values.above, *clamp)

    def _twist(self) -> Iterator[Request[Any]]:
        """The clamp holds the plate, and the hand turns the part about its own axis."""
        self.motion.believe_placed(self._arm, ["plate"])
        tool = self.motion.tool(self._arm)
        yield self.motion.straight(self._arm, self._twisted(tool))
        yield self.motion.straight(self._arm, tool)

    def _twisted(self, tool: RigidTransform) -> RigidTransform:
        """A pose of the tool turned about the upright axis through the clamp's middle."""
        middle = RigidTransform.from_translation(self._printer.clamp.center)
        turn = RigidTransform.from_rotation(Rotation.from_euler("z", self._parameters.twist_deg, degrees=True))
        return middle * turn * middle.inv() * tool

    def _to_tray(self) -> Iterator[Request[Any]]:
        """Up from the clamp, over the tray, and down as far as the tool may go."""
        values, tray = self._parameters, next(b for b in self._cell.known.boxes if b.name == "tray")
        bench = ("plate", "clamp_bed", "clamp_left", "clamp_right")
        yield self._by(0.0, 0.0, 2 * values.above, *bench)
        place = np.array([*tray.center[:2], values.lowest + values.above])
        pose = RigidTransform.from_components(self._off(place, 0.0), TO_THE_PRINTER)
        yield self._rail_to(pose, values.beside_tray)
        yield self._go(pose)
        yield self._by(0.0, 0.0, -values.above, "tray", "tray_back", "tray_front", "tray_left", "tray_right", "desk")

    def _to_sleep(self) -> Iterator[Request[Any]]:
        """The part stays on the tray; the hand draws back first."""
        self._jaw.gap = 0.05
        self.motion.believe_placed(self._arm, ["part", "section"])
        yield self._by(0.10, 0.0, 0.0, "part", "section")
        yield self.motion.sleep(self._arm)
        yield self._manipulator.send(JointGoal(self._sleep[1:]))

    def _go(self, pose: RigidTransform, *onward: RigidTransform, may_touch: tuple[str, ...] = ()) -> Request[Any]:
        def steps() -> Iterator[None]:
            action = self._manipulator.send(PoseGoal(pose, may_touch=may_touch, onward=onward))
            while not action.poll():
                yield
            off = float(np.linalg.norm(action.answer.tool.translation - pose.translation))
            if off > self._parameters.tolerance:
                raise RequestError(CauseCode.OUT_OF_REACH, f"the tool came {1e3 * off:.1f} mm beside the place")

        return Request(steps())

    def _rail_to(self, place: RigidTransform, beside: float) -> Action[Any, Any]:
        base = self._cell.known.arm(self._arm).base
        return self._rail.send(RailGoal(float(place.translation[1] + beside - base[1])))

    def _by(self, dx: float, dy: float, dz: float, *may_touch: str) -> Action[Any, Any]:
        return self._manipulator.send(PoseRelGoal((dx, dy, dz), may_touch))

    def _off(self, place: FloatArray, distance: float) -> FloatArray:
        """A place (3,) m off by what arm and rail err, and by what a camera errs that sees it from a `distance` (m)."""
        errors, rng = self._cell.hidden.errors, self._rng
        off = rng.normal(size=3) * errors.arm_tool / np.sqrt(3) + [0.0, rng.normal() * self._parameters.rail, 0.0]
        if distance:
            off += rng.normal(size=3) * errors.camera_position
            off[0] += rng.normal() * errors.depth_scale * distance
            off[1:] += rng.normal(size=2) * np.deg2rad(errors.camera_angle_deg) * distance
        return np.asarray(place + off)

    def _timed(self, *args: Any) -> FloatArray:
        began = time.thread_time()
        try:
            return plan(*args)
        finally:
            self._times.append(1e3 * (time.thread_time() - began))

    def _finish(self, request: Request[Any]) -> None:
        while not request.poll():
            self._clock.advance()


def _print(rows: Sequence[ReachRow]) -> None:
    figures = reach_figures(rows)
    lines = []
    for name, of_place in [*figures["places"].items(), ("all", figures["all"])]:
        count, total = of_place["reached"]
        if total:
            low, high = wilson_interval(count, total)
            times = of_place["plan_ms"]
            median, most = (f"{times[key]:.1f}" if times[key] is not None else "-" for key in ("median", "p95"))
            lines.append((name, f"{count}/{total}", f"{100 * low:.1f} to {100 * high:.1f} %", median, most))
    print_table(("place", "reached", "95 % interval", "plan ms, 50 %", "95 %"), lines)
