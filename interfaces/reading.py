"""Joint and finger readings as they cross rooms."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class JointReading:
    """What an arm's encoders and motor drivers say: positions (6,) rad, velocities (6,) rad/s, efforts (6,) N m."""

    stamp: float
    positions: NDArray[np.float64]
    velocities: NDArray[np.float64]
    efforts: NDArray[np.float64]


@dataclass(frozen=True)
class GripperReading:
    """What the finger encoder says: `gap` is the distance between the pads in metres."""

    stamp: float
    gap: float
