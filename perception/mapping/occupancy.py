"""A voxel map of obstacles from depth images: what an arm must keep clear of besides the boxes that it knows."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum

import cv2
import numba
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform

from regrasp.interfaces.arrays import ColorImage, DepthImage, FloatArray, Mask
from regrasp.interfaces.cell import Box, MappedRegion
from regrasp.interfaces.fields import Color
from regrasp.interfaces.frame import Intrinsics, RgbdFrame
from regrasp.perception.camera.color import SegmentationParameters, color_mask
from regrasp.perception.camera.model import pixel_rays, project, subsampled

Spheres = tuple[FloatArray, FloatArray]  # centres (n, 3) m in the world, radii (n,) m

NO_READING = 1e3  # m; farther than any reading


@dataclass(frozen=True)
class OccupancyParameters:
    """Resolution of the map, and which depth readings are obstacles."""

    pixel_step: int = 4  # px; choice: the readings are 5 mm apart at 0.75 m
    known_margin: float = 0.025  # m; choice: depth scale 1.5 % of 0.85 m is 13 mm, camera pose 6 mm, noise 4 mm
    robot_margin: float = 0.02  # m; choice: arms are 5 mm off, depth scale 13 mm
    assumed_depth: float = 0.08  # m; choice: how far an obstacle reaches behind its surface until a view shows it
    least_depth: float = 0.03  # m; choice: so far every obstacle reaches behind its surface, until a view shows it
    shadow_depth: float = 0.25  # m; choice: no obstacle reaches further behind its surface
    max_depth_step: float = 0.03  # m between neighbours; more is an edge, where readings fly between the surfaces
    max_cable_brightness: int = 45  # of 255; choice: the cable's 0.06 is 15 in full light
    cable_width: float = 0.0075  # m; choice: dark pixels nearer to lighter ones are cable (7 mm), or a dark thing's rim
    overrule_range: float = 1.1  # choice: a look from up to this many times the range overrules the one before


@dataclass(frozen=True)
class Spared:
    """A thing that is no obstacle, as it is what a hand shall take: its RGB colour, each 0 to 1, and `thickness` m.

    With it what is thin and black is its cable, and no obstacle either.
    """

    color: Color
    thickness: float


class Voxel(IntEnum):
    """What is known of a voxel."""

    UNSEEN = 0
    FREE = 1  # a ray passed through
    SHADOW = 2  # so far behind a seen surface that it is assumed free
    BEHIND = 3  # behind a seen surface: assumed full
    INSIDE = 4  # so near behind a seen surface that it belongs to the thing
    SURFACE = 5  # seen


class Occupancy:
    """Voxels of a region of the world. Known boxes are left out: they are checked exactly elsewhere."""

    def __init__(
        self,
        region: MappedRegion,
        known: Sequence[Box],
        spared: Spared | None = None,
        parameters: OccupancyParameters = OccupancyParameters(),
    ) -> None:
        """The region is in the world frame. `known` boxes and the `spared` do not count."""
        size, lower, upper = region.voxel, np.array(region.lower), np.array(region.upper)
        counts = np.ceil((upper - lower) / size - 1e-9).astype(int)
        along = [low + (np.arange(count) + 0.5) * size for low, count in zip(lower, counts, strict=True)]
        centers = np.stack(np.meshgrid(*along, indexing="ij"), axis=-1).reshape(-1, 3)
        self.voxel_size = size
        self._known, self._parameters = known, parameters
        self._centers = np.ascontiguousarray(centers[~near_boxes(centers, known, parameters.known_margin)])
        self._state = np.zeros(len(self._centers), np.uint8)
        self._range = np.full(len(self._centers), np.inf, np.float32)  # m, of the look that decided the state
        self._color = None if spared is None else SegmentationParameters.for_color(spared.color)
        self._thickness = 0.0 if spared is None else spared.thickness

    def occupied_points(self, least: Voxel = Voxel.BEHIND) -> FloatArray:
        """Centres (n, 3) m, world frame, of the voxels that are full, or assumed to be, from `least` on."""
        return np.asarray(self._centers[self._state >= least])

    def unseen_points(self) -> FloatArray:
        """Centres (n, 3) m, world frame, of the voxels that may as well be empty: further behind a seen surface."""
        return np.asarray(self._centers[self._state == Voxel.BEHIND])

    def shadow_points(self) -> FloatArray:
        """Centres (n, 3) m, world frame, of the voxels still further behind a seen surface, where a thing may reach."""
        return np.asarray(self._centers[self._state == Voxel.SHADOW])

    def integrate(
        self,
        frame: RgbdFrame,
        world_from_camera: RigidTransform,
        ignore: Sequence[Spheres] = (),
        *,
        guess_behind: bool = True,
    ) -> None:
        """Take in a frame. Depth readings near the `ignore` spheres, which stand for the arms, are no obstacles.

        Each voxel in view is compared with the reading on its pixel: before it the voxel is free, at it a surface.
        With `guess_behind`, voxels up to the assumed depth behind it count as full until a reading shows otherwise. A
        reading replaces a guess, and an older reading unless that was taken from much closer.
        """
        step = self._parameters.pixel_step
        k = subsampled(frame.intrinsics, step)
        depth = cv2.medianBlur(np.where(np.isfinite(frame.depth), frame.depth, 0), 3)[::step, ::step]
        red = self._spared(frame.rgb)
        free_depth = np.where(depth > 0, _min_filter(depth) - self.voxel_size, 0)
        # Where the spared thing is, no obstacle is: a guess that covers it must not keep the hand away.
        found = _min_filter(np.where(red[::step, ::step] > 0, depth, np.float32(0)))
        beside = (found < NO_READING) & (depth > found - self._thickness)
        free_depth = np.where(beside, np.maximum(free_depth, found + self._thickness), free_depth)
        solid = (depth > 0) & ~self._edges(depth) & ~self._cable(frame.rgb, depth, k)
        solid &= cv2.dilate(red, np.ones((5, 5), np.uint8))[::step, ::step] == 0
        points = world_from_camera.apply((pixel_rays(k) * depth[..., None])[solid])
        known = near_boxes(points, self._known, self._parameters.known_margin)
        solid[solid] = ~(known | _near_spheres(points, ignore, self._parameters.robot_margin))
        local = world_from_camera.inv().apply(self._centers)
        pixels = np.nan_to_num(np.rint(project(local, k)), nan=-1.0)
        seen = np.flatnonzero(np.all((pixels >= 0) & (pixels < [k.width, k.height]), axis=1))
        u, v = pixels[seen].astype(int).T
        self._update(seen, local[seen, 2], depth[v, u], free_depth[v, u], solid[v, u], guess_behind)

    def _update(
        self,
        seen: NDArray[np.intp],
        z: FloatArray,
        reading: DepthImage,
        free_depth: DepthImage,
        solid: Mask,
        guess_behind: bool,
    ) -> None:
        """Compare voxels `seen` (n,) at depth `z` (m) with their pixels: the `reading`, and the end of free space."""
        free = z < free_depth
        surface = solid & (np.abs(z - reading) <= self.voxel_size)
        state = self._state[seen]
        near_enough = z <= self._parameters.overrule_range * self._range[seen]
        may_change = (state != Voxel.FREE) & (state != Voxel.SURFACE) | near_enough
        for shown, value in ((free, Voxel.FREE), (surface, Voxel.SURFACE)):
            chosen = seen[shown & may_change]
            self._state[chosen] = value
            self._range[chosen] = z[shown & may_change]
        if guess_behind:
            values = self._parameters
            for depth, value in (
                (values.shadow_depth, Voxel.SHADOW),
                (values.assumed_depth, Voxel.BEHIND),
                (values.least_depth, Voxel.INSIDE),
            ):
                behind = solid & (z > reading + self.voxel_size) & (z <= reading + depth)
                self._state[seen[behind & (state <= value) & (state != Voxel.FREE)]] = value

    def _spared(self, rgb: ColorImage) -> NDArray[np.uint8]:
        """255 where the colour is that of the spared thing, else 0; (H, W)."""
        return np.zeros(rgb.shape[:2], np.uint8) if self._color is None else color_mask(rgb, self._color)

    def _cable(self, rgb: ColorImage, depth: DepthImage, k: Intrinsics) -> Mask:
        """Dark pixels near to lighter ones, as a cable's are; a dark obstacle loses only its rim by this."""
        if self._color is None:
            return np.zeros(depth.shape, np.bool_)
        step, dark_limit = self._parameters.pixel_step, self._parameters.max_cable_brightness
        dark = np.ascontiguousarray(rgb[::step, ::step]).max(axis=2) < dark_limit
        inside = cv2.distanceTransform(dark.astype(np.uint8), cv2.DIST_L2, 3) - 0.5
        return np.asarray(dark & (inside * depth / k.fx < self._parameters.cable_width))

    def _edges(self, depth: DepthImage) -> Mask:
        """Pixels at a depth edge, by their 3x3 neighbourhood: thin things, and readings that fly between surfaces."""
        farthest = cv2.dilate(depth, np.ones((3, 3), np.uint8))
        return np.asarray(farthest - _min_filter(depth) > self._parameters.max_depth_step)


