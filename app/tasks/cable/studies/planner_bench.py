"""Our planner against `birrt` of the package pybullet-planning, on the same queries in the same run."""

import statistics
import sys
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from regrasp.app.campaigns.table import print_table
from regrasp.app.run.compose import build_world
from regrasp.app.scenario.load import load_scenario
from regrasp.app.scenario.sampling import draw_obstacles
from regrasp.app.tasks.cable.studies.birrt import Birrt, Planner
from regrasp.app.tasks.cable.studies.planner_queries import Query, draw_queries
from regrasp.interfaces.arrays import FloatArray
from regrasp.motion.failure import PlanningError
from regrasp.motion.planning.planner import plan
from regrasp.motion.scene.planning_scene import PlanningScene

SCENARIOS = ("no_obstacle", "short_obstacle", "tall_obstacle")
HEADER = ("planner", "queries", "solved", "median ms", "times ours", "path rad", "weighted m")


@dataclass(frozen=True, eq=False)
class Answer:
    """What a planner made of a query: a path (k, 6) rad or None, and the seconds that it took."""

    seconds: float
    path: FloatArray | None


def print_planner_bench(count: int = 10, seed: int = 0) -> None:
    """Print a table of our planner and of birrt on `count` queries in each scenario's world, drawn by `seed`.

    Without the package it prints how to get it, and no table.
    """
    try:
        import pybullet_planning  # noqa: F401 - is it there?
    except ImportError:
        print("planner against birrt: left out; pip install -e '.[bench]' in the project's folder brings birrt")
        return
    names = ("ours", "birrt, our check", "birrt, PyBullet's check")
    answers: dict[str, list[Answer]] = {name: [] for name in names}
    for name in SCENARIOS:
        scenario = load_scenario(name)
        obstacles = draw_obstacles(scenario.file, np.random.default_rng([seed, 0]))  # as `build_world` draws them
        world = build_world(scenario, seed, "software")
        try:
            scene = PlanningScene(world.cell.known, world.arms, {n: arm.gripper for n, arm in world.arms.items()})
            queries = draw_queries(scene, obstacles, np.random.default_rng(seed), count)
            birrt = Birrt(world, queries)
            planners: dict[str, Planner] = dict(
                zip(names, (ours, birrt.with_our_check, birrt.with_its_check), strict=True)
            )
            for planner, found in compare(queries, planners, name).items():
                answers[planner] += found
        finally:
            world.close()
    print_table(HEADER, comparison_lines(answers, queries[0].model.kinematics.chain.levers))


def ours(query: Query, seed: int) -> FloatArray | None:
    """Our planner, as motion asks it."""
    try:
        return plan(query.model, query.start, query.goal[None], seed, query.margin)
    except PlanningError:
        return None


def compare(queries: Sequence[Query], planners: Mapping[str, Planner], title: str) -> dict[str, list[Answer]]:
    """Each planner's answers; they take turns at every query, so that load hits all. Progress goes to stderr."""
    ours(queries[0], 0)  # compiles
    answers: dict[str, list[Answer]] = {name: [] for name in planners}
    for n, query in enumerate(queries):
        print(f"planner: {title} {n + 1}/{len(queries)}", file=sys.stderr, flush=True)
        for name, planner in planners.items():
            start = time.perf_counter()
            path = planner(query, n)
            answers[name].append(Answer(time.perf_counter() - start, path))
    return answers


def comparison_lines(answers: Mapping[str, list[Answer]], levers: FloatArray) -> list[tuple[str, ...]]:
    """A line for each planner over all queries, and one over those where the first planner's path is not straight.

    Times count every query, paths those that all solved. `levers` (n,) m are the joints'.
    """
    first = next(iter(answers.values()))
    bent = [a.path is None or len(a.path) > 2 for a in first]
    solved = [all(found[n].path is not None for found in answers.values()) for n in range(len(first))]
    lines = []
    for what, chosen in (("", [True] * len(first)), (", not straight", bent)):
        reference = _median([a.seconds for a, c in zip(first, chosen, strict=True) if c])
        for name, found in answers.items():
            kept = [a for a, c in zip(found, chosen, strict=True) if c]
            lengths = [path_lengths(a.path, levers) for a, c, s in zip(found, chosen, solved, strict=True) if c and s]
            seconds = _median([a.seconds for a in kept])
            paths = (f"{_median([pair[i] for pair in lengths]):.2f}" for i in range(2))
            done = sum(a.path is not None for a in kept)
            figures = (str(len(kept)), str(done), f"{1e3 * seconds:.1f}", f"{seconds / reference:.1f}")
            lines.append((name + what, *figures, *paths))
    return lines


def path_lengths(path: FloatArray | None, levers: FloatArray) -> tuple[float, float]:
    """Length of a path (k, n) in joint space, rad, and with the joints' `levers` (n,), m."""
    assert path is not None
    steps = np.array([b - a for a, b in pairwise(path)]).reshape(-1, len(levers))
    return float(np.linalg.norm(steps, axis=1).sum()), float(np.linalg.norm(steps * levers, axis=1).sum())


def _median(values: Sequence[float]) -> float:
    return statistics.median(values) if values else float("nan")
