"""Obstacles from depth images: what an arm must keep clear of besides the boxes that it was told of."""

from collections.abc import Sequence
from enum import IntEnum

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform

from regrasp.interfaces.cell import Box, Connector
from regrasp.interfaces.frame import Intrinsics, RgbdFrame
from regrasp.perception.camera.model import project, rays, subsampled
from regrasp.perception.pose.segmentation import SegmentationParameters, color_mask

FloatArray = NDArray[np.float64]
Depth = NDArray[np.float32]
Mask = NDArray[np.bool_]
Spheres = tuple[FloatArray, FloatArray]  # centres (n, 3) m in the world, radii (n,) m

STEP = 4  # pixels; choice: 5 mm apart at 0.75 m, a third of a voxel
KNOWN_MARGIN = 0.025  # m; choice: depth scale 1.5 % of 0.85 m is 13 mm, camera pose 6 mm, noise 4 mm
ASSUMED_DEPTH = 0.08  # m; choice: how far an obstacle reaches behind its seen surface until a view shows otherwise
EDGE = 0.03  # m; neighbours that differ by more are an edge, where depth readings fly between the surfaces
ROBOT_MARGIN = 0.02  # m; choice: arms are 5 mm off, depth scale 13 mm
DARK = 45  # of 255; choice: the cable's 0.06 is 15 in full light
THIN = 0.0075  # m; choice: a dark pixel nearer than this to a lighter one is cable (7 mm) or the rim of a dark thing
NOTHING = 1e3  # m; farther than any reading
CLOSER = 1.1  # choice: a look from up to this many times the range may overrule the one before


class Voxel(IntEnum):
    """What is known of a voxel."""

    UNSEEN = 0
    FREE = 1  # looked through
    BEHIND = 2  # assumed full: behind a seen surface
    SURFACE = 3  # seen


class Occupancy:
    """Voxels of a region of the world. Known boxes are left to those who check them exactly."""

    def __init__(
        self, lower: FloatArray, upper: FloatArray, known: Sequence[Box], connector: Connector, h: float = 0.015
    ) -> None:
        """Region from `lower` to `upper` (3,) m in voxels of edge `h` m. `known` boxes and connector do not count."""
        counts = np.ceil((upper - lower) / h - 1e-9).astype(int)
        grid = np.moveaxis(np.indices(tuple(counts)), 0, -1).reshape(-1, 3)
        centers = lower + (grid + 0.5) * h
        self.h = h
        self._known = known
        self._centers = np.ascontiguousarray(centers[~near_boxes(centers, known)])
        self._state = np.zeros(len(self._centers), np.uint8)
        self._range = np.full(len(self._centers), np.inf, np.float32)  # of the look that decided the state
        self._color = SegmentationParameters.for_color(connector.color)
        self._thickness = 2 * connector.radius

    def occupied_points(self, *, guessed: bool = True) -> FloatArray:
        """Centres (n, 3) m, world frame, of the voxels seen to be full, and with `guessed` of those assumed to be."""
        return np.asarray(self._centers[self._state >= (Voxel.BEHIND if guessed else Voxel.SURFACE)])

    def integrate(
        self,
        frame: RgbdFrame,
        world_from_camera: RigidTransform,
        ignore: Sequence[Spheres] = (),
        assumed_depth: float = ASSUMED_DEPTH,
    ) -> None:
        """Take in a frame. Depth readings within `ROBOT_MARGIN` of the `ignore` spheres, the arms, are no obstacles.

        Each voxel in view is compared with the reading on its pixel: before it the voxel is free, at it a surface, up
        to `assumed_depth` m behind it assumed full. A look overrules a guess, and any look but from much closer.
        """
        k = subsampled(frame.intrinsics, STEP)
        depth = cv2.medianBlur(np.where(np.isfinite(frame.depth), frame.depth, 0), 3)[::STEP, ::STEP]
        red = color_mask(frame.rgb, self._color)
        through = np.where(depth > 0, _nearest_around(depth) - self.h, 0)
        # Where the connector is, no obstacle is: a guess that covers it must not keep the hand away.
        found = _nearest_around(np.where(red[::STEP, ::STEP] > 0, depth, np.float32(0)))
        beside = (found < NOTHING) & (depth > found - self._thickness)
        through = np.where(beside, np.maximum(through, found + self._thickness), through)
        solid = (depth > 0) & ~_edges(depth) & ~_thin(frame.rgb, depth, k)
        solid &= cv2.dilate(red, np.ones((5, 5), np.uint8))[::STEP, ::STEP] == 0
        points = world_from_camera.apply((rays(k) * depth[..., None])[solid])
        solid[solid] = ~(near_boxes(points, self._known) | _near_spheres(points, ignore))
        local = world_from_camera.inv().apply(self._centers)
        pixels = np.nan_to_num(np.rint(project(local, k)), nan=-1.0)
        seen = np.flatnonzero(np.all((pixels >= 0) & (pixels < [k.width, k.height]), axis=1))
        u, v = pixels[seen].astype(int).T
        self._update(assumed_depth, seen, local[seen, 2], depth[v, u], through[v, u], solid[v, u])

    def _update(
        self, assumed_depth: float, seen: NDArray[np.intp], z: FloatArray, reading: Depth, through: Depth, solid: Mask
    ) -> None:
        """Voxels `seen` (n,) at depth `z` against their pixels: the `reading`, and how far one looks `through`."""
        free = z < through
        surface = solid & (np.abs(z - reading) <= self.h)
        behind = solid & (z > reading + self.h) & (z <= reading + assumed_depth)
        state = self._state[seen]
        open_to_look = (state == Voxel.UNSEEN) | (state == Voxel.BEHIND) | (z <= CLOSER * self._range[seen])
        for looked, value in ((free, Voxel.FREE), (surface, Voxel.SURFACE)):
            chosen = seen[looked & open_to_look]
            self._state[chosen] = value
            self._range[chosen] = z[looked & open_to_look]
        self._state[seen[behind & (state == Voxel.UNSEEN)]] = Voxel.BEHIND


