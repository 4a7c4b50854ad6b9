"""Camera images as they cross rooms."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Intrinsics:
    """A pinhole camera without distortion. Lengths in pixels; pixel (0, 0) is the centre of the top left pixel."""

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float

    @classmethod
    def from_fov(cls, width: int, height: int, horizontal_fov: float) -> "Intrinsics":
        """Square pixels, principal point in the middle; `horizontal_fov` in radians."""
        f = 0.5 * width / float(np.tan(0.5 * horizontal_fov))
        return cls(width, height, f, f, (width - 1) / 2, (height - 1) / 2)


@dataclass(frozen=True, eq=False)
class RgbdFrame:
    """One exposure of an RGB-D camera, depth aligned to colour.

    `rgb` is (H, W, 3) uint8; `depth` is (H, W) float32 metres along the optical axis, 0 where there is no reading;
    `stamp` is the simulated second of the exposure; `number` counts exposures of this camera since the start.
    `joints` are the encoder readings (6,) rad, at the exposure, of the arm that carries the camera; None for a fixed
    one. Raises ValueError for images of another shape or type.
    """

    camera: str
    number: int
    stamp: float
    rgb: NDArray[np.uint8]
    depth: NDArray[np.float32]
    intrinsics: Intrinsics
    joints: NDArray[np.float64] | None = None

    def __post_init__(self) -> None:
        shape = (self.intrinsics.height, self.intrinsics.width)
        _expect("rgb", self.rgb, (*shape, 3), np.uint8)
        _expect("depth", self.depth, shape, np.float32)


def _expect(name: str, image: NDArray[np.generic], shape: tuple[int, ...], dtype: type[np.generic]) -> None:
    if image.shape != shape or image.dtype != dtype:
        wanted = f"{shape} {np.dtype(dtype)}"
        raise ValueError(f"{name} is {image.shape} {image.dtype}, the intrinsics and the format ask for {wanted}")
