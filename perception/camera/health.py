"""Can a camera be trusted? Judged from its frames alone: their stamps, brightness, depth, and that they change."""

from dataclasses import dataclass

import numpy as np

from regrasp.interfaces.arrays import DepthImage
from regrasp.interfaces.frame import RgbdFrame


@dataclass(frozen=True)
class CameraHealthParameters:
    """Limits beyond which a camera is not trusted."""

    max_frame_age: float = 0.5  # s without a new frame: seven frames in a row lost at 15 Hz
    min_brightness: float = 10.0  # mean of 0 to 255; the cell in full shadow has over 30
    min_depth_share: float = 0.05  # share of the pixels with a depth reading; a view of the cell has over a half
    max_repeats: int = 2  # frames in a row with the same depth: measured depth never repeats to the bit
    pixel_step: int = 4  # px; only every fourth row and column is read, for speed


class CameraHealth:
    """Takes in the frames of one camera, in order, and says what is wrong with it."""

    def __init__(self, camera: str, parameters: CameraHealthParameters = CameraHealthParameters()) -> None:
        self._camera, self._parameters = camera, parameters
        self._number = 0
        self._stamp = 0.0  # a camera that never gives a frame is late from the beginning
        self._depth: DepthImage | None = None
        self._repeats = 0
        self._brightness = 255.0
        self._depth_share = 1.0

    def feed(self, frame: RgbdFrame) -> None:
        """Take in the newest frame; one that was fed before is ignored."""
        if frame.number == self._number:
            return
        step = self._parameters.pixel_step
        depth = frame.depth[::step, ::step].copy()
        same = self._depth is not None and np.array_equal(depth, self._depth)
        self._repeats = self._repeats + 1 if same else 0
        self._number, self._stamp, self._depth = frame.number, frame.stamp, depth
        self._brightness = float(frame.rgb[::step, ::step].mean())
        self._depth_share = float(np.count_nonzero(depth)) / depth.size

    @property
    def repeats(self) -> bool:
        """Whether the newest frame has the depth of the one before, to the bit: the camera may have frozen."""
        return self._repeats > 0

    def trouble(self, now: float) -> str | None:
        """Why the camera is not to be trusted at time `now` (s), with the numbers; None when all is well."""
        who, limits, age = f"the {self._camera} camera", self._parameters, now - self._stamp
        if age > limits.max_frame_age:
            return f"{who} gave no new frame for {age:.2f} s (at most {limits.max_frame_age:.2f})"
        if self._brightness < limits.min_brightness:
            return f"{who} is dark: mean {self._brightness:.1f} of 255 (at least {limits.min_brightness:.0f})"
        if self._depth_share < limits.min_depth_share:
            least = f"at least {100 * limits.min_depth_share:.0f}"
            return f"{who} measures depth on {100 * self._depth_share:.0f} % of its pixels ({least})"
        if self._repeats >= limits.max_repeats:
            return f"{who} is frozen: {self._repeats + 1} frames with the same depth to the bit"
        return None
