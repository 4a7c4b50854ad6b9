"""Where a picture shows the printed part's gripping section: by its colour, its known shape and the depth image."""

from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from regrasp.interfaces.arrays import DepthImage, FloatArray, Mask
from regrasp.interfaces.frame import Intrinsics, RgbdFrame
from regrasp.interfaces.printer.cell import PrintedPart
from regrasp.perception.camera.color import SegmentationParameters, color_mask
from regrasp.perception.camera.model import NEAREST_DEPTH, hull, pixel_rays


@dataclass(frozen=True)
class SectionViewParameters:
    """How the section is measured. Lengths in m."""

    search_step: int = 2  # of so many pixels one is looked at for the section's colour; choice
    grown: float = 1.3  # sizes of the section's box to each side of it, where the part may be; choice
    least_area: int = 60  # px of its colour; choice: it has 900 at 0.6 m
    least_readings: int = 30  # of depth on its front; choice
    near: float = 0.003  # from a plane that counts as on it: the noise at 0.6 m is 2 mm; choice
    plane_passes: int = 4  # of the fit, each without what the last one left beside
    full_width: float = 0.9  # of the widest row that a row must have to count: others are hidden in part; choice
    width_error: float = 0.12  # of the width that is expected, by which a whole one may differ; choice
    passes: int = 3  # in which its place is fitted to its outline; each changes it by less than a tenth of the last
    # standard deviations that do not shrink with more pictures: simulated pictures, 0.2 to 0.6 m
    deviation: float = 0.0005  # m, of each axis at `deviation_distance`; it grows with the distance
    deviation_distance: float = 0.2  # m
    yaw_deviation: float = 0.005  # rad there; it grows with the distance's square
    unknown_yaw: float = 0.2  # rad, where there is no depth
    most_pixels: int = 3000  # from which the plane is fitted: more from nearby tell no more


@dataclass(frozen=True, eq=False)
class SectionSighting:
    """The middle (3,) m of the section's front, in the tool's frame, and how far it is turned.

    `yaw` (rad) is the turn about the tool's z axis of the way into the part, from the tool's x axis. `deviation` (m) is
    of each axis, `yaw_deviation` (rad) of the yaw. Lengths are as the depth image scales them.
    `outline` (k, 2) px is that of a section of the known size there, in the picture.
    """

    stamp: float
    front: FloatArray
    yaw: float
    deviation: float
    yaw_deviation: float
    outline: FloatArray


@dataclass(frozen=True)
class NoSection:
    """Why a picture does not show the section, in a sentence."""

    stamp: float
    why: str


