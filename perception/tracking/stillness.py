"""Does anything still move before a camera at rest? A cable's swing shows even where its end is hidden."""

from collections import deque
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from regrasp.interfaces.arrays import ColorImage
from regrasp.interfaces.frame import RgbdFrame


@dataclass(frozen=True)
class StillnessParameters:
    """What counts as motion.

    Choice of the threshold: 0.08 is about 10 grey levels. Noise of 2 levels a pixel is 0.5 a block, whose range over 15
    frames and 25,000 blocks is 4; the edge of a black cable before wood changes a block by 12 when it moves by a third
    of a pixel.
    """

    window: float = 1.0  # s that must pass without motion
    threshold: float = 0.08  # range of a block's brightness, as a share of the image's mean
    block: int = 4  # px; narrower than the cable's image, so that its motion does not cancel within a block
    min_blocks: int = 3  # choice: a stray bright pixel changes one block, a moving cable a row of them


class Stillness:
    """Watches the range of the gray image's blocks over a sliding window of frames.

    It takes the range over a window, not the difference of two frames, so that it sees a swing that turns round between
    two frames, and a slow creep. Each image is divided by its mean, so that a change of the light is no motion.
    """

    def __init__(self, parameters: StillnessParameters = StillnessParameters()) -> None:
        self._parameters = parameters
        self._images: deque[tuple[float, NDArray[np.float32]]] = deque()

    def reset(self) -> None:
        """Forget the frames, as when an arm moved on purpose."""
        self._images.clear()

    def feed(self, frame: RgbdFrame) -> bool | None:
        """Whether nothing moved during the last window; None until the frames span one. An old frame is ignored."""
        if not self._images or frame.stamp > self._images[-1][0]:
            self._images.append((frame.stamp, _block_means(frame.rgb, self._parameters.block)))
        newest, window = self._images[-1][0], self._parameters.window
        while len(self._images) > 1 and self._images[1][0] <= newest - window + 1e-9:
            self._images.popleft()
        if newest - self._images[0][0] < window - 1e-9:
            return None
        stack = np.stack([image for _, image in self._images])
        moving = int(np.count_nonzero(np.ptp(stack, axis=0) > self._parameters.threshold))
        return moving < self._parameters.min_blocks


def _block_means(rgb: ColorImage, block: int) -> NDArray[np.float32]:
    """Block means of the gray image, over their own mean; (H / block, W / block)."""
    import cv2  # late: leaves import this module, and not all that do need pictures

    gray = cv2.cvtColor(rgb, cv2.COLOR_RGB2GRAY).astype(np.float32)
    means = cv2.resize(gray, (rgb.shape[1] // block, rgb.shape[0] // block), interpolation=cv2.INTER_AREA)
    return np.asarray(means / max(float(means.mean()), 1.0), np.float32)
