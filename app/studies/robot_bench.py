"""`make bench`, its part on robots: loading, inverse kinematics, collision checks and planning, for each shipped robot.

    python -m regrasp.app.studies.robot_bench [ROBOT ...]

Inverse kinematics stands beside PyBullet's and, where it is installed (extra `bench`), TRAC-IK's, on the same poses.
Planning is in random clutter. Where coal is installed (extra `bench`) it checks the planned paths finely once more, by
the meshes of the URDF instead of our spheres.
"""

import argparse
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from importlib.util import find_spec

import numpy as np
from scipy.spatial.transform import RigidTransform

from regrasp.app.campaigns.table import print_table
from regrasp.app.files.resources import shipped
from regrasp.app.robots.robot_file import load_robot
from regrasp.app.studies.mesh_check import MeshCheck, Surroundings
from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cell import Box
from regrasp.interfaces.robot.urdf import pose_of
from regrasp.motion.failure import PlanningError
from regrasp.motion.planning.planner import plan
from regrasp.motion.robots.answers import wrap
from regrasp.motion.robots.kinematics import ArmKinematics
from regrasp.motion.scene.collision import CollisionModel
from regrasp.sim.robot.bullet_ik import BulletIk

Solve = Callable[[FloatArray], FloatArray]  # joints (k, n) for a pose (4, 4) of the tool


@dataclass(frozen=True)
class RobotBenchParameters:
    """How much is measured, and how hard it is."""

    poses: int = 1000
    position: float = 1e-3  # m by which a solution may miss its pose
    angle: float = float(np.deg2rad(0.5))  # rad, the same
    checks: int = 20000
    queries: int = 60
    margin: float = 0.015  # m that a planned path keeps
    boxes: int = 8
    edges: tuple[float, float] = (0.08, 0.25)  # m
    beyond: float = 0.08  # m; no box comes so near to the sleeping arm
    trac_ik_timeout: float = 0.005  # s, TRAC-IK's own default


def main(names: Sequence[str], seed: int = 0, parameters: RobotBenchParameters = RobotBenchParameters()) -> None:
    """Print the tables for the shipped robots of these names, or for all."""
    known = shipped("robot")
    kinematics, planning = [], []
    for name in names or known:
        print(f"robots: {name}", file=sys.stderr, flush=True)
        start = time.perf_counter()
        robot = load_robot(known[name])
        read = time.perf_counter() - start
        kin = ArmKinematics(robot, RigidTransform.from_translation([0.0, 0.0, 0.1]))
        kinematics += [(name, *line) for line in _inverse_kinematics(kin, np.random.default_rng([seed, 0]), parameters)]
        planning.append((name, *_planning(kin, np.random.default_rng([seed, 1]), read, parameters)))
    print_table(("inverse kinematics", "by", "solved %", "came back %", "answers", "us a pose"), kinematics)
    print()
    header = ("robot", "file s", "world s", "checks/s", "solved", "median ms", "90 % ms", "paths that touch a mesh")
    print_table(header, planning)


def _inverse_kinematics(
    kin: ArmKinematics, rng: np.random.Generator, parameters: RobotBenchParameters
) -> Iterator[tuple[str, ...]]:
    """A line for each solver: on how many poses it answers, on how many with the joints that the pose came from.

    A pose takes the median of the single calls, and of the one call for all of them its share of that.
    """
    joints = _draw(kin, rng, parameters.poses)
    poses = [kin.tool_matrix(q) for q in joints]
    for name, solve in _solvers(kin, parameters):
        solve(poses[0])
        taken = np.empty(len(poses))
        answers = []
        for n, pose in enumerate(poses):
            start = time.perf_counter()
            answers.append(solve(pose))
            taken[n] = time.perf_counter() - start
        right = [_reaching(kin, found, pose, parameters) for found, pose in zip(answers, poses, strict=True)]
        back = [
            len(found) and np.abs(_apart(kin, found, q)).max(axis=1).min() < 1e-3
            for found, q in zip(right, joints, strict=True)
        ]
        solved, count = np.mean([len(found) > 0 for found in right]), np.mean([len(found) for found in right])
        counts = f"{100 * solved:.1f}", f"{100 * np.mean(back):.1f}", f"{count:.1f}"
        yield name, *counts, f"{1e6 * np.median(taken):.1f}"
        if solve == kin.ik:
            yield f"ours, {len(poses):,} poses in one call", *counts, f"{_in_one_call(kin, np.array(poses)):.1f}"


def _in_one_call(kin: ArmKinematics, poses: FloatArray, calls: int = 9) -> float:
    """us that a pose takes when all of them (n, 4, 4) are asked for at once, in the median call."""
    taken = np.empty(calls)
    for n in range(calls):
        start = time.perf_counter()
        kin.ik_of_all(poses)
        taken[n] = time.perf_counter() - start
    return 1e6 * float(np.median(taken)) / len(poses)


def _solvers(kin: ArmKinematics, parameters: RobotBenchParameters) -> Iterator[tuple[str, Solve]]:
    yield "ours, checked, within limits", kin.ik
    bullet = BulletIk(kin.robot, RigidTransform.from_matrix(kin.base))
    for iterations in (200, 2000):
        yield f"PyBullet, {iterations} iterations", partial(bullet.solve, iterations=iterations)
    bullet.close()
    if find_spec("pytracik") is not None:
        yield "TRAC-IK", _by_trac_ik(kin, parameters.trac_ik_timeout)


