"""A renderer's light and its picture."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

Z_NEAR, Z_FAR = 0.02, 10.0  # m along the optical axis: nothing nearer or farther is drawn
BACKGROUND = (0.72, 0.74, 0.78)  # RGB: the lab's distant wall


RendererName = Literal["software", "moderngl"]


@dataclass(frozen=True, eq=False)
class LightState:
    """A directional light: `direction` (3,) from the scene to the light in the world, any length; strengths 0 to 1."""

    direction: ArrayLike
    ambient: float
    diffuse: float


@dataclass(frozen=True, eq=False)
class Image:
    """A picture without noise.

    `rgb` (H, W, 3) uint8; `depth` (H, W) float32, m along the optical axis, 0 where nothing is; `ids` (H, W) int32,
    the `VisualItem.id` that each pixel shows, -1 for none.
    """

    rgb: NDArray[np.uint8]
    depth: NDArray[np.float32]
    ids: NDArray[np.int32]
