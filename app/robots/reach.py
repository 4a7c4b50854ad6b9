"""Where a robot's links and tool get to, by its kinematic chain."""

from dataclasses import dataclass

import numpy as np

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.robot.chain import Chain


@dataclass(frozen=True)
class Reach:
    """What the tool reached in many random joint positions. Metres.

    `nearest` and `farthest` are its distances from the shoulder, which is where the second joint sits. `lowest` and
    `highest` are heights over the base's origin, along the base's z. A rail does not count.
    """

    nearest: float
    farthest: float
    lowest: float
    highest: float


def reach_of(chain: Chain, samples: int = 20_000, seed: int = 0) -> Reach:
    """The reach of an arm without its rail, whose joints turn between their limits at random."""
    rotations, places = link_poses(chain, random_positions(chain, samples, seed))
    tool = places[:, -1] + rotations[:, -1] @ chain.last_from_tool[:3, 3]
    distances = np.linalg.norm(tool - places[:, min(2, len(chain))], axis=1)
    return Reach(*(float(v) for v in (distances.min(), distances.max(), tool[:, 2].min(), tool[:, 2].max())))


def random_positions(chain: Chain, samples: int, seed: int) -> FloatArray:
    """Joint positions (samples, n) between the limits, each as likely as any other."""
    return np.random.default_rng(seed).uniform(chain.lower, chain.upper, (samples, len(chain)))


def link_poses(chain: Chain, positions: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Rotations (k, n + 1, 3, 3) and origins (k, n + 1, 3) m of the chain's links in the base, at k joint positions.

    Each joint's motion follows on those before it (product of exponentials).
    """
    rotations = np.tile(np.eye(3), (len(positions), len(chain) + 1, 1, 1))
    places = np.zeros((len(positions), len(chain) + 1, 3))
    for i, (origin, axis, slides) in enumerate(zip(chain.origins, chain.axes, chain.slides, strict=True)):
        values = positions[:, i]
        places[:, i + 1] = places[:, i] + rotations[:, i] @ origin
        if slides:
            places[:, i + 1] += values[:, None] * (rotations[:, i] @ axis)
        rotations[:, i + 1] = rotations[:, i] if slides else rotations[:, i] @ _turns(axis, values)
    return rotations, places


def _turns(axis: FloatArray, angles: FloatArray) -> FloatArray:
    """Rotations (k, 3, 3) about a unit axis, by Rodrigues' formula."""
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    sines, cosines = np.sin(angles)[:, None, None], np.cos(angles)[:, None, None]
    return np.asarray(np.eye(3) + sines * cross + (1.0 - cosines) * (cross @ cross))
