"""Which links of a robot can meet one another."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from regrasp.app.robots.reach import link_poses, random_positions
from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.robot.robot import Robot

Pair = tuple[str, str]


@dataclass(frozen=True)
class PairParameters:
    """How the pairs of links that can meet are found."""

    samples: int = 5000  # random joint positions
    seed: int = 0
    always: float = 0.95  # share of the positions from which on two links count as always meeting; as MoveIt has it


def meeting_pairs(robot: Robot, parameters: PairParameters | None = None) -> list[Pair]:
    """The pairs of links whose spheres meet in some joint positions, with the jaw fully open.

    As MoveIt's setup assistant does, those are left out that never meet, that always meet, and neighbours: links with
    at most one joint of the arm between them.
    """
    parameters = parameters or PairParameters()
    positions = random_positions(robot.chain, parameters.samples, parameters.seed)
    return [
        pair
        for pair, depths in _depths(robot, _far_apart(robot), positions)
        if 0 < np.mean(depths > 0) < parameters.always
    ]


def meetings(robot: Robot, positions: FloatArray, overlap: float) -> list[tuple[Pair, float]]:
    """Which of the file's pairs overlap by more than `overlap` m at joint positions (n,), and how deep (m)."""
    found = _depths(robot, list(robot.self_collision), positions[None])
    return [(pair, float(depths[0])) for pair, depths in found if depths[0] > overlap]


def with_spheres(robot: Robot, spheres: Mapping[str, FloatArray]) -> Robot:
    """The same robot with these spheres (n, 4) by link, and without pairs."""
    rows = {link: [tuple(map(float, row)) for row in group] for link, group in spheres.items()}
    return Robot.model_validate(robot.model_dump() | {"spheres": rows, "self_collision": ()})


def _far_apart(robot: Robot) -> list[Pair]:
    chain_links = {link: robot.link_place(link)[0] for link in robot.spheres}
    return [(a, b) for a, b in combinations(robot.spheres, 2) if abs(chain_links[a] - chain_links[b]) > 1]


def _depths(robot: Robot, pairs: list[Pair], positions: FloatArray) -> Iterator[tuple[Pair, FloatArray]]:
    """Each pair, and how deep (k,) m its spheres overlap at each of the joint positions (k, n); negative apart."""
    body, (rotations, places) = robot.body, link_poses(robot.chain, positions)
    ends = np.cumsum([len(group) for group in robot.spheres.values()])
    rows = {link: slice(end - len(robot.spheres[link]), end) for link, end in zip(robot.spheres, ends, strict=True)}
    centers = {}
    for link, part in rows.items():
        index = robot.link_place(link)[0]
        centers[link] = body.spheres[part, :3] @ rotations[:, index].swapaxes(1, 2) + places[:, index, None]
    for a, b in pairs:
        radii = body.spheres[rows[a], 3][:, None] + body.spheres[rows[b], 3]
        apart = np.linalg.norm(centers[a][:, :, None] - centers[b][:, None], axis=3)
        yield (a, b), np.asarray((radii - apart).max(axis=(1, 2)))
