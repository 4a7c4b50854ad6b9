"""The techniques that find the connector in a frame: one interface, chosen by name."""

from typing import TYPE_CHECKING, Literal, Protocol, get_args

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.frame import RgbdFrame
from regrasp.perception.pose.estimate import Estimate, NoEstimate

if TYPE_CHECKING:
    from scipy.spatial.transform import RigidTransform

    from regrasp.interfaces.cable.cell import CableKnown

TechniqueName = Literal["rgbd", "fiducial", "detector", "fused"]
TECHNIQUES: tuple[TechniqueName, ...] = get_args(TechniqueName)


class Technique(Protocol):
    """Finds the connector in one frame. Its constructor takes what it may know of the cell beforehand."""

    def estimate(
        self,
        frame: RgbdFrame,
        world_from_camera: "RigidTransform",
        *,
        axis: FloatArray | None = None,
        near: FloatArray | None = None,
    ) -> Estimate | NoEstimate:
        """The connector's pose in the world with its covariance, or a named reason why there is none.

        `axis` (3,), world, is a hint to the direction from cable to tip; it decides which end is which where the frame
        does not tell. Without it world +y does. `near` (3,) m, world, is where the connector was last, for scenes with
        two that look alike.
        """
        ...


def make_technique(name: str, known: "CableKnown") -> Technique:
    """The technique of that name. Raises ValueError if the cell lacks what it needs."""
    match name:  # each imports what it needs: the compiler, or OpenCV alone
        case "rgbd":
            from regrasp.perception.pose.rgbd import Rgbd

            return Rgbd(known)
        case "fiducial":
            from regrasp.perception.pose.fiducial import Fiducial

            return Fiducial(known)
        case "detector":
            from regrasp.perception.pose.detector import Detector

            return Detector(known)
        case "fused":
            from regrasp.perception.pose.fused.fused import Fused

            return Fused(known)
    raise ValueError(f"no technique {name!r}; there are {', '.join(TECHNIQUES)}")
