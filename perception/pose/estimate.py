"""What a look at the connector gives: a pose with its covariance, or the reason why there is none."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from regrasp.interfaces.arrays import FloatArray

if TYPE_CHECKING:
    from scipy.spatial.transform import RigidTransform

    from regrasp.perception.pose.segmentation import NotSeen

# World frame. Decides the sign of the axis where nothing else does: plugs of the cell point to +y.
DEFAULT_AXIS = np.array([0.0, 1.0, 0.0])
# rad^2, of an angle that is uniform over a full turn: a cylinder's roll about its axis.
ROLL_VARIANCE = np.pi**2 / 3


@dataclass(frozen=True, eq=False)
class Estimate:
    """Where the connector is, by one frame. World frame, metres.

    Attributes:
        stamp: time of the frame's exposure, s.
        camera: its name.
        position: centre (3,) of the connector, or of its visible part unless `whole`.
        axis: unit vector (3,) from cable to tip; its sign is by the cable if that is seen, else by the caller's hint.
        world_from_connector: the pose; x is the axis.
        covariance: (6, 6) of the position (m^2), then of a small rotation about the world's axes (rad^2).
        points: number of depth readings used.
        mask_area: pixels seen as the connector.
        extent: length of the visible part along the axis.
        whole: both ends are in sight, or one is and the known length gave the other.
        sign_seen: the frame itself told the cable's end from the tip.
    """

    stamp: float
    camera: str
    position: FloatArray
    axis: FloatArray
    world_from_connector: "RigidTransform"
    covariance: FloatArray
    points: int
    mask_area: int
    extent: float
    whole: bool
    sign_seen: bool = False


@dataclass(frozen=True)
class NoEstimate:
    """No pose from this frame: the named reason, and a sentence with the numbers.

    `weak_detection` (3,) m, world: where something may be the connector, of which too little shows to tell.
    """

    stamp: float
    camera: str
    reason: "NotSeen"
    message: str
    weak_detection: FloatArray | None = None


def pose_covariance(axis: FloatArray, position: float, angle: float) -> FloatArray:
    """Covariance (6, 6) of a pose whose position has the deviation `position` (m) on each axis.

    Its unit `axis` (3,) has the deviation `angle` (rad) about each direction across it; its roll is unknown.
    """
    out = np.zeros((6, 6))
    out[:3, :3] = position**2 * np.eye(3)
    out[3:, 3:] = angle**2 * np.eye(3) + (ROLL_VARIANCE - angle**2) * np.outer(axis, axis)
    return out
