"""A held connector as spheres, for the check of the hand's collisions."""

import numpy as np
from scipy.spatial.transform import RigidTransform

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cable.cell import Connector


def connector_spheres(held: RigidTransform, connector: Connector, padding: float) -> FloatArray:
    """Spheres (3, 4) m that cover a carried connector, in the tool frame; their radius is `padding` times its own."""
    along = (0.5 * connector.length - connector.radius) * np.array([-1.0, 0.0, 1.0])
    centers = held.apply(np.column_stack([along, np.zeros(3), np.zeros(3)]))
    return np.column_stack([centers, np.full(3, padding * connector.radius)])