class SectionView:
    """Measures the section of one printed part."""

    def __init__(self, part: PrintedPart, parameters: SectionViewParameters = SectionViewParameters()) -> None:
        self._size = np.array(part.section.size)
        self._blue, self._red = (SegmentationParameters.for_color(c) for c in (part.section.color, part.color))
        self._parameters = parameters
        depth, width, height = self._size
        # The front's middle is the origin; x goes into the part.
        self._corners = np.array(
            [(x, y, z) for x in (0.0, depth) for y in (-width / 2, width / 2) for z in (-height / 2, height / 2)]
        )

    def find(self, frame: RgbdFrame, camera_from_tool: FloatArray) -> SectionSighting | NoSection:
        """The section in one picture of a camera at `camera_from_tool` (4, 4)."""
        values, k, step = self._parameters, frame.intrinsics, self._parameters.search_step
        blob = _largest(color_mask(np.ascontiguousarray(frame.rgb[::step, ::step]), self._blue))
        area = 0 if blob is None else int(blob[4]) * step**2
        if blob is None or area < values.least_area:
            return NoSection(frame.stamp, f"{area} pixels have its colour, {values.least_area} are needed")
        near = _grown(step * blob, k, values.grown)
        rgb = np.ascontiguousarray(frame.rgb[near])
        on_section, on_part = color_mask(rgb, self._blue) > 0, color_mask(rgb, self._red) > 0
        turn = camera_from_tool[:3, :3].astype(np.float32)
        few = (slice(None, None, max(1, round(np.sqrt(on_section.size / (8 * values.most_pixels))))),) * 2
        rays = pixel_rays(k)[near][few] @ turn  # in the tool's axes
        by_size = False
        plane = self._plane(frame.depth[near][few], rays, _eroded(on_section)[few], _eroded(on_part)[few])
        outline = _outline(on_section, values.full_width)
        if plane is None:  # too few depths: by how wide it looks
            ahead = k.fx * self._size[1] / (outline[1] - outline[0])
            plane, by_size = np.array([ahead, 0.0]), True
        return self._fitted(frame, near, outline, plane, by_size, camera_from_tool)

    def _plane(
        self, depth: DepthImage, rays: NDArray[np.floating[Any]], section: Mask, part: Mask
    ) -> FloatArray | None:
        """The upright plane of the section's front, x = a + b y in the tool's axes about the camera: (a, b).

        The front of the part behind it is parallel, and both are fitted together.
        """
        values = self._parameters
        read = depth > NEAREST_DEPTH
        clouds = [rays[mask & read] * depth[mask & read, None] for mask in (section, part)]
        if len(clouds[0]) < values.least_readings:
            return None
        # The section's front is the nearest of what has its colour, the part's front lies its depth behind.
        fronts = [float(np.quantile(clouds[0][:, 0], 0.3))]
        fronts.append(fronts[0] + self._size[0])
        a, slope, slack = np.array(fronts), 0.0, 3.0 * values.near
        for _ in range(values.plane_passes):
            rows, target, groups = [], [], []
            for i, cloud in enumerate(clouds):
                near = np.abs(cloud[:, 0] - a[i] - slope * cloud[:, 1]) < slack
                rows.append(cloud[near, 1])
                target.append(cloud[near, 0])
                groups.append(np.full(int(near.sum()), i))
            y, x, g = np.concatenate(rows), np.concatenate(target), np.concatenate(groups)
            counts = np.bincount(g, minlength=2)
            if counts[0] < values.least_readings:
                return None
            means_y = np.bincount(g, y, 2) / np.maximum(counts, 1)
            means_x = np.bincount(g, x, 2) / np.maximum(counts, 1)
            dy, dx = y - means_y[g], x - means_x[g]
            slope = float(dy @ dx / max(float(dy @ dy), 1e-12))
            a = np.where(counts > 0, means_x - slope * means_y, a)
            if counts[1] == 0:
                a[1] = a[0] + self._size[0]
            slack = max(0.5 * slack, values.near)
        return np.array([a[0], slope])

    def _fitted(
        self,
        frame: RgbdFrame,
        near: tuple[slice, slice],
        edges: tuple[float, float, float],
        plane: FloatArray,
        by_size: bool,
        camera_from_tool: FloatArray,
    ) -> SectionSighting | NoSection:
        """The place at which the section's outline would have the seen sides and the seen upper edge.

        `by_size`: its distance is not by depth, but by how wide it looks, and it may be turned.
        """
        values, k = self._parameters, frame.intrinsics
        left, right, top = edges[0] + near[1].start, edges[1] + near[1].start, edges[2] + near[0].start
        turn, shift = camera_from_tool[:3, :3], camera_from_tool[:3, 3]
        camera = -shift @ turn  # in the tool's frame
        yaw = float(np.arctan(-plane[1]))
        c, s = np.cos(yaw), np.sin(yaw)
        corners = self._corners @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
        at_left, at_right = left < 1.0, right > k.width - 2.0
        # begin where the sight through the middle of the outline meets the plane
        ray = np.array([(0.5 * (left + right) - k.cx) / k.fx, (top - k.cy) / k.fy, 1.0]) @ turn
        x = plane[0] / max(ray[0] - plane[1] * ray[1], 1e-6) * ray
        place = camera + x - [0.0, 0.0, self._size[2] / 2]
        for _ in range(values.passes):
            points = (corners + place) @ turn.T + shift
            u, v = k.fx * points[:, 0] / points[:, 2] + k.cx, k.fy * points[:, 1] / points[:, 2] + k.cy
            expected = float(u.max() - u.min())
            z = float(points[:, 2].min())
            whole = abs(right - left - expected) < values.width_error * expected + 2.0
            if whole and not at_left and not at_right:
                across = 0.5 * (left + right - u.min() - u.max())
            elif at_left or (not at_right and right < 0.5 * k.width):
                across = right - u.max()
            else:
                across = left - u.min()
            step = np.array([across * z / k.fx, (top - v.min()) * z / k.fy, 0.0]) @ turn
            place = place + np.array([0.0, step[1], step[2]])
            place[0] = camera[0] + plane[0] + plane[1] * (place[1] - camera[1])
        outline = hull((corners + place) @ turn.T + shift, k)
        distance = float(place[0] - camera[0])
        deviation = values.deviation * max(1.0, distance / values.deviation_distance) * (1.0 if whole else 3.0)
        if by_size:
            deviation += distance / (right - left)  # of 1 px
            return SectionSighting(frame.stamp, place, yaw, deviation, values.unknown_yaw, outline)
        yaw_deviation = values.yaw_deviation * max(1.0, distance / values.deviation_distance) ** 2
        return SectionSighting(frame.stamp, place, yaw, deviation, yaw_deviation, outline)


def _largest(mask: NDArray[np.uint8]) -> FloatArray | None:
    """Left, top, width, height and area of the mask's largest blob; None if it is empty."""
    _, _, boxes, _ = cv2.connectedComponentsWithStats(mask, connectivity=8)
    return boxes[1 + int(np.argmax(boxes[1:, cv2.CC_STAT_AREA]))] if len(boxes) > 1 else None


def _grown(blob: FloatArray, k: Intrinsics, factor: float) -> tuple[slice, slice]:
    """Rows and columns of a blob's box, grown by its size to each side in which the part may be."""
    left, top, width, height = (int(x) for x in blob[:4])
    u, v = round(factor * width), round(factor * height)
    return slice(max(top - v, 0), min(top + height + v, k.height)), slice(
        max(left - u, 0), min(left + width + u, k.width)
    )


def _eroded(mask: Mask) -> Mask:
    return cv2.erode(mask.astype(np.uint8), np.ones((3, 3), np.uint8)) > 0


def _outline(mask: Mask, full: float) -> tuple[float, float, float]:
    """Left, right and upper edge of a mask (h, w), px, from its rows that are as wide as the widest."""
    rows = np.flatnonzero(mask.any(axis=1))
    lefts = mask[rows].argmax(axis=1)
    rights = mask.shape[1] - 1 - mask[rows, ::-1].argmax(axis=1)
    widths = rights - lefts + 1
    wide = widths >= full * np.quantile(widths, 0.9)
    left, right = float(lefts[wide].mean()) - 0.5, float(rights[wide].mean()) + 0.5
    middle = mask[:, round(left + 0.2 * (right - left)) : round(right - 0.2 * (right - left)) + 1]
    columns = middle[:, middle.any(axis=0)]
    top = float(columns.argmax(axis=0).mean()) - 0.5 if columns.size else float(rows[0]) - 0.5
    return left, right, top
