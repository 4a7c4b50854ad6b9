"""What a look at the connector gives: a pose with its covariance, or the reason why there is none."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform

from regrasp.perception.pose.segmentation import NotSeen

FloatArray = NDArray[np.float64]

LEFT = np.array([0.0, 1.0, 0.0])  # the sign of the axis where nothing tells it: plugs of the cell point to +y
ROLL_VARIANCE = np.pi**2 / 3  # rad^2 of an angle of which nothing is known: a cylinder's about its axis


@dataclass(frozen=True, eq=False)
class Estimate:
    """Where the connector is, by one frame. World frame, metres.

    `position` (3,): its centre, or that of its visible part unless `whole`; `axis` (3,): unit vector from cable to tip,
    sign by the cable if it is seen, else by what the caller knew; `covariance` (6, 6): of position (m^2), then of a
    small turn about the world's axes (rad^2); `points`: depth readings used; `mask_area`: pixels seen as the connector;
    `extent`: length of the visible part along the axis; `whole`: both ends are in sight, or one is and the known
    length gave the other; `sign_seen`: the frame itself told the cable's end from the tip.
    """

    stamp: float
    camera: str
    position: FloatArray
    axis: FloatArray
    world_from_connector: RigidTransform
    covariance: FloatArray
    points: int
    mask_area: int
    extent: float
    whole: bool
    sign_seen: bool = False


@dataclass(frozen=True)
class NoEstimate:
    """No pose from this frame: the named reason, and a sentence with the numbers.

    `glimpse` (3,) m, world: where something shows that may be the connector, but too little of it to tell.
    """

    stamp: float
    camera: str
    reason: NotSeen
    message: str
    glimpse: FloatArray | None = None


def pose_covariance(axis: FloatArray, position: float, angle: float) -> FloatArray:
    """Covariance (6, 6) of a pose known to `position` m in each direction and its unit `axis` (3,) to `angle` rad.

    Nothing is known of the turn about the axis.
    """
    out = np.zeros((6, 6))
    out[:3, :3] = position**2 * np.eye(3)
    out[3:, 3:] = angle**2 * np.eye(3) + (ROLL_VARIANCE - angle**2) * np.outer(axis, axis)
    return out
