"""What a renderer is given and gives back."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

NEAR, FAR = 0.02, 10.0  # metres along the optical axis; nothing outside is drawn
BACKGROUND = (0.72, 0.74, 0.78)  # RGB, 0 to 1: the wall of the lab, far away


@dataclass(frozen=True, eq=False)
class LightState:
    """A far light: `direction` (3,) from the scene to the light in the world frame, any length; strengths 0 to 1."""

    direction: ArrayLike
    ambient: float
    diffuse: float


@dataclass(frozen=True, eq=False)
class Image:
    """An exact picture.

    `rgb` (H, W, 3) uint8; `depth` (H, W) float32 metres along the optical axis, 0 where nothing was hit; `ids` (H, W)
    int32 of the item seen (`VisualItem.id`), -1 for none.
    """

    rgb: NDArray[np.uint8]
    depth: NDArray[np.float32]
    ids: NDArray[np.int32]
