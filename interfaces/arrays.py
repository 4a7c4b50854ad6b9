"""Names of the array types that many modules use."""

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
Mask = NDArray[np.bool_]  # (H, W), or (n,) for n points
ColorImage = NDArray[np.uint8]  # (H, W, 3) RGB
DepthImage = NDArray[np.float32]  # (H, W) metres along the optical axis; 0: no reading
