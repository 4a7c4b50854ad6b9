"""The ways to find the connector in a frame: one interface, chosen by name."""

from collections.abc import Callable
from typing import Literal, Protocol, get_args

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform

from regrasp.interfaces.cell import KnownCell
from regrasp.interfaces.frame import RgbdFrame
from regrasp.perception.pose.detector import Detector
from regrasp.perception.pose.estimate import Estimate, NoEstimate
from regrasp.perception.pose.fiducial import Fiducial
from regrasp.perception.pose.fused.fused import Fused
from regrasp.perception.pose.rgbd import Rgbd

TechniqueName = Literal["rgbd", "fiducial", "detector", "fused"]
TECHNIQUES: tuple[TechniqueName, ...] = get_args(TechniqueName)


class Technique(Protocol):
    """Finds the connector in one frame. What it may know of the cell beforehand it is given when it is made."""

    def estimate(
        self,
        frame: RgbdFrame,
        world_from_camera: RigidTransform,
        *,
        axis: NDArray[np.float64] | None = None,
        near: NDArray[np.float64] | None = None,
    ) -> Estimate | NoEstimate:
        """The connector's pose with its covariance, or a named reason.

        `axis` (3,), from cable to tip in the world, settles which end is which where the frame does not tell; without
        it world +y. `near` (3,) m says where the connector was last, for a scene with two alike.
        """
        ...


def make_technique(name: TechniqueName, known: KnownCell) -> Technique:
    """The technique of that name. Raises ValueError for a cell that has not what it needs."""
    makers: dict[TechniqueName, Callable[[KnownCell], Technique]] = {
        "rgbd": Rgbd,
        "fiducial": Fiducial,
        "detector": Detector,
        "fused": Fused,
    }
    return makers[name](known)
