"""Paths on which a held connector keeps to the shapes that its cable takes by itself.

A cable clamped at its plugged end is axially stiff. A hand that takes a short cut buckles it, with ten newtons and
half a newton metre at the stiffness of the Earth tests, and the connector turns in the jaw. A hand that keeps the free
end's distance and direction feels a tenth of that.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation, Slerp

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cell import KnownCell, pose_along


@dataclass(frozen=True)
class CablePathParameters:
    """Which paths are tried, and how finely they are sampled."""

    poses: int = 24  # of one path; choice: they lie at most 6 cm apart
    # m in x from the start, one path a value: there the connector rises first, round an obstacle; None: directly
    detours: tuple[float | None, ...] = (None, 0.0, 0.05, 0.10)


def natural_pose(known: KnownCell, deflection: FloatArray) -> RigidTransform:
    r"""world_from_connector at the end of a cable that a force bends by `deflection` (3,) m off its straight course.

    Cantilever with a load at its end (Euler-Bernoulli beam, second order in the slope). For a deflection d at the
    distance D along the straight course, the slope at the end and the cable's length L are

    .. math:: \theta = 1.5 \, d / D, \qquad L = D + 0.6 \, d^2 / D
    """
    anchor, course = known.cable_anchor
    length = known.cable_length
    # Beyond L^2 / 2.4 no D solves the second equation.
    d2 = min(float(deflection @ deflection), 0.4 * length**2)
    along = 0.5 * (length + np.sqrt(length**2 - 2.4 * d2))
    direction = course + 1.5 * deflection / along
    direction = direction / np.linalg.norm(direction)
    centre = anchor + along * course + deflection + 0.5 * known.connector.length * direction
    return pose_along(_triple(centre), _triple(direction))


def natural_paths(
    known: KnownCell,
    start: RigidTransform,
    goal: RigidTransform,
    parameters: CablePathParameters = CablePathParameters(),
) -> Iterator[list[RigidTransform]]:
    """Paths of a held connector, poses world_from_connector from `start` (left out) to `goal`: direct, then detours.

    Seen along the cable's straight course a path is direct, or rises first and then goes across, or rises nearer to the
    panel.
    """
    begin, end = _deflection(known, start), _deflection(known, goal)
    for detour in parameters.detours:
        via = 0.5 * (begin + end) if detour is None else np.array([begin[0] + detour, begin[1], end[2]])
        yield _natural_path(known, start, goal, via, parameters.poses)


def _natural_path(
    known: KnownCell, start: RigidTransform, goal: RigidTransform, via: FloatArray, count: int
) -> list[RigidTransform]:
    """`count` poses from `start` to `goal` along the cable's natural shapes, with deflection `via` (3,) m half-way.

    The start's offset from its natural pose fades early, and the goal's comes late: a cable that hangs straight buckles
    with far more force than a bent one that is pressed by the same length.
    """
    begin, end = _deflection(known, start), _deflection(known, goal)
    first = natural_pose(known, begin).inv() * start
    last = natural_pose(known, end).inv() * goal
    turn = Slerp([0.0, 1.0], Rotation.concatenate([first.rotation, last.rotation]))
    poses = []
    for s in np.linspace(0.0, 1.0, count + 1)[1:]:
        shift = (1 - s) ** 3 * first.translation + s**3 * last.translation
        deflection = begin + 2 * s * (via - begin) if s < 0.5 else via + (2 * s - 1) * (end - via)
        poses.append(natural_pose(known, deflection) * RigidTransform.from_components(shift, turn(s)))
    return poses


def _deflection(known: KnownCell, connector: RigidTransform) -> FloatArray:
    """How far (3,) m the cable's end lies off the straight course."""
    anchor, course = known.cable_anchor
    end = connector.apply([-0.5 * known.connector.length, 0.0, 0.0]) - anchor
    return np.asarray(end - (end @ course) * course)


def _triple(v: FloatArray) -> tuple[float, float, float]:
    return float(v[0]), float(v[1]), float(v[2])
