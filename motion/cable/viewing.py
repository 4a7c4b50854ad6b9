"""Where the camera on an arm can look from: the search's viewpoints, and those of a closer look."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import product

import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation

from regrasp.interfaces.arrays import FloatArray
from regrasp.motion.cable.viewpoints import CloseViewParameters, SpiralParameters


def _spiral_of_the_left_arm() -> SpiralParameters:
    # At 0.30 m from the plane through the start the left arm reaches only 6 of the first 9 viewpoints; here all 9.
    return SpiralParameters(distance=0.25)


@dataclass(frozen=True)
class ViewingParameters:
    """Where the camera looks from, and how its arm moves there."""

    margin: float = 0.02  # m of clearance: the arm moves among things that were seen from one side only
    max_cosine: float = 0.77  # of the angle between lines of sight from different sides: at least 40 degrees
    # m along the line of sight, positive is nearer: tried in turn where a viewpoint is out of reach or not free; choice
    approaches: tuple[float, ...] = (0.0, 0.05, -0.05, 0.10, -0.10, 0.15)
    # m by which the loose end of the cable hangs below its straight course on Earth; with 0.7 to 1.4 times the cell's
    # stiffness 0.14 to 0.07
    sag: float = 0.10
    rest_looks: int = 2  # from different sides, at where the cable hangs by itself, before a search; choice
    start_at: str = "back_panel"  # the box at whose middle a search begins that knows no better place
    spiral: SpiralParameters = field(default_factory=_spiral_of_the_left_arm)
    close_views: CloseViewParameters = field(default_factory=CloseViewParameters)


def approached(views: Sequence[RigidTransform], approaches: Sequence[float]) -> Iterator[RigidTransform]:
    """The views (world_from_camera), each moved by every one of the `approaches` (m) along its line of sight."""
    for view, approach in product(views, approaches):
        yield view * RigidTransform.from_translation([0.0, 0.0, approach])


def views_of(place: FloatArray, world_from_camera: RigidTransform, distance: float) -> list[RigidTransform]:
    """Views of a `place` (3,) m that was seen from a camera: from `distance` m before it, then from there, turned.

    The first looks in the same direction as before.
    """
    sight = world_from_camera.rotation.apply([0.0, 0.0, 1.0])
    before = RigidTransform.from_components(place - distance * sight, world_from_camera.rotation)
    turn, _ = Rotation.align_vectors(place - world_from_camera.translation, sight)
    turned = RigidTransform.from_components(world_from_camera.translation, turn * world_from_camera.rotation)
    return [before, turned]


def outline(connector: RigidTransform, length: float) -> FloatArray:
    """Points (3, 3) m on the axis of a connector of `length` m (world_from_connector): cable end, centre and tip."""
    half = 0.5 * length
    return np.asarray(connector.apply([[-half, 0.0, 0.0], [0.0, 0.0, 0.0], [half, 0.0, 0.0]]))