def near_boxes(points: FloatArray, boxes: Sequence[Box], margin: float) -> Mask:
    """Whether each of `points` (n, 3) m is inside one of `boxes` or within `margin` m of it; (n,)."""
    near = np.zeros(len(points), np.bool_)
    centers = np.array([box.center for box in boxes], float).reshape(-1, 3)
    sizes = np.array([box.size for box in boxes], float).reshape(-1, 3)
    _mark_near_boxes(points, centers, 0.5 * sizes, margin**2, near)
    return near


def _near_spheres(points: FloatArray, groups: Sequence[Spheres], margin: float) -> Mask:
    near = np.zeros(len(points), np.bool_)
    for centers, radii in groups:
        _mark_near(points, centers, (radii + margin) ** 2, near)
    return near


@numba.njit(cache=True)
def _mark_near(points: FloatArray, centers: FloatArray, squares: FloatArray, near: Mask) -> None:
    """Mark in `near` (n,) the points (n, 3) whose squared distance to a centre (m, 3) is at most its `squares` (m,)."""
    for n in range(len(points)):
        for m in range(len(centers)):
            x, y, z = points[n, 0] - centers[m, 0], points[n, 1] - centers[m, 1], points[n, 2] - centers[m, 2]
            if x * x + y * y + z * z <= squares[m]:
                near[n] = True
                break


@numba.njit(cache=True)
def _mark_near_boxes(points: FloatArray, centers: FloatArray, halves: FloatArray, square: float, near: Mask) -> None:
    """Mark in `near` (n,) the points (n, 3) whose squared distance to a box is at most `square`; (m, 3) half sizes."""
    for n in range(len(points)):
        for m in range(len(centers)):
            distance = 0.0
            for i in range(3):
                distance += max(abs(points[n, i] - centers[m, i]) - halves[m, i], 0.0) ** 2
            if distance <= square:
                near[n] = True
                break


def _min_filter(depth: DepthImage) -> DepthImage:
    """The nearest reading in each pixel's 3x3 neighbourhood; `NO_READING` where there is none."""
    readings = np.where(depth > 0, depth, np.float32(NO_READING))
    return np.asarray(cv2.erode(readings, np.ones((3, 3), np.uint8)), np.float32)