def _by_trac_ik(kin: ArmKinematics, timeout: float) -> Solve:
    import xml.etree.ElementTree as ET

    import pytracik

    robot = kin.robot
    text = ET.tostring(robot.element(), encoding="unicode")
    solver = pytracik.TRAC_IK(robot.root, robot.tool.link, text, timeout, 1e-5, pytracik.SolveType.Speed)
    base_inverse, tool_from_link = np.linalg.inv(kin.base), np.linalg.inv(pose_of(robot.tool.xyz, robot.tool.rpy))
    middle = 0.5 * (kin.lower + kin.upper) * robot.signs

    def solve(pose: FloatArray) -> FloatArray:
        target = RigidTransform.from_matrix(base_inverse @ pose @ tool_from_link)
        found, *joints = pytracik.ik(solver, middle, *target.translation, *target.rotation.as_quat())
        return np.asarray(robot.signs * np.array([joints] if found > 0 else []).reshape(-1, len(middle)))

    return solve


def _reaching(kin: ArmKinematics, found: FloatArray, pose: FloatArray, parameters: RobotBenchParameters) -> FloatArray:
    """The answers (k, n) that reach the pose within the tolerances, with their joints within the limits."""
    kept = []
    for q in kin.within_limits(np.ascontiguousarray(found)):
        tool = kin.tool_matrix(q)
        near = np.linalg.norm(tool[:3, 3] - pose[:3, 3]) < parameters.position
        turn = np.linalg.norm(tool[:3, :3] - pose[:3, :3]) / np.sqrt(8)  # the sine of half the angle
        if near and turn < np.sin(parameters.angle / 2):
            kept.append(q)
    return np.array(kept).reshape(-1, len(kin))


def _apart(kin: ArmKinematics, found: FloatArray, q: FloatArray) -> FloatArray:
    """Differences (k, n); of joints that turn those without whole turns."""
    return np.where(kin.chain.slides, found - q, wrap(found - q))


def _draw(kin: ArmKinematics, rng: np.random.Generator, count: int) -> FloatArray:
    """Joints (count, n) within the limits, and within half a turn of zero."""
    half = np.where(kin.chain.slides, np.inf, np.pi)
    return rng.uniform(np.maximum(kin.lower, -half), np.minimum(kin.upper, half), (count, len(kin)))


def _planning(
    kin: ArmKinematics, rng: np.random.Generator, read: float, parameters: RobotBenchParameters
) -> tuple[str, ...]:
    start = time.perf_counter()
    bullet = BulletIk(kin.robot, RigidTransform.from_matrix(kin.base))
    loaded = time.perf_counter() - start
    bullet.close()
    boxes = clutter(kin, rng, parameters)
    model = CollisionModel(kin, boxes)
    drawn = _draw(kin, rng, parameters.checks)
    model.free(drawn[0], parameters.margin)
    start = time.perf_counter()
    free = drawn[[model.free(q, parameters.margin) for q in drawn]]
    rate = len(drawn) / (time.perf_counter() - start)
    ends = free[: 2 * parameters.queries].reshape(2, -1, len(kin))
    seconds, paths = _plan_all(model, ends, parameters.margin)
    touching = "coal is not installed"
    if find_spec("coal") is not None:
        check = MeshCheck(kin, Surroundings(boxes))
        touching = f"{sum(check.touches(path) for path in paths)} of {len(paths)}"
    median, most = (f"{1e3 * np.quantile(seconds, share):.1f}" for share in (0.5, 0.9))
    solved = f"{len(paths)} of {len(seconds)}"
    return f"{read:.2f}", f"{loaded:.2f}", f"{rate:,.0f}", solved, median, most, touching


def _plan_all(model: CollisionModel, ends: FloatArray, margin: float) -> tuple[list[float], list[FloatArray]]:
    """Seconds that each query took, and the paths that were found: from a start to where the tool is at a goal.

    As `Motion.move_tool`: a rail is moved where the arm finds no path without.
    """
    seconds, paths, kin = [], [], model.kinematics
    for n, (start, goal) in enumerate(zip(*ends, strict=True)):
        began = time.perf_counter()
        pose = kin.tool_matrix(goal)
        for near in (start, None) if kin.robot.rail else (start,):
            with suppress(PlanningError):
                paths.append(plan(model, start, kin.ik(pose, near), n, margin))
                break
        seconds.append(time.perf_counter() - began)
    return seconds, paths


def clutter(kin: ArmKinematics, rng: np.random.Generator, parameters: RobotBenchParameters) -> list[Box]:
    """A floor and boxes within the arm's reach, none near the arm asleep."""
    boxes = [Box(name="floor", center=(0.0, 0.0, -0.05), size=(4.0, 4.0, 0.1))]
    while len(boxes) <= parameters.boxes:
        x, y, z = kin.tool_matrix(_draw(kin, rng, 1)[0])[:3, 3] + rng.uniform(-0.1, 0.1, 3)
        size = tuple(rng.uniform(*parameters.edges, 3).tolist())
        box = Box(name=f"box {len(boxes)}", center=(float(x), float(y), float(z)), size=size)
        if z > 0.5 * size[2] and CollisionModel(kin, [box]).free(kin.robot.asleep, parameters.beyond):
            boxes.append(box)
    return boxes


def _names() -> list[str]:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("robot", nargs="*", help=f"one of {', '.join(shipped('robot'))}; all of them by default")
    names: list[str] = parser.parse_args().robot
    if unknown := sorted(set(names) - set(shipped("robot"))):
        parser.error(f"no shipped robot {', '.join(unknown)}; there are {', '.join(shipped('robot'))}")
    return names


if __name__ == "__main__":
    main(_names())
