"""Images of an RGB-D camera, and its intrinsics."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from regrasp.interfaces.arrays import FloatArray


@dataclass(frozen=True)
class Intrinsics:
    r"""A pinhole camera without lens distortion. Lengths are in pixels; (0, 0) is the centre of the top left pixel.

    A point (x, y, z) of the optical frame (x right, y down, z forward) is projected to

    .. math:: u = f_x x / z + c_x, \quad v = f_y y / z + c_y

    Raises ValueError unless width, height, fx and fy are positive.
    """

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float

    def __post_init__(self) -> None:
        if not (self.width >= 1 and self.height >= 1 and self.fx > 0 and self.fy > 0):
            raise ValueError(f"{self}: width, height, fx and fy must be positive")

    @classmethod
    def from_fov(cls, width: int, height: int, horizontal_fov: float) -> "Intrinsics":
        """Intrinsics with square pixels and the principal point in the middle; `horizontal_fov` in radians.

        Raises ValueError unless it lies between 0 and pi.
        """
        if not 0.0 < horizontal_fov < np.pi:
            raise ValueError(f"horizontal_fov is {horizontal_fov!r} rad; expected more than 0 and less than pi")
        f = 0.5 * width / float(np.tan(0.5 * horizontal_fov))
        return cls(width, height, f, f, (width - 1) / 2, (height - 1) / 2)

    def shrunk(self, factor: int) -> "Intrinsics":
        """The same view in a picture `factor` times smaller; what is left of the last row or column is cut off."""
        width, height = max(1, self.width // factor), max(1, self.height // factor)
        centre = (self.cx + 0.5) / factor - 0.5, (self.cy + 0.5) / factor - 0.5
        return Intrinsics(width, height, self.fx / factor, self.fy / factor, *centre)


@dataclass(frozen=True, eq=False)
class RgbdFrame:
    """One exposure of an RGB-D camera, with depth aligned to colour.

    Attributes:
        camera: The camera's name.
        number: Counts the exposures of this camera since the start.
        stamp: Simulated second of the exposure.
        rgb: (H, W, 3) uint8.
        depth: (H, W) float32, metres along the optical axis, 0 where there is no reading.
        intrinsics: Of both images.
        joints: Encoder readings (n,) rad at the exposure, of the arm that carries the camera; None for a fixed camera.

    Raises:
        ValueError: an image has another shape or type than the above.
    """

    camera: str
    number: int
    stamp: float
    rgb: NDArray[np.uint8]
    depth: NDArray[np.float32]
    intrinsics: Intrinsics
    joints: FloatArray | None = None

    def __post_init__(self) -> None:
        shape = (self.intrinsics.height, self.intrinsics.width)
        _expect("rgb", self.rgb, (*shape, 3), np.uint8)
        _expect("depth", self.depth, shape, np.float32)


def _expect(name: str, image: NDArray[np.generic], shape: tuple[int, ...], dtype: type[np.generic]) -> None:
    if not isinstance(image, np.ndarray):
        raise ValueError(f"{name} is a {type(image).__name__}; expected a numpy array {shape} {np.dtype(dtype)}")
    if image.shape != shape or image.dtype != dtype:
        wanted = f"{shape} {np.dtype(dtype)}"
        raise ValueError(f"{name} is {image.shape} {image.dtype}, the intrinsics and the format ask for {wanted}")
