"""Can a camera be trusted? Told from its frames alone: their stamps, their light, their depth, and that they change."""

import numpy as np
from numpy.typing import NDArray

from regrasp.interfaces.frame import RgbdFrame

STALE = 0.5  # s without a new frame: seven in a row lost at 15 Hz
DARK = 10.0  # mean of 255; the cell in full shadow has over 30
LEAST_DEPTH = 0.05  # share of the pixels with a reading; a view of the cell has over a half
REPEATS = 2  # frames in a row with the depth of the one before: measured depth never repeats to the bit
STEP = 4  # pixels between those that are looked at


class CameraHealth:
    """Takes in the frames of one camera, in order, and says what is wrong with it."""

    def __init__(self, camera: str) -> None:
        self._camera = camera
        self._number = 0
        self._stamp = 0.0  # a camera that never gives a frame is late from the beginning
        self._depth: NDArray[np.float32] | None = None
        self._repeats = 0
        self._brightness = 255.0
        self._measured = 1.0

    def feed(self, frame: RgbdFrame) -> None:
        """Take in the newest frame; one that was fed before is ignored."""
        if frame.number == self._number:
            return
        depth = frame.depth[::STEP, ::STEP].copy()
        same = self._depth is not None and np.array_equal(depth, self._depth)
        self._repeats = self._repeats + 1 if same else 0
        self._number, self._stamp, self._depth = frame.number, frame.stamp, depth
        self._brightness = float(frame.rgb[::STEP, ::STEP].mean())
        self._measured = float(np.count_nonzero(depth)) / depth.size

    def trouble(self, now: float) -> str | None:
        """Why it is not to be trusted at second `now`, with the numbers; None when all is well."""
        who = f"the {self._camera} camera"
        if now - self._stamp > STALE:
            return f"{who} gave no new frame for {now - self._stamp:.2f} s, limit {STALE:.2f}"
        if self._brightness < DARK:
            return f"{who} is dark: mean {self._brightness:.1f} of 255, limit {DARK:.0f}"
        if self._measured < LEAST_DEPTH:
            return f"{who} measures depth on {100 * self._measured:.0f} % of its pixels, limit {100 * LEAST_DEPTH:.0f}"
        if self._repeats >= REPEATS:
            return f"{who} is frozen: {self._repeats + 1} frames with the same depth to the bit"
        return None
