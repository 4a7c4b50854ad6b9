"""Ways on which a held connector keeps to the shapes that its cable takes by itself.

A cable clamped at its plugged end is stiff along itself: a hand that takes a short cut buckles it, with ten newtons and
half a newton metre at the stiffness of the Earth tests, and the connector turns in the jaw. A hand that keeps the free
end's distance and direction feels a tenth of that.
"""

from collections.abc import Iterator

import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation, Slerp

from regrasp.interfaces.cell import KnownCell, pose_along
from regrasp.motion.robots.kinematics import FloatArray

STEPS = 24
# A way round an obstacle: how far (m) in x from where it began it first rises; None is the direct way.
VIA = (None, 0.0, 0.05, 0.10)


def natural_pose(known: KnownCell, sideways: FloatArray) -> RigidTransform:
    """world_from_connector at the end of a cable that a force bends `sideways` (3,) m off its straight course.

    Cantilever with an end load (Euler-Bernoulli, second order in the slope): the slope at the end is 1.5 d / D, the
    cable is D + 0.6 d^2 / D long, where d is the deflection and D the distance along the straight course.
    """
    anchor, course = known.cable_anchor
    length = known.cable_length
    d2 = min(float(sideways @ sideways), 0.4 * length**2)
    along = 0.5 * (length + np.sqrt(length**2 - 2.4 * d2))
    direction = course + 1.5 * sideways / along
    direction = direction / np.linalg.norm(direction)
    centre = anchor + along * course + sideways + 0.5 * known.connector.length * direction
    return pose_along(_triple(centre), _triple(direction))


def natural_ways(known: KnownCell, start: RigidTransform, goal: RigidTransform) -> Iterator[list[RigidTransform]]:
    """Ways of a held connector, poses world_from_connector from `start` (left out) to `goal`: direct, then round.

    Off the cable's straight course a way leads directly, or first up and then across, or up and nearer to the panel.
    """
    begin, end = _sideways(known, start), _sideways(known, goal)
    for aside in VIA:
        via = 0.5 * (begin + end) if aside is None else np.array([begin[0] + aside, begin[1], end[2]])
        yield _natural_way(known, start, goal, via)


def _natural_way(
    known: KnownCell, start: RigidTransform, goal: RigidTransform, via: FloatArray
) -> list[RigidTransform]:
    """Poses from `start` to `goal` by way of the cable's natural shapes, bent through `via` (3,) m.

    What the start differs from those by fades early and what the goal does comes late: pressed by the same length, a
    cable that hangs straight buckles with far more force than a bent one.
    """
    begin, end = _sideways(known, start), _sideways(known, goal)
    first = natural_pose(known, begin).inv() * start
    last = natural_pose(known, end).inv() * goal
    turn = Slerp([0.0, 1.0], Rotation.concatenate([first.rotation, last.rotation]))
    poses = []
    for s in np.linspace(0.0, 1.0, STEPS + 1)[1:]:
        shift = (1 - s) ** 3 * first.translation + s**3 * last.translation
        sideways = begin + 2 * s * (via - begin) if s < 0.5 else via + (2 * s - 1) * (end - via)
        poses.append(natural_pose(known, sideways) * RigidTransform.from_components(shift, turn(s)))
    return poses


def _sideways(known: KnownCell, connector: RigidTransform) -> FloatArray:
    """How far (3,) m the cable's end lies off the straight course."""
    anchor, course = known.cable_anchor
    end = connector.apply([-0.5 * known.connector.length, 0.0, 0.0]) - anchor
    return np.asarray(end - (end @ course) * course)


def _triple(v: FloatArray) -> tuple[float, float, float]:
    return float(v[0]), float(v[1]), float(v[2])
