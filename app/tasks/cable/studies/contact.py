"""Contact study: an arm that moves freely, and a foam block that nobody told it of in its way."""

import statistics
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import TypeAdapter

from regrasp.app.campaigns.digest import digest_of
from regrasp.app.campaigns.statistics import wilson_interval
from regrasp.app.campaigns.table import print_table
from regrasp.app.scenario.load import load_scenario
from regrasp.app.studies.figures import write_figures
from regrasp.app.studies.scene_tasks import SceneTask, run_tasks
from regrasp.app.tasks.cable.placement import cable_at_start
from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cable.cell import CableCell
from regrasp.interfaces.cell import Box
from regrasp.interfaces.devices import TICK
from regrasp.interfaces.request import Request
from regrasp.interfaces.scene import GRAVITIES, Gravity, Obstacle, SceneSetup
from regrasp.motion.cable.service import CableMotion
from regrasp.motion.failure import PlanningError
from regrasp.motion.scene.collision import CollisionModel
from regrasp.sim.cable.objects import CableObjects, cable_world
from regrasp.sim.world import World

KIND = "trials of a contact study"
_BLOCK = "block"


@dataclass(frozen=True)
class ContactTrialParameters:
    """How the motion and the block in its way are drawn. All values are choices."""

    edges: tuple[float, float] = (0.05, 0.15)  # m, of the block
    least_motion: float = 1.0  # rad that the joint which moves most turns at least
    shares: tuple[float, float] = (0.2, 0.8)  # of the path's waypoints, where the block stands in the way
    clearance: float = 0.05  # m of the block from the arm at both ends of its path, the other arm and the cable
    tries: int = 2000  # draws of a trial until one fits
    outside: tuple[float, float, float] = (-2.0, 0.0, 0.5)  # m; where the block waits
    time_limit: float = 60.0  # s of a motion


@dataclass(frozen=True)
class ContactTrial:
    """One motion with a block in its way, and one without that is halted half-way."""

    gravity: Gravity
    seed: int
    arm: str
    peak_force: float  # N, the greatest normal force of the arm on the block, or on anything it must not touch
    touches: int  # that the arm felt
    cause: str  # why it did not come to its goal; empty if it did
    halt_speed: float  # rad/s, of the fastest joint at the halt
    halt_seconds: float  # from the halt until all joints rest

    def __str__(self) -> str:
        end = self.cause or "came to its goal"
        return f"{self.arm} arm: {self.peak_force:.1f} N, {self.touches} touches felt, {end}"


def run_contact(seeds: range, jobs: int, out: Path | None) -> int:
    """A trial for each seed and gravity: a table to stdout, figures to out/contact.json; the exit code of `run_tasks`.

    Raises:
        OSError: `out` cannot be written.
    """
    tasks = {
        f"{gravity} gravity seed {seed}": SceneTask(partial(_trials, gravity, seed), digest_of(KIND, gravity, seed))
        for seed in seeds
        for gravity in GRAVITIES
    }
    trials, code = run_tasks(tasks, jobs, out, KIND, TypeAdapter(list[ContactTrial]))
    _write(out, trials, seeds)
    if trials:
        print_table(("figure", "value"), _lines(contact_figures(trials)))
    return code


def contact_trial(
    gravity: Gravity, seed: int, parameters: ContactTrialParameters = ContactTrialParameters()
) -> ContactTrial:
    """Draw a motion and a block from the seed, and let the arm go.

    Raises RuntimeError if nothing that was drawn fits.
    """
    cell = load_scenario("no_obstacle").lit_cell
    assert isinstance(cell, CableCell)
    rng = np.random.default_rng([seed, 19])
    size = rng.uniform(*parameters.edges, 3)
    block = Box(name=_BLOCK, center=parameters.outside, size=(size[0], size[1], size[2]), color=(0.5, 0.2, 0.6))
    world = cable_world(cell, gravity, seed, SceneSetup((Obstacle(block, 0.0, None),)))
    try:
        anomalies: list[str] = []
        grippers = {name: arm.gripper for name, arm in world.arms.items()}
        motion = CableMotion(cell.known, world.arms, grippers, world, seed, on_anomaly=anomalies.append)
        motion.keep_clear(np.array(cable_at_start(cell, gravity)))
        arm, goal, center = _drawn(motion, world, size, rng, parameters)
        speed, seconds = _halted(world, motion, arm, goal, parameters)
        world.place_obstacle(_BLOCK, center)
        cause = _moved(world, motion.move(arm, goal[None]), parameters.time_limit)
        peak = max(world.contact_peaks.values(), default=0.0)
        touches = sum("touched something" in sentence for sentence in anomalies)
        return ContactTrial(gravity, seed, arm, peak, touches, cause, speed, seconds)
    finally:
        world.close()


def contact_figures(trials: Sequence[ContactTrial]) -> dict[str, Any]:
    """Counts [k, n], forces in N and times in s."""
    forces = sorted(trial.peak_force for trial in trials)
    halts = [trial.halt_seconds for trial in trials]
    return {
        "at_most_15_N": [sum(force <= 15.0 for force in forces), len(forces)],
        "at_most_30_N": [sum(force <= 30.0 for force in forces), len(forces)],
        "peak_force": {"median": statistics.median(forces), "max": forces[-1]},
        "felt": [sum(trial.touches > 0 for trial in trials), sum(force > 0 for force in forces)],
        "came_to_goal": [sum(not trial.cause for trial in trials), len(trials)],
        "halt_speed_max": max(trial.halt_speed for trial in trials),
        "halt_seconds": {"median": statistics.median(halts), "max": max(halts)},
    }


