"""Where the hand's camera sees the fingers of its own hand: it measures the camera's place on the hand.

The mount of a camera is known to millimetres only. What is measured relative to the fingers, in the same picture, has
no such error (relative sensing; compare Hutchinson, Hager, Corke 1996, "A Tutorial on Visual Servo Control", IV-C).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform

from regrasp.interfaces.arrays import ColorImage, FloatArray
from regrasp.interfaces.frame import RgbdFrame


@dataclass(frozen=True)
class HandViewParameters:
    """The pads of the hand (a Robotiq 2F-85's, by its model), and how they are found. Lengths in m."""

    length: float = 0.0375  # of a pad, along the finger
    height: float = 0.022
    thickness: float = 0.00635
    gap: float = 0.05  # between the pads, for which `behind` holds
    behind: float = 0.0030  # from the tool point back to the middle of the pads, whose linkage swings as they open
    search: int = 30  # px round where an edge should be: three standard deviations of the mount's errors
    gap_slack: float = 0.0025  # that the gap may be off: backlash and noise of the encoder; choice
    tip_rows: int = 14  # px below a pad's upper edge in which its depth is read; choice
    least_readings: int = 60  # of depth on the tips; choice: without noise there are 400
    tip_depth: tuple[float, float] = (0.8, 1.2)  # shares of the expected depth that count as a tip's
    frames: int = 30  # over which the picture is averaged: what stands behind the fingers moves; choice
    mount_deviation: float = 0.002  # of each axis of the mount; from calibration
    seen_deviation: float = 0.0004  # of an axis that was measured; choice: by simulated pictures


class HandView:
    """Averages what the camera shows of its own fingers, and finds the pads' inner edges, upper edges and tips in it.

    `tool_from_camera` is the mount as known. The jaw must stand open by the parameters' gap.
    """

    def __init__(self, tool_from_camera: RigidTransform, parameters: HandViewParameters = HandViewParameters()) -> None:
        self._mount, self._parameters = tool_from_camera.inv().as_matrix(), parameters
        self._mean: NDArray[np.float32] | None = None
        self._depths: list[FloatArray] = []
        self._count = 0
        self.offset: FloatArray = np.zeros(3)
        self.deviation: FloatArray = np.full(3, parameters.mount_deviation)

    @property
    def camera_from_tool(self) -> FloatArray:
        """The mount (4, 4) as measured: as known until the fingers were seen."""
        measured = self._mount.copy()
        measured[:3, 3] += self.offset
        return measured

    def feed(self, frame: RgbdFrame, gap: float) -> None:
        """Take a picture in, made with the pads about `gap` m apart by the encoder."""
        values, k = self.parameters, frame.intrinsics
        if abs(gap - values.gap) > values.gap_slack:
            return
        place = np.array([0.5 * values.length - values.behind, 0.0, 0.5 * values.height])
        tip = self._mount[:3, :3] @ place + self._mount[:3, 3]
        u, v = k.fx * tip[0] / tip[2] + k.cx, k.fy * tip[1] / tip[2] + k.cy
        separation, slack = k.fx * gap / tip[2], k.fx * values.gap_slack / tip[2]
        half = round(0.5 * k.fx * values.gap / tip[2]) + 2 * values.search
        first_row, first_column = max(round(v) - values.search - 2, 0), max(round(u) - half, 0)
        near = slice(first_row, None), slice(first_column, round(u) + half)
        self._average(frame.rgb[near])
        found = self._edges(u - first_column, v - first_row, separation, slack)
        if found is None:
            return
        left, right, top = found[0] + first_column, found[1] + first_column, found[2] + first_row
        depth = self._tip_depth(frame, left, right, top, float(tip[2]))
        z = float(tip[2]) if depth is None else depth
        seen = np.array([(0.5 * (left + right) - k.cx) * z / k.fx, (top - k.cy) * z / k.fy, z])
        self.offset = seen - tip
        self.deviation = np.array([values.seen_deviation] * 3)
        if depth is None:
            self.deviation[2] = values.mount_deviation

    @property
    def parameters(self) -> HandViewParameters:
        """Those it was made with."""
        return self._parameters

    def _average(self, rgb: ColorImage) -> None:
        picture = rgb.astype(np.float32)
        self._count = min(self._count + 1, self.parameters.frames)
        if self._mean is None:
            self._mean = picture
        else:
            self._mean += (picture - self._mean) / self._count

    def _edges(self, u: float, v: float, separation: float, slack: float) -> tuple[float, float, float] | None:
        """The pads' inner edges and their upper edge, px, near where they should be; None if they are not seen."""
        values, mean = self.parameters, self._mean
        assert mean is not None
        height = len(mean)
        low, high = round(v) + values.search // 2, min(round(v) + 2 * values.search, height)
        if high - low < values.search // 2:
            return None
        across = np.abs(np.diff(mean[low:high], axis=1)).sum(axis=2).mean(axis=0)  # (W - 1,)
        middle = self._pair(across, u, separation, slack)
        if middle is None:
            return None
        left, right = middle
        inside = [slice(round(left) - 14, round(left) - 3), slice(round(right) + 4, round(right) + 15)]
        first, last = max(round(v) - values.search, 1), min(round(v) + values.search, height - 1)
        down = sum(np.abs(np.diff(mean[first : last + 1, part], axis=0)).sum(axis=2).mean(axis=1) for part in inside)
        top = int(np.argmax(down))
        return left, right, first + _subpixel(np.asarray(down), top) + 0.5

    def _pair(self, across: FloatArray, u: float, separation: float, slack: float) -> tuple[float, float] | None:
        """The two places, as far from each other as the pads are, where the picture changes most across."""
        search = self.parameters.search
        lefts = np.arange(round(u - 0.5 * separation) - search, round(u - 0.5 * separation) + search + 1)
        apart = np.arange(int(separation - slack), int(separation + slack) + 2)
        rights = lefts[:, None] + apart[None]
        lefts = np.broadcast_to(lefts[:, None], rights.shape)
        good = (lefts >= 1) & (rights < len(across) - 1)
        if not good.any():
            return None
        score = np.where(
            good,
            np.minimum(across[np.clip(lefts, 0, len(across) - 1)], across[np.clip(rights, 0, len(across) - 1)]),
            -1.0,
        )
        i, j = np.unravel_index(np.argmax(score), score.shape)
        left, right = int(lefts[i, j]), int(rights[i, j])
        return _subpixel(across, left) + 0.5, _subpixel(across, right) + 0.5

    def _tip_depth(self, frame: RgbdFrame, left: float, right: float, top: float, expected: float) -> float | None:
        """The depth (m, as the camera reads it) of the pads' tips; None if there are too few readings.

        On a pad's upper face, which is level, depth times the row below the horizon is the same everywhere.
        """
        values, k = self.parameters, frame.intrinsics
        rows = np.arange(int(np.ceil(top)) + 1, min(int(top) + 1 + values.tip_rows, k.height))
        readings = []
        for part in (slice(round(left) - 16, round(left) - 2), slice(round(right) + 3, round(right) + 17)):
            depth = frame.depth[rows[0] : rows[-1] + 1, part] if len(rows) else np.empty((0, 0))
            good = (depth > values.tip_depth[0] * expected) & (depth < values.tip_depth[1] * expected)
            scaled = depth * (rows[:, None] - k.cy) / (top - k.cy)
            readings.append(scaled[good])
        self._depths = [*self._depths[-values.frames :], np.concatenate(readings)]
        together = np.concatenate(self._depths)
        return float(np.median(together)) if len(together) >= values.least_readings else None


def _subpixel(values: FloatArray, at: int) -> float:
    """The centre of mass of a peak of `values` (n,) about its highest place."""
    first, last = max(at - 1, 0), min(at + 2, len(values))
    weights = values[first:last]
    return float(np.arange(first, last) @ weights / max(float(weights.sum()), 1e-9))
