"""Collision checks of an arm: its spheres against boxes, another arm, seen surfaces and the arm itself."""

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass
from itertools import pairwise
from typing import Protocol

import numba as nb
import numpy as np
from numpy.typing import NDArray

from regrasp.interfaces.arrays import FloatArray, Mask
from regrasp.interfaces.cell import Box
from regrasp.motion.robots.forward import link_frames_in, spheres_in, world_spheres
from regrasp.motion.robots.kinematics import ArmKinematics
from regrasp.motion.robots.spheres import CAMERA_ACROSS, CAMERA_RADIUS
from regrasp.motion.scene.bounds import bounding_spheres, group_pairs, group_starts, groups_meet, square_distance
from regrasp.motion.scene.distance_grid import FREE_DISTANCE, NO_SURFACES, DistanceGrid

_CAMERA, _CARRIED = -1, -2  # parts that are no links of the robot
_DIFFERENCE = 1e-4  # of a path's parameter, for a difference quotient
_ITSELF, _GRID, _OTHER_ARM = -1, -2, -3  # what a clearance is to, when it is not a box


@dataclass(frozen=True)
class CollisionParameters:
    """How finely and how strictly an arm is checked."""

    coarse_step: float = 0.02  # rad of the joint that moves most, between two checks of an edge
    fine_step: float = 0.01  # rad, the same for a path that will be driven
    # m that spheres of one arm may overlap: they stand out of the meshes, and the 15 mm between shoulder and wrist in
    # the sleep pose look like 1 mm
    self_overlap: float = 0.008


@dataclass(frozen=True)
class Clearances:
    """Distances (m) that planned motions keep."""

    margin: float = 0.015  # between the arm's spheres and anything while it moves freely; choice
    tight_margin: float = 0.005  # the same where nothing is found with `margin`; choice
    nearer: float = 0.003  # by which a straight way out may come nearer to something than where it begins; choice
    # On straight centimetres near things: the first that leaves a path; choice.
    near_margins: tuple[float, ...] = (0.020, 0.014, 0.008, 0.004, 0.0)


@dataclass(frozen=True, eq=False)
class ArmBody:
    """What makes up an arm's body besides its links.

    `camera_offset` (3,) m is where a camera sits in the robot's mount. `carried` (m, 4) m are spheres fixed in the tool
    frame. The pads stand `opening` m apart; None: fully open.
    """

    camera_offset: Sequence[float] | None = None
    carried: FloatArray | None = None
    opening: float | None = None


@nb.njit(cache=True)  # type: ignore[untyped-decorator,unused-ignore]
def box_distance(p: FloatArray, box: FloatArray) -> float:
    """Signed distance of a point (3,) to a box (6,): centre and half edges."""
    outside, inside = 0.0, -1e9
    for a in range(3):
        d = abs(p[a] - box[a]) - box[3 + a]
        inside = max(inside, d)
        if d > 0:
            outside += d * d
    return np.sqrt(outside) if outside > 0 else inside


@nb.njit(cache=True)  # type: ignore[untyped-decorator,unused-ignore]
def grid_distance(p: FloatArray, distance: NDArray[np.float32], lower: FloatArray, h: float) -> float:
    """Distance at a point (3,), by the grid's `distance`, `lower` corner and voxel edge `h`."""
    i, j, k = np.floor((p[0] - lower[0]) / h), np.floor((p[1] - lower[1]) / h), np.floor((p[2] - lower[2]) / h)
    shape = distance.shape
    if i < 0 or j < 0 or k < 0 or i >= shape[0] or j >= shape[1] or k >= shape[2]:
        return FREE_DISTANCE
    return distance[int(i), int(j), int(k)]


@nb.njit(cache=True)  # type: ignore[untyped-decorator,unused-ignore]
def _nearest(  # type: ignore[no-untyped-def]
    q, base, joints, first, links, local, pairs, boxes, others, distance, lower, h, self_overlap
):
    """(clearance, what) over everything: clearance in m, what an index into `boxes` or one of the negative codes."""
    world = world_spheres(base, joints, q, links, local)
    best, what = FREE_DISTANCE, _ITSELF
    for n in range(world.shape[0]):
        if links[n] < first:
            continue
        p, r = world[n, :3], world[n, 3]
        for b in range(boxes.shape[0]):
            d = box_distance(p, boxes[b]) - r
            if d < best:
                best, what = d, b
        for m in range(others.shape[0]):
            d = np.sqrt(square_distance(p, others[m])) - r - others[m, 3]
            if d < best:
                best, what = d, _OTHER_ARM
        d = grid_distance(p, distance, lower, h) - r
        if d < best:
            best, what = d, _GRID
    for m in range(pairs.shape[0]):
        a, c = world[pairs[m, 0]], world[pairs[m, 1]]
        d = np.sqrt(square_distance(a, c)) - a[3] - c[3] + self_overlap
        if d < best:
            best, what = d, _ITSELF
    return best, what


