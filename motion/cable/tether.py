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

    # 1/m, curvature of the cable at the connector, the first with which a way is found. With 7 it turns the connector
    # in the jaw with 0.3 N m without gravity and 0.8 with the stiff cable of the Earth tests; from about twice that it
    # turns there, and forces the jaw open.
    bends: tuple[float, ...] = (7.0, np.inf)
    # m by which the cable's course (`cable_course`) may be longer than the cable, which bears no pull; the course is a
    # guess by so much
    stretch: float = 0.003
    seen_error: float = 0.02  # m by which the course of a loose cable may seem longer or shorter than it is; choice
    clearance: float = 0.004  # m between the cable's middle line and seen surfaces; its radius
    step: float = 0.03  # rad of the joint that moves most, between two checks; choice
    seen_free: float = 0.02  # m round the cable where it lies at the start: there no obstacle is, whatever was mapped
    points: int = 20  # that are checked along the cable; choice: 3 cm apart
    # m from either end where the cable may touch: it comes out of a socket's block, and the hand is at the other
    near_ends: float = 0.06
    slack: float = 0.001  # m by which a path may make worse what is not kept where it begins; choice
    bend_slack: float = 0.5  # 1/m, the same of the curvature
    caught: float = 0.04  # m that the cable's end keeps away from where a touch stopped it; choice
    caught_share: float = 0.8  # of its distance from there at the start, which it keeps at most; choice


@nb.njit(cache=True)  # type: ignore[untyped-decorator,unused-ignore]
def _course(  # type: ignore[no-untyped-def]
    end, anchor, direction, full, points, near_ends, boxes, distance, lower, h, caught
):
    """(length, clearance, bend) of the cable: m of its course and to anything, 1/m at the connector.

    `end` (4, 4) is that of the cable in the world, x along the cable, whose length is `full` m. It keeps clear of the
    spheres `caught` (n, 4) m: centre and radius.
    """
    p, d = end[:3, 3], end[:3, 0]
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
    for i in range(caught.shape[0]):
        clearance = min(clearance, np.sqrt(((p - caught[i, :3]) ** 2).sum()) - caught[i, 3])
    onward = 6.0 * (anchor - p) + chord * (2.0 * direction + 4.0 * d)  # second derivative of the curve at the connector
    bend = np.sqrt((np.cross(d, onward) ** 2).sum()) / (chord * chord)
    # A rod with both ends clamped that is too long by s bulges by a = 2 sqrt(s L) / pi, and its ends bend by
    # 2 pi^2 a / L^2 (first buckling mode).
    return length, clearance, bend + 4.0 * np.pi * np.sqrt(max(0.0, full - length) / full**3)


@nb.njit(cache=True)  # type: ignore[untyped-decorator,unused-ignore]
def _state(q, base, joints, end, *cable):  # type: ignore[no-untyped-def]
    """`_course` at joints (n,), where `end` (4, 4) is last_link_from_cable_end."""
    return _course(multiply(link_frames_in(base, joints, q)[-1], end), *cable)


@nb.njit(cache=True)  # type: ignore[untyped-decorator,unused-ignore]
def _edge_kept(qa, qb, step, longest, nearest, most, *cable):  # type: ignore[no-untyped-def]
    """Whether the cable is at most so long, at least so far from anything and bends at most so much along an edge."""
    count = max(1, int(np.ceil(np.abs(qb - qa).max() / step)))
    for k in range(count, 0, -1):
        length, clearance, bend = _state(qa + (qb - qa) * (k / count), *cable)
        if length > longest or clearance < nearest or bend > most:
            return False
    return True


def course_length(known: CableKnown, world_from_connector: FloatArray, points: int = 20) -> float:
    """Length (m) of the cable's course (`cable_course`) to a connector at a pose (4, 4), by so many `points`."""
    end = world_from_connector.copy()
    end[:3, 3] -= 0.5 * known.cable.connector.length * end[:3, 0]
    anchor, direction = known.cable.anchor
    nothing = np.full((1, 1, 1), FREE_DISTANCE, np.float32)
    surroundings = box_table([]), nothing, np.zeros(3), 1e-3, np.empty((0, 4))
    full = known.cable.length
    return float(_course(end, anchor, np.asarray(direction, float), full, points, 0.0, *surroundings)[0])


class Tether:
    """Implements `regrasp.motion.scene.collision.Constraint`: the cable reaches, and does not sweep through things.

    The cable's course is that of `cable_course`: a cubic Hermite curve, the shape of a rod under small deflections. It
    bears no pull, so that its course must not be longer than the cable. Where it is bent too much it turns the
    connector in the jaw: a course shorter than the cable buckles it. What is not kept at the start must not become
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
        max_bend: float = np.inf,
        parameters: TetherParameters = TetherParameters(),
        caught: Sequence[FloatArray] = (),
    ) -> None:
        """The arm holds the connector at `held` (tool_from_connector); its joints at the start are `start` (n,).

        The cable keeps clear of the `boxes`, and of what `grid` says, and bends by at most `max_bend` 1/m. Its
        end keeps away from the places `caught` (3,) m, in the world, at which a touch stopped it before.
        """
        self._connector_from_end = np.eye(4)
        self._connector_from_end[0, 3] = -0.5 * known.cable.connector.length
        held_end = held.as_matrix() @ self._connector_from_end
        begin = (kinematics.tool_matrix(np.asarray(start, float)) @ held_end)[:3, 3]
        kept = [min(parameters.caught, parameters.caught_share * np.linalg.norm(begin - place)) for place in caught]
        spheres = [[*place, radius] for place, radius in zip(caught, kept, strict=True)]
        anchor, direction = known.cable.anchor
        self._arguments = (
            kinematics.base,
            kinematics.joints,
            np.ascontiguousarray(kinematics.last_from_tool @ held_end),
            anchor,
            np.asarray(direction, float),
            known.cable.length,
            parameters.points,
            parameters.near_ends,
            box_table(boxes),
            np.ascontiguousarray(grid.distance),
            grid.lower,
            float(grid.h),
            np.array(spheres, float).reshape(-1, 4),
        )
        self._step = parameters.step
        length, clearance, bend = _state(np.asarray(start, float), *self._arguments)
        self._most = max(max_bend, bend + parameters.bend_slack)
        # A cable that hangs loose is as long as its course: what is seen otherwise is an error of the sight.
        loose = abs(length - known.cable.length) < parameters.seen_error
        longest = known.cable.length + parameters.stretch
        self._longest = length + parameters.slack if loose else max(longest, length + parameters.slack)
        self._nearest = min(parameters.clearance, clearance - parameters.slack)

    def clearance(self, world_from_connector: FloatArray) -> float:
        """How far (m) the cable's middle line is from anything where the connector is at a pose (4, 4)."""
        return float(_course(world_from_connector @ self._connector_from_end, *self._arguments[3:])[1])

    def holds(self, q: FloatArray) -> bool:
        """Whether the cable reaches and is free at joints (n,)."""
        length, clearance, bend = _state(np.asarray(q, float), *self._arguments)
        return bool(length <= self._longest and clearance >= self._nearest and bend <= self._most)

    def holds_along(self, qa: FloatArray, qb: FloatArray) -> bool:
        """Whether the cable reaches and is free on a straight joint motion, its end included (not its start)."""
        ends = np.asarray(qa, float), np.asarray(qb, float)
        return bool(_edge_kept(*ends, self._step, self._longest, self._nearest, self._most, *self._arguments))