def _trials(gravity: Gravity, seed: int) -> list[ContactTrial]:
    return [contact_trial(gravity, seed)]


def _drawn(
    motion: CableMotion,
    world: World[CableObjects],
    size: FloatArray,
    rng: np.random.Generator,
    parameters: ContactTrialParameters,
) -> tuple[str, FloatArray, FloatArray]:
    """An arm, which then stands at the start of a motion, the goal (n,), and where (3,) m a block stands in its way."""
    arm = str(rng.choice(sorted(world.arms)))
    model, kin = motion.model(arm), motion.kinematics[arm]
    margin = motion.parameters.clearances.margin
    bodies = [motion.model(name, others=False).spheres(motion.joints(name)) for name in world.arms if name != arm]
    cable = np.array(cable_at_start(world.cell, world.gravity))
    away = np.vstack([*bodies, np.column_stack([cable, np.zeros(len(cable))])])
    for _ in range(parameters.tries):
        start, goal = rng.uniform(kin.lower, kin.upper, (2, len(kin)))
        far = np.max(np.abs(goal - start)) > parameters.least_motion
        if not far or not model.free(start, margin) or not model.free(goal, margin):
            continue
        try:
            path = motion.planner(model, start, goal[None], int(rng.integers(1 << 30)), margin)
        except PlanningError:
            continue
        center = _in_the_way(model, path, rng, parameters)
        near = np.vstack([model.spheres(start), model.spheres(goal), away])
        if np.min(_box_distances(near, center, size)) < parameters.clearance:
            continue
        world.arms[arm].place(start)
        world.advance(TICK)
        return arm, goal, center
    raise RuntimeError(f"no motion with a block in its way in {parameters.tries} draws")


def _in_the_way(
    model: CollisionModel, path: FloatArray, rng: np.random.Generator, parameters: ContactTrialParameters
) -> FloatArray:
    """The centre (3,) m of one of the spheres of the forearm or the hand, somewhere on the path (k, n)."""
    at = rng.uniform(*parameters.shares) * (len(path) - 1)
    k = min(int(at), len(path) - 2)
    q = path[k] + (at - k) * (path[k + 1] - path[k])
    outer = np.flatnonzero(model.links >= model.links.max() // 2)
    return np.asarray(model.spheres(q)[rng.choice(outer), :3])


def _box_distances(spheres: FloatArray, center: FloatArray, size: FloatArray) -> FloatArray:
    """Distances (n,) m of spheres (n, 4) from a box."""
    outside = np.maximum(np.abs(spheres[:, :3] - center) - 0.5 * size, 0.0)
    return np.asarray(np.linalg.norm(outside, axis=1) - spheres[:, 3])


def _moved(world: World[CableObjects], request: Request[None], time_limit: float) -> str:
    """Wait for a motion; why it failed, or ''."""
    end = world.now() + time_limit
    try:
        while not request.poll():
            if world.now() > end:
                return "took too long"
            world.advance(TICK)
    except PlanningError as error:
        return f"{error.code}: {error}"
    return ""


def _halted(
    world: World[CableObjects], motion: CableMotion, arm: str, goal: FloatArray, parameters: ContactTrialParameters
) -> tuple[float, float]:
    """The speed (rad/s) at which a motion to the goal is halted, and the seconds until the arm rests.

    Then the arm stands at the start again.
    """
    body = world.arms[arm]
    start = body.reading().positions
    request = motion.move(arm, goal[None])
    fastest = 0.0
    while not request.poll():
        world.advance(TICK)
        speed = float(np.max(np.abs(body.reading().velocities)))
        if speed < fastest:  # past the top
            break
        fastest = speed
    began = world.now()
    motion.stop()
    while np.max(np.abs(body.reading().velocities)) > 0.02:
        world.advance(world.step_seconds)
    seconds = world.now() - began
    while body.is_moving():
        world.advance(TICK)
    body.place(start)
    world.advance(TICK)
    return speed, seconds


def _write(out: Path | None, trials: Sequence[ContactTrial], seeds: range) -> None:
    if out is None or not trials:
        return
    rows = TypeAdapter(list[ContactTrial]).dump_python(list(trials), mode="json")
    write_figures(out / "contact.json", seeds, contact_figures(trials) | {"trials": rows})


def _lines(figures: dict[str, Any]) -> list[tuple[str, str]]:
    def share(key: str) -> str:
        k, n = figures[key]
        if not n:
            return "none"
        low, high = wilson_interval(k, n)
        return f"{k} of {n} ({100 * low:.1f} to {100 * high:.1f} %)"

    force, halt = figures["peak_force"], figures["halt_seconds"]
    return [
        ("at most 15 N", share("at_most_15_N")),
        ("at most 30 N", share("at_most_30_N")),
        ("greatest force", f"{force['max']:.1f} N, median {force['median']:.1f}"),
        ("touches felt", share("felt")),
        ("came to the goal", share("came_to_goal")),
        ("halt", f"{halt['max']:.2f} s, median {halt['median']:.2f}, from up to {figures['halt_speed_max']:.1f} rad/s"),
    ]
