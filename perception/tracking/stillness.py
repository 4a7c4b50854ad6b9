"""Does anything still move before a camera at rest? A cable's swing shows even where its end hides."""

from collections import deque

import cv2
import numpy as np
from numpy.typing import NDArray

from regrasp.interfaces.frame import RgbdFrame

BLOCK = 4  # pixels; narrower than the cable's image, so that its motion does not cancel within a block
MIN_BLOCKS = 3  # choice: a stray bright pixel lights up one block, a moving cable a row of them


class Stillness:
    """Watches how much blocks of the gray image range over a sliding window of frames.

    The range over a window, not the difference of two frames: a swing that turns round between them still shows, and
    so does a slow creep. Each image is divided by its mean, so that a change of the light is no motion.
    """

    def __init__(self, window_s: float = 1.0, threshold: float = 0.08) -> None:
        """Seconds that must pass without motion, and how far a block's brightness may range, in the image's mean.

        Choice of 0.08: about 10 grey levels. Noise of 2 levels a pixel is 0.5 a block and ranges over 15 frames and
        25,000 blocks by 4; the edge of a black cable before wood that moves by a third of a pixel changes one by 12.
        """
        self.window_s, self.threshold = window_s, threshold
        self.moving_blocks = 0
        self._images: deque[tuple[float, NDArray[np.float32]]] = deque()

    def reset(self) -> None:
        """Forget the frames, as when an arm moved on purpose."""
        self._images.clear()

    def feed(self, frame: RgbdFrame) -> bool | None:
        """Whether nothing moved during the last window; None until the frames span one. An old frame is ignored."""
        if not self._images or frame.stamp > self._images[-1][0]:
            self._images.append((frame.stamp, _small(frame.rgb)))
        newest = self._images[-1][0]
        while len(self._images) > 1 and self._images[1][0] <= newest - self.window_s + 1e-9:
            self._images.popleft()
        if newest - self._images[0][0] < self.window_s - 1e-9:
            return None
        stack = np.stack([image for _, image in self._images])
        self.moving_blocks = int(np.count_nonzero(np.ptp(stack, axis=0) > self.threshold))
        return self.moving_blocks < MIN_BLOCKS


def _small(rgb: NDArray[np.uint8]) -> NDArray[np.float32]:
    """Block means of the gray image, over their own mean; (H / BLOCK, W / BLOCK)."""
    gray = cv2.cvtColor(rgb, cv2.COLOR_RGB2GRAY).astype(np.float32)
    size = (rgb.shape[1] // BLOCK, rgb.shape[0] // BLOCK)
    small = cv2.resize(gray, size, interpolation=cv2.INTER_AREA)
    return np.asarray(small / max(float(small.mean()), 1.0), np.float32)
