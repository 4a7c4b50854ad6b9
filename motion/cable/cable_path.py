"""Paths on which a held connector keeps to the shapes that its cable takes by itself.

A cable clamped at its plugged end is axially stiff. A hand that takes a short cut buckles it, with ten newtons and
half a newton metre at the stiffness of the Earth tests, and the connector turns in the jaw. A hand that keeps the free
end's distance and direction feels a tenth of that.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cable.cell import CableKnown
from regrasp.interfaces.geometry import axes_along
from regrasp.motion.robots.poses import inverse, multiply, rotation_matrix, rotation_vector


@dataclass(frozen=True)
class CablePathParameters:
    """Which paths are tried, and how finely they are sampled."""

    poses: int = 24  # of one path; choice: they lie at most 6 cm apart
    # m in x from the start, one path a value: there the connector rises first, round an obstacle; None: directly
    detours: tuple[float | None, ...] = (None, 0.0, 0.05, 0.10)
    # m by which the cable is taken to be shorter than it is: it bears no pull, and a camera errs by some mm along it
    reserve: float = 0.005


def natural_poses(known: CableKnown, deflections: FloatArray, reserve: float = 0.0) -> FloatArray:
    r"""world_from_connector (n, 4, 4) at the end of a cable that a force bends by `deflections` (n, 3) m.

    They are measured from the cable's straight course. The cable counts as `reserve` m shorter than it is.

    Cantilever with a load at its end (Euler-Bernoulli beam, second order in the slope). For a deflection d at the
    distance D along the straight course, the slope at the end and the cable's length L are

    .. math:: \theta = 1.5 \, d / D, \qquad L = D + 0.6 \, d^2 / D
    """
    anchor, course = known.cable.anchor
    length = known.cable.length - reserve
    # Beyond L^2 / 2.4 no D solves the second equation.
    d2 = np.minimum((deflections**2).sum(axis=1), 0.4 * length**2)
    along = 0.5 * (length + np.sqrt(length**2 - 2.4 * d2))[:, None]
    poses = np.zeros((len(deflections), 4, 4))
    poses[:, :3, :3] = axes_along(course + 1.5 * deflections / along)
    poses[:, :3, 3] = anchor + along * course + deflections + 0.5 * known.cable.connector.length * poses[:, :3, 0]
    poses[:, 3, 3] = 1.0
    return poses


def natural_paths(
    known: CableKnown,
    start: FloatArray,
    goal: FloatArray,
    parameters: CablePathParameters = CablePathParameters(),
) -> Iterator[FloatArray]:
    """Paths (n, 4, 4) of a held connector, world_from_connector from `start` (left out) to `goal`, both (4, 4).

    The direct path comes first, then the detours.

    Seen along the cable's straight course a path is direct, or rises first and then goes across, or rises nearer to the
    panel.
    """
    begin, end = deflection(known, start), deflection(known, goal)
    for detour in parameters.detours:
        via = 0.5 * (begin + end) if detour is None else np.array([begin[0] + detour, begin[1], end[2]])
        yield natural_path(known, start, goal, np.array([via, end]), parameters)


def lifted(
    known: CableKnown,
    start: FloatArray,
    way: FloatArray,
    step: float = 0.01,
    parameters: CablePathParameters = CablePathParameters(),
) -> FloatArray:
    """Poses (n, 4, 4) of a held connector, world_from_connector, that take it from `start` (4, 4) by `way` (3,) m.

    They keep what its pose differs from the cable's natural one. Of the way only that across the cable's straight
    course counts. The start comes first.
    """
    begin, (_, course) = deflection(known, start), known.cable.anchor
    across = way - (way @ course) * course
    shares = np.linspace(0.0, 1.0, 1 + int(np.ceil(float(np.linalg.norm(across)) / step)))[:, None]
    poses = natural_poses(known, begin + shares * across)
    lifted_poses = np.asarray(poses @ inverse(poses[0]) @ start)
    lifted_poses[:, :3, 3] -= shares * parameters.reserve * course
    return lifted_poses


def natural_path(
    known: CableKnown,
    start: FloatArray,
    goal: FloatArray,
    route: FloatArray,
    parameters: CablePathParameters = CablePathParameters(),
) -> FloatArray:
    """Poses (n, 4, 4) from `start` to `goal`, world_from_connector, along the cable's natural shapes.

    They are as many as the parameters say, or more. The cable's end is bent by the deflections of the `route` (k, 3) m,
    at even steps from the start (left out) on.

    The start's offset from its natural pose fades early, and the goal's comes late: a cable that hangs straight buckles
    with far more force than a bent one that is pressed by the same length.
    """
    begin, end = deflection(known, start), deflection(known, goal)
    count = max(parameters.poses, 2 * len(route))
    ends = natural_poses(known, np.array([begin, end]), parameters.reserve)
    first, last = multiply(inverse(ends[0]), start), multiply(inverse(ends[1]), goal)
    turn = rotation_vector(multiply(inverse(first), last)[:3, :3])
    s = np.linspace(0.0, 1.0, count + 1)[1:]
    share = s[:, None]
    offsets = np.zeros((count, 4, 4))
    offsets[:, :3, :3] = [first[:3, :3] @ rotation_matrix(part * turn) for part in s]
    offsets[:, :3, 3] = (1 - share) ** 3 * first[:3, 3] + share**3 * last[:3, 3]
    offsets[:, 3, 3] = 1.0
    corners = np.vstack([begin, route])
    at = np.linspace(0.0, 1.0, len(corners))
    deflections = np.column_stack([np.interp(s, at, corners[:, axis]) for axis in range(3)])
    return np.asarray(natural_poses(known, deflections, parameters.reserve) @ offsets)


def deflection(known: CableKnown, connector: FloatArray) -> FloatArray:
    """How far (3,) m the end of the cable at the connector's pose (4, 4) lies off the straight course."""
    anchor, course = known.cable.anchor
    end = connector[:3, 3] - 0.5 * known.cable.connector.length * connector[:3, 0] - anchor
    return np.asarray(end - (end @ course) * course)