@nb.njit(cache=True)  # type: ignore[untyped-decorator,unused-ignore]
def _clearances(q, base, joints, links, local, boxes, distance, lower, h):  # type: ignore[no-untyped-def]
    """Least distance (n,) m of each sphere to the boxes and the grid's points."""
    world = world_spheres(base, joints, q, links, local)
    out = np.empty(world.shape[0])
    for n in range(world.shape[0]):
        p = world[n, :3]
        nearest = grid_distance(p, distance, lower, h)
        for b in range(boxes.shape[0]):
            nearest = min(nearest, box_distance(p, boxes[b]))
        out[n] = nearest - world[n, 3]
    return out


@nb.njit(cache=True)  # type: ignore[untyped-decorator,unused-ignore]
def _along(path, slopes, base, joints, links, local, boxes, others, distance, lower, h):  # type: ignore[no-untyped-def]
    """See `CollisionModel.along`."""
    to_grid, to_rigid, ways = np.empty((3, path.shape[0], local.shape[0]))
    for k in range(path.shape[0]):
        step = 0.5 * _DIFFERENCE * slopes[k]
        before = world_spheres(base, joints, path[k] - step, links, local)
        after = world_spheres(base, joints, path[k] + step, links, local)
        for n in range(local.shape[0]):
            middle = 0.5 * (before[n, :3] + after[n, :3])
            to_grid[k, n] = grid_distance(middle, distance, lower, h) - local[n, 3]
            nearest = np.inf
            for b in range(boxes.shape[0]):
                nearest = min(nearest, box_distance(middle, boxes[b]))
            for m in range(others.shape[0]):
                nearest = min(nearest, np.sqrt(square_distance(middle, others[m])) - others[m, 3])
            to_rigid[k, n] = nearest - local[n, 3]
            ways[k, n] = np.sqrt(square_distance(before[n, :3], after[n])) / _DIFFERENCE
    return to_grid, to_rigid, ways


@nb.njit(cache=True)  # type: ignore[untyped-decorator,unused-ignore]
def _meets_box(p, reach, boxes):  # type: ignore[no-untyped-def]
    """Whether a point is nearer than `reach` to a box; most boxes are ruled out by the first axis."""
    for b in range(boxes.shape[0]):
        square = 0.0
        for a in range(3):
            d = abs(p[a] - boxes[b, a]) - boxes[b, 3 + a]
            if d >= reach:
                square = np.inf
                break
            if d > 0:
                square += d * d
        if square < reach * reach:
            return True
    return False


@nb.njit(cache=True)  # type: ignore[untyped-decorator,unused-ignore]
def _free(  # type: ignore[no-untyped-def]
    q, margin, base, joints, first, links, local, boxes, others, distance, lower, h, self_overlap,
    starts, group_links, group_bounds, group_pairs, other_starts, other_bounds,
):  # fmt: skip
    """Whether `_nearest` would be at least `margin` (own links: 0), at a tenth of the cost."""
    frames = link_frames_in(base, joints, q)
    world, bounds = spheres_in(frames, links, local), spheres_in(frames, group_links, group_bounds)
    for g in range(bounds.shape[0] - 1, -1, -1):  # gripper first: it meets things most often
        if group_links[g] < first:
            continue
        near_box = _meets_box(bounds[g], bounds[g, 3] + margin, boxes)
        for n in range(starts[g], starts[g + 1]):
            p, reach = world[n], world[n, 3] + margin
            if (near_box and _meets_box(p, reach, boxes)) or grid_distance(p, distance, lower, h) < reach:
                return False
        group = world[starts[g] : starts[g + 1]]
        for m in range(other_bounds.shape[0]):
            other = others[other_starts[m] : other_starts[m + 1]]
            if groups_meet(group, bounds[g], other, other_bounds[m], margin, 0.0):
                return False
    for m in range(group_pairs.shape[0]):
        a, b = group_pairs[m, 0], group_pairs[m, 1]
        group, other = world[starts[a] : starts[a + 1]], world[starts[b] : starts[b + 1]]
        if groups_meet(group, bounds[a], other, bounds[b], 0.0, self_overlap):
            return False
    return True


