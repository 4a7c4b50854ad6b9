"""Where the cable runs, from what is known of its two ends."""

from typing import TYPE_CHECKING

import numpy as np

from regrasp.interfaces.arrays import FloatArray

if TYPE_CHECKING:
    from scipy.spatial.transform import RigidTransform

    from regrasp.interfaces.cable.cell import CableKnown


def cable_course(known: "CableKnown", world_from_connector: "RigidTransform", spacing: float = 0.01) -> FloatArray:
    """Points (n, 3) m, world, about `spacing` m apart along the cable of a connector at rest, from the plugged end on.

    A cubic Hermite curve between the two ends with their directions: the shape of a rod under small deflections.
    """
    from scipy.interpolate import CubicHermiteSpline

    start, start_direction = known.cable.anchor
    end = world_from_connector.apply([-0.5 * known.cable.connector.length, 0.0, 0.0])
    direction = world_from_connector.rotation.apply([1.0, 0.0, 0.0])
    chord = float(np.linalg.norm(end - start))
    curve = CubicHermiteSpline([0.0, chord], np.stack([start, end]), np.stack([start_direction, direction]))
    return np.asarray(curve(np.linspace(0.0, chord, max(2, round(chord / spacing)))))


def connector_points(world_from_connector: "RigidTransform", length: float, count: int = 10) -> FloatArray:
    """Points (count, 3) m, world, along the axis of a connector of `length` m from end to end."""
    along = np.linspace(-0.5, 0.5, count)[:, None] * length
    return np.asarray(world_from_connector.apply(along * [1.0, 0.0, 0.0]))
