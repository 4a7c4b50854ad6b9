"""Where the hand's camera sees the fingers of its own hand: it measures the camera's place on the hand.

The mount of a camera is known to millimetres only. What is measured relative to the fingers, in the same picture, has
no such error (relative sensing; compare Hutchinson, Hager, Corke 1996, "A Tutorial on Visual Servo Control", IV-C).
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform

from regrasp.interfaces.arrays import ColorImage, FloatArray
from regrasp.interfaces.frame import RgbdFrame
from regrasp.interfaces.robot.parts import ParallelGripper
from regrasp.interfaces.robot.robot import Robot


@dataclass(frozen=True)
class HandViewParameters:
    """How the pads are found. Lengths in m."""

    search: int = 30  # px round where an edge should be: three standard deviations of the mount's errors
    gap_slack: float = 0.0025  # that the gap may be off: backlash and noise of the encoder; choice
    inside: tuple[float, float] = (0.15, 0.7)  # shares of a pad's thickness, from its inner edge, that show its top
    tip_rows: int = 14  # px below a pad's upper edge in which its depth is read; choice
    least_readings: int = 60  # of depth on the tips; choice: without noise there are 400
    tip_depth: tuple[float, float] = (0.8, 1.2)  # shares of the expected depth that count as a tip's
    frames: int = 30  # over which the picture is averaged: what stands behind the fingers moves; choice
    mount_deviation: float = 0.002  # of each axis of the mount; from calibration
    seen_deviation: float = 0.0004  # of an axis that was measured; choice: by simulated pictures


@dataclass(frozen=True, eq=False)
class Pads:
    """The pads of a hand: boxes of this `size` (length, thickness, height) m along the tool's axes.

    `middles` gives their middles (2, 3) m in the tool's frame for the gap (m) between them.
    """

    size: tuple[float, float, float]
    middles: Callable[[float], FloatArray]

    @classmethod
    def of(cls, robot: Robot) -> "Pads | None":
        """Those of a robot; None if its file does not say how large they are."""
        gripper = robot.gripper
        sizes = gripper.pads if isinstance(gripper, ParallelGripper) else gripper
        if sizes.length is None or sizes.height is None:
            return None
        size = (sizes.length, sizes.thickness, sizes.height)
        return cls(size, lambda gap: robot.pads_in_tool(min(max(gap, gripper.closed), gripper.opening)))


class HandView:
    """Averages what the camera shows of its own fingers, and finds the pads' inner edges, upper edges and tips in it.

    `tool_from_camera` is the mount as known.
    """

    def __init__(
        self, tool_from_camera: RigidTransform, pads: Pads, parameters: HandViewParameters = HandViewParameters()
    ) -> None:
        self._mount, self._pads, self._parameters = tool_from_camera.inv().as_matrix(), pads, parameters
        self._gap = np.nan  # m, of the pictures that were averaged
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
        """Take a picture in, made with the pads `gap` m apart by the encoder."""
        values, k = self._parameters, frame.intrinsics
        if not abs(gap - self._gap) < values.gap_slack:  # the fingers moved: begin anew
            self._gap, self._mean, self._count, self._depths = gap, None, 0, []
        length, thickness, height = self._pads.size
        place = self._pads.middles(self._gap).mean(axis=0) + np.array([0.5 * length, 0.0, 0.5 * height])
        tip = self._mount[:3, :3] @ place + self._mount[:3, 3]
        u, v = k.fx * tip[0] / tip[2] + k.cx, k.fy * tip[1] / tip[2] + k.cy
        separation, slack, wide = (k.fx * x / tip[2] for x in (self._gap, values.gap_slack, thickness))
        half = round(0.5 * separation) + 2 * values.search
        first_row, first_column = max(round(v) - values.search - 2, 0), max(round(u) - half, 0)
        near = slice(first_row, None), slice(first_column, round(u) + half)
        self._average(frame.rgb[near])
        inside = round(values.inside[0] * wide), round(values.inside[1] * wide)
        found = self._edges(u - first_column, v - first_row, separation, slack, inside)
        if found is None:
            return
        left, right, top = found[0] + first_column, found[1] + first_column, found[2] + first_row
        depth = self._tip_depth(frame, _tops(left, right, inside), top, float(tip[2]))
        z = float(tip[2]) if depth is None else depth
        seen = np.array([(0.5 * (left + right) - k.cx) * z / k.fx, (top - k.cy) * z / k.fy, z])
        self.offset = seen - tip
        self.deviation = np.full(3, values.seen_deviation)
        if depth is None:
            self.deviation[2] = values.mount_deviation

    def _average(self, rgb: ColorImage) -> None:
        picture = rgb.astype(np.float32)
        self._count = min(self._count + 1, self._parameters.frames)
        if self._mean is None:
            self._mean = picture
        else:
            self._mean += (picture - self._mean) / self._count

    def _edges(
        self, u: float, v: float, separation: float, slack: float, inside: tuple[int, int]
    ) -> tuple[float, float, float] | None:
        """The pads' inner edges and their upper edge, px, near where they should be; None if they are not seen."""
        values, mean = self._parameters, self._mean
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
        tops = _tops(left, right, inside)
        first, last = max(round(v) - values.search, 1), min(round(v) + values.search, height - 1)
        down = sum(np.abs(np.diff(mean[first : last + 1, part], axis=0)).sum(axis=2).mean(axis=1) for part in tops)
        top = int(np.argmax(down))
        return left, right, first + _subpixel(np.asarray(down), top) + 0.5

    def _pair(self, across: FloatArray, u: float, separation: float, slack: float) -> tuple[float, float] | None:
        """The two places, as far from each other as the pads are, where the picture changes most across."""
        search = self._parameters.search
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

    def _tip_depth(self, frame: RgbdFrame, tops: tuple[slice, slice], top: float, expected: float) -> float | None:
        """The depth (m, as the camera reads it) of the pads' tips; None if there are too few readings.

        On a pad's upper face, which is level, depth times the row below the horizon is the same everywhere.
        """
        values, k = self._parameters, frame.intrinsics
        rows = np.arange(int(np.ceil(top)) + 1, min(int(top) + 1 + values.tip_rows, k.height))
        readings = []
        for part in tops:
            depth = frame.depth[rows[0] : rows[-1] + 1, part] if len(rows) else np.empty((0, 0))
            good = (depth > values.tip_depth[0] * expected) & (depth < values.tip_depth[1] * expected)
            scaled = depth * (rows[:, None] - k.cy) / (top - k.cy)
            readings.append(scaled[good])
        self._depths = [*self._depths[-values.frames :], np.concatenate(readings)]
        together = np.concatenate(self._depths)
        return float(np.median(together)) if len(together) >= values.least_readings else None


def _tops(left: float, right: float, inside: tuple[int, int]) -> tuple[slice, slice]:
    """The columns that show the upper faces of the pads, whose inner edges these are."""
    near, far = inside
    first, last = max(round(left) - far, 0), max(round(left) - near, 1)
    return slice(first, last), slice(round(right) + near + 1, round(right) + far + 1)


def _subpixel(values: FloatArray, at: int) -> float:
    """The centre of mass of a peak of `values` (n,) about its highest place."""
    first, last = max(at - 1, 0), min(at + 2, len(values))
    weights = values[first:last]
    return float(np.arange(first, last) @ weights / max(float(weights.sum()), 1e-9))
