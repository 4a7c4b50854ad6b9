"""What the robot sees of the connector: a look's estimate, what is known of it over time, how it lies in the hand."""

from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING

import numpy as np

from regrasp.interfaces.arrays import FloatArray

if TYPE_CHECKING:
    from scipy.spatial.transform import RigidTransform


class NotSeen(StrEnum):
    """Why an image gave no connector."""

    NO_COLOR = "no_color"  # no pixel of its colour
    TOO_SMALL = "too_small"  # too few pixels of it are in sight
    NO_CAMERA = "no_camera"  # the camera is not to be trusted
    NO_DEPTH = "no_depth"  # its pixels have too few depth readings
    NOT_ITS_SHAPE = "not_its_shape"  # its colour, but not a cylinder of its size
    NO_TAG = "no_tag"  # its tag is not in sight
    WRONG_SIZE = "wrong_size"  # its tag's size in the image and the depth there disagree
    LOW_SCORE = "low_score"  # the network is not sure enough of any box


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
        world_from_camera: where the camera was taken to be; None of an estimate from several frames.
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
    world_from_camera: "RigidTransform | None" = None


@dataclass(frozen=True)
class NoEstimate:
    """No pose from this frame: the named reason, and a sentence with the numbers.

    `weak_detection` (3,) m, world: where something may be the connector, of which too little shows to tell.
    """

    stamp: float
    camera: str
    reason: NotSeen
    message: str
    weak_detection: FloatArray | None = None


@dataclass(frozen=True)
class Sightings:
    """What a camera saw of the connector in some seconds, one result a frame; places (3,) m where it may be."""

    estimates: list[Estimate]
    weak_detections: list[FloatArray]

    @property
    def glimpse(self) -> FloatArray:
        """The median (3,) m of the weak detections, of which there must be some; world frame."""
        return np.asarray(np.median(self.weak_detections, axis=0))


class TrackState(StrEnum):
    """What the track says of the connector."""

    VISIBLE = "visible"
    HIDDEN_BY_HAND = "hidden_by_hand"
    LOST = "lost"
    UNKNOWN = "unknown"  # never seen


@dataclass(frozen=True)
class TrackHealth:
    """The thesis's three checks: a pose exists, it is fresh, and it is live (it changes from frame to frame)."""

    exists: bool
    fresh: bool
    live: bool
    reason: str

    @property
    def ok(self) -> bool:
        """Whether all three hold, so that no search is needed."""
        return self.exists and self.fresh and self.live


@dataclass(frozen=True)
class InHand:
    """How the connector lies in the hand as seen there: `pose` is tool_from_connector.

    `whole`: its whole length was seen. `shift` (m) and `turn_deg` are measured from how it was believed to lie;
    `trusted`: not too far off that to be the connector.
    """

    pose: "RigidTransform"
    whole: bool
    shift: float
    turn_deg: float
    trusted: bool