def near_boxes(points: FloatArray, boxes: Sequence[Box]) -> Mask:
    """Whether each of `points` (n, 3) m is inside one of `boxes` or within `KNOWN_MARGIN` of it."""
    near = np.zeros(len(points), np.bool_)
    for box in boxes:
        beyond = np.maximum(np.abs(points - box.center) - 0.5 * np.asarray(box.size), 0.0)
        near |= np.einsum("ij,ij->i", beyond, beyond) <= KNOWN_MARGIN**2
    return near


def _near_spheres(points: FloatArray, groups: Sequence[Spheres]) -> Mask:
    near = np.zeros(len(points), np.bool_)
    for centers, radii in groups:
        squared = (points**2).sum(axis=1)[:, None] + (centers**2).sum(axis=1) - 2 * points @ centers.T
        near |= np.any(squared <= (radii + ROBOT_MARGIN) ** 2, axis=1)
    return near


def _thin(rgb: NDArray[np.uint8], depth: Depth, k: Intrinsics) -> Mask:
    """Dark pixels near to lighter ones, as the cable's are; of a dark obstacle this costs the rim alone."""
    dark = np.ascontiguousarray(rgb[::STEP, ::STEP]).max(axis=2) < DARK
    inside = cv2.distanceTransform(dark.astype(np.uint8), cv2.DIST_L2, 3) - 0.5
    return np.asarray(dark & (inside * depth / k.fx < THIN))


def _edges(depth: Depth) -> Mask:
    """Pixels whose 3x3 readings lie further apart than `EDGE`: thin things, flying readings."""
    farthest = cv2.dilate(depth, np.ones((3, 3), np.uint8))
    return np.asarray(farthest - _nearest_around(depth) > EDGE)


def _nearest_around(depth: Depth) -> Depth:
    """The nearest reading in each pixel's 3x3 neighbourhood; `NOTHING` where there is none."""
    return np.asarray(cv2.erode(np.where(depth > 0, depth, np.float32(NOTHING)), np.ones((3, 3), np.uint8)), np.float32)