@nb.njit(cache=True)  # type: ignore[untyped-decorator,unused-ignore]
def _edge_free(qa, qb, step, margin, *scene):  # type: ignore[no-untyped-def]
    """Whether all configurations of an edge are free: end, middle, then quarters, so that an obstacle shows early."""
    n = int(np.ceil(np.abs(qb - qa).max() / step))
    if not _free(qb, margin, *scene):
        return False
    stride = 1
    while stride * 2 <= n:
        stride *= 2
    while stride >= 1:
        for k in range(stride, n, 2 * stride):
            q = qa + (qb - qa) * (k / n)
            if not _free(q, margin, *scene):
                return False
        stride //= 2
    return True


class Constraint(Protocol):
    """A further condition on the joints of a path."""

    def holds(self, q: FloatArray) -> bool:
        """Whether joints (n,) meet it."""
        ...

    def holds_along(self, qa: FloatArray, qb: FloatArray) -> bool:
        """Whether a straight joint motion meets it, its end included (not its start)."""
        ...


class CollisionModel:
    """One arm, and all that it must not touch. It does not change; make a new one when the surroundings do.

    `other_arm` (m, 4) m are another arm's spheres in the world (`spheres` of its model). A `margin` is metres between
    surfaces; the arm's own links must only not touch, whatever the margin.
    """

    def __init__(
        self,
        kinematics: ArmKinematics,
        boxes: Sequence[Box],
        body: ArmBody = ArmBody(),
        other_arm: FloatArray | None = None,
        grid: DistanceGrid | None = None,
        parameters: CollisionParameters = CollisionParameters(),
    ) -> None:
        self.kinematics = kinematics
        self.coarse_step, self.fine_step = parameters.coarse_step, parameters.fine_step
        self._constraint: Constraint | None = None
        self._names = [box.name for box in boxes]
        links, parts, local, pairs = _body_spheres(kinematics, body)
        distance = grid or NO_SURFACES
        self._arguments = (
            kinematics.base,
            kinematics.joints,
            kinematics.robot.body.first_moving,
            links,
            local,
            pairs,
            box_table(boxes),
            np.ascontiguousarray(np.empty((0, 4)) if other_arm is None else other_arm, float),
            np.ascontiguousarray(distance.distance),
            distance.lower,
            float(distance.h),
            float(parameters.self_overlap),
        )
        starts, other = group_starts(parts, local), self._arguments[7]
        other_starts = group_starts(np.zeros(len(other), np.int64), other)
        self._free_arguments = (
            *self._arguments[:5],
            *self._arguments[6:],
            starts,
            links[starts[:-1]],
            bounding_spheres(local, starts),
            group_pairs(pairs, starts),
            other_starts,
            bounding_spheres(other, other_starts),
        )

    def constrained(self, constraint: Constraint) -> "CollisionModel":
        """The same model in which joints are free only where they meet the constraint, too."""
        model = copy(self)
        model._constraint = constraint
        return model

    def free(self, q: FloatArray, margin: float) -> bool:
        """Whether the arm at joints (n,) lies within its limits and keeps `margin` metres from everything."""
        inside = bool(np.all((q >= self.kinematics.lower) & (q <= self.kinematics.upper)))
        free = inside and bool(_free(np.asarray(q, float), margin, *self._free_arguments))
        return free and (self._constraint is None or self._constraint.holds(q))

    def edge_free(self, qa: FloatArray, qb: FloatArray, margin: float, *, fine: bool = False) -> bool:
        """Whether the straight joint motion is free, its end included (not its start), checked coarsely or finely."""
        if self._constraint is not None and not self._constraint.holds_along(qa, qb):
            return False
        return self._edge_free(qa, qb, margin, self.fine_step if fine else self.coarse_step)

    def path_free(self, path: FloatArray, margin: float) -> bool:
        """Whether the joint path (k, n) is free from its first row to its last, checked finely."""
        edges = pairwise(np.asarray(path, float))
        return self.free(path[0], margin) and all(self.edge_free(a, b, margin, fine=True) for a, b in edges)

    def clearance(self, q: FloatArray) -> float:
        """Least distance (m) to anything, the arm's own links included; a negative one is a penetration depth."""
        return self.nearest(q)[0]

    def nearest(self, q: FloatArray) -> tuple[float, str]:
        """`clearance`, and the name of what is that near: a box's, 'other arm', 'seen surface' or 'itself'."""
        distance, what = _nearest(np.asarray(q, float), *self._arguments)
        names = {_ITSELF: "itself", _GRID: "seen surface", _OTHER_ARM: "other arm"}
        return float(distance), names[what] if what < 0 else self._names[what]

    def clearances(self, q: FloatArray) -> FloatArray:
        """Least distances (n,) m of the arm's `spheres` to boxes and seen surfaces."""
        base, joints, _, links, local, _, boxes, _, *grid = self._arguments[:-1]
        return np.asarray(_clearances(np.asarray(q, float), base, joints, links, local, boxes, *grid))

    def along(
        self, path: FloatArray, slopes: FloatArray, grid: DistanceGrid
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """The distances of the arm's m `spheres` along a path (k, n) of the joints, and how far each sphere moves.

        Returns the distances to a grid's surfaces and to what is rigid, the boxes and the other arms, (k, m) m each,
        and the ways (k, m) m for a unit of the parameter by which the path's derivatives are `slopes` (k, n).
        """
        base, joints, _, links, local, _, boxes, others = self._arguments[:8]
        rows = np.ascontiguousarray(path, float), np.ascontiguousarray(slopes, float)
        surfaces = np.ascontiguousarray(grid.distance), grid.lower, float(grid.h)
        to_grid, to_rigid, ways = _along(*rows, base, joints, links, local, boxes, others, *surfaces)
        return np.asarray(to_grid), np.asarray(to_rigid), np.asarray(ways)

    @property
    def links(self) -> NDArray[np.int64]:
        """The chain's links (n,) that the arm's spheres are on."""
        return self._arguments[3]

    def spheres(self, q: FloatArray) -> FloatArray:
        """The arm's spheres (n, 4) in world at joints (n,), for another arm's model."""
        base, joints, _, links, local = self._arguments[:5]
        return np.asarray(world_spheres(base, joints, np.asarray(q, float), links, local))

    def _edge_free(self, qa: FloatArray, qb: FloatArray, margin: float, step: float) -> bool:
        return bool(_edge_free(np.asarray(qa, float), np.asarray(qb, float), step, margin, *self._free_arguments))


def box_table(boxes: Sequence[Box]) -> FloatArray:
    """Boxes (n, 6) as compiled functions take them: centre and half edges, m."""
    return np.array([[*b.center, *(0.5 * s for s in b.size)] for b in boxes], float).reshape(-1, 6)


def _body_spheres(
    kinematics: ArmKinematics, body: ArmBody
) -> tuple[NDArray[np.int64], NDArray[np.int64], FloatArray, NDArray[np.int64]]:
    """An arm's spheres: their links and parts (n,), the spheres (n, 4) in the links, and pairs (m, 2) that can meet.

    A camera can meet all links before its own. What is carried can meet those up to the third before the last: the
    wrist turns with it.
    """
    robot = kinematics.robot
    own = robot.body
    links, parts, pairs = [own.links], [own.parts], own.pairs
    local = [own.at(robot.gripper.opening if body.opening is None else body.opening)]
    if body.camera_offset is not None:
        index, link_from_mount = robot.mounted
        links.append(np.full(len(CAMERA_ACROSS), index))
        parts.append(np.full(len(CAMERA_ACROSS), _CAMERA))
        pairs = np.vstack([pairs, _pairs(own.links < index, len(own.links), len(CAMERA_ACROSS))])
        x, y, z = body.camera_offset
        centers = np.array([[x, y + across, z] for across in CAMERA_ACROSS])
        local.append(np.column_stack([_moved(centers, link_from_mount), np.full(len(centers), CAMERA_RADIUS)]))
    if body.carried is not None and len(body.carried):
        carried = np.asarray(body.carried, float)
        pairs = np.vstack([pairs, _pairs(own.links <= len(kinematics) - 3, sum(map(len, links)), len(carried))])
        links.append(np.full(len(carried), len(kinematics)))
        parts.append(np.full(len(carried), _CARRIED))
        local.append(np.column_stack([_moved(carried[:, :3], kinematics.last_from_tool), carried[:, 3]]))
    return (
        np.concatenate(links).astype(np.int64),
        np.concatenate(parts),
        np.ascontiguousarray(np.concatenate(local)),
        np.ascontiguousarray(pairs),
    )


def _pairs(rows: Mask, first: int, count: int) -> NDArray[np.int64]:
    """Pairs (m, 2) of each of the `rows` (n,) that are true with `count` spheres from number `first` on."""
    own, more = np.meshgrid(np.flatnonzero(rows), first + np.arange(count), indexing="ij")
    return np.column_stack([own.ravel(), more.ravel()])


def _moved(points: FloatArray, pose: FloatArray) -> FloatArray:
    return np.asarray(points @ pose[:3, :3].T + pose[:3, 3])
