"""The cable of a held connector as a constraint on paths: it reaches only so far, and sweeps through nothing."""

from collections.abc import Sequence
from dataclasses import dataclass

import numba as nb
import numpy as np
from scipy.spatial.transform import RigidTransform

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cable.cell import CableKnown
from regrasp.interfaces.cell import Box
from regrasp.motion.robots.forward import link_frames_in
from regrasp.motion.robots.kinematics import ArmKinematics
from regrasp.motion.robots.poses import multiply
from regrasp.motion.scene.collision import box_distance, box_table, grid_distance
from regrasp.motion.scene.distance_grid import FREE_DISTANCE, DistanceGrid


@dataclass(frozen=True)
class TetherParameters:
    """How the cable limits where a hand may take its end."""

    # m by which the cable's course (`cable_course`) may be longer than the cable; the course is a guess by so much
    stretch: float = 0.008
    clearance: float = 0.004  # m between the cable's middle line and seen surfaces; its radius
    step: float = 0.03  # rad of the joint that moves most, between two checks; choice
    seen_free: float = 0.02  # m round the cable where it lies at the start: there no obstacle is, whatever was mapped
    points: int = 20  # that are checked along the cable; choice: 3 cm apart
    # m from either end where the cable may touch: it comes out of a socket's block, and the hand is at the other
    near_ends: float = 0.06
    slack: float = 0.003  # m by which a path may make worse what is not kept where it begins; choice


@nb.njit(cache=True)  # type: ignore[untyped-decorator,unused-ignore]
def _state(q, base, joints, end, anchor, direction, points, near_ends, boxes, distance, lower, h):  # type: ignore[no-untyped-def]
    """(length, clearance) m of the cable at joints (n,): that of its course, and its least distance to anything.

    `end` (4, 4) is last_link_from_cable_end, x along the cable.
    """
    last = multiply(link_frames_in(base, joints, q)[-1], end)
    p, d = last[:3, 3], last[:3, 0]
    chord = np.sqrt(((p - anchor) ** 2).sum())
    length, clearance, before = 0.0, FREE_DISTANCE, anchor
    for i in range(1, points + 1):
        t = i / points
        s = 1.0 - t
        # cubic Hermite curve between the ends, its tangents as long as the chord
        here = (
            (1.0 + 2.0 * t) * s * s * anchor
            + t * s * s * chord * direction
            + t * t * (3.0 - 2.0 * t) * p
            - t * t * s * chord * d
        )
        length += np.sqrt(((here - before) ** 2).sum())
        before = here
        if length < near_ends or s * chord < near_ends:
            continue
        clearance = min(clearance, grid_distance(here, distance, lower, h))
        for b in range(boxes.shape[0]):
            clearance = min(clearance, box_distance(here, boxes[b]))
    return length, clearance


@nb.njit(cache=True)  # type: ignore[untyped-decorator,unused-ignore]
def _edge_kept(qa, qb, step, longest, nearest, *cable):  # type: ignore[no-untyped-def]
    """Whether the cable is no longer than `longest` and no nearer than `nearest` to anything along an edge."""
    count = max(1, int(np.ceil(np.abs(qb - qa).max() / step)))
    for k in range(count, 0, -1):
        length, clearance = _state(qa + (qb - qa) * (k / count), *cable)
        if length > longest or clearance < nearest:
            return False
    return True


class Tether:
    """Implements `regrasp.motion.scene.collision.Constraint`: the cable reaches, and does not sweep through things.

    The cable's course is that of `cable_course`: a cubic Hermite curve, the shape of a rod under small deflections. It
    bears no pull, so that its course must not be longer than the cable. What is not kept at the start must not become
    worse.
    """

    def __init__(
        self,
        known: CableKnown,
        held: RigidTransform,
        start: FloatArray,
        kinematics: ArmKinematics,
        boxes: Sequence[Box],
        grid: DistanceGrid,
        parameters: TetherParameters = TetherParameters(),
    ) -> None:
        """The arm holds the connector at `held` (tool_from_connector); its joints at the start are `start` (n,).

        The cable keeps clear of the `boxes`, and of what `grid` says.
        """
        tool_from_end = held * RigidTransform.from_translation([-0.5 * known.cable.connector.length, 0.0, 0.0])
        anchor, direction = known.cable.anchor
        self._arguments = (
            kinematics.base,
            kinematics.joints,
            np.ascontiguousarray(kinematics.last_from_tool @ tool_from_end.as_matrix()),
            anchor,
            np.asarray(direction, float),
            parameters.points,
            parameters.near_ends,
            box_table(boxes),
            np.ascontiguousarray(grid.distance),
            grid.lower,
            float(grid.h),
        )
        self._step = parameters.step
        length, clearance = _state(np.asarray(start, float), *self._arguments)
        self._longest = max(known.cable.length + parameters.stretch, length + parameters.slack)
        self._nearest = min(parameters.clearance, clearance - parameters.slack)

    def holds(self, q: FloatArray) -> bool:
        """Whether the cable reaches and is free at joints (n,)."""
        length, clearance = _state(np.asarray(q, float), *self._arguments)
        return bool(length <= self._longest and clearance >= self._nearest)

    def holds_along(self, qa: FloatArray, qb: FloatArray) -> bool:
        """Whether the cable reaches and is free on a straight joint motion, its end included (not its start)."""
        ends = np.asarray(qa, float), np.asarray(qb, float)
        return bool(_edge_kept(*ends, self._step, self._longest, self._nearest, *self._arguments))
