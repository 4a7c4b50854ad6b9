"""What a motion service answers the cable's leaves: where a camera can look from, and what the hand holds."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from regrasp.interfaces.arrays import FloatArray

if TYPE_CHECKING:
    from scipy.spatial.transform import RigidTransform


@dataclass(frozen=True, eq=False)
class Viewpoint:
    """One place to look from: `index` counts viewpoints, `main` main points; `sub` is 0 for the flat view, then 1-8."""

    index: int
    main: int
    sub: int
    world_from_camera: "RigidTransform"


@dataclass(frozen=True, eq=False)
class View:
    """A place to look from that can be reached: free joints (k, n) of the arm that carries the camera."""

    world_from_camera: "RigidTransform"
    joints: FloatArray

    @property
    def sight(self) -> FloatArray:
        """The line of sight, a unit vector (3,) in the world."""
        return np.asarray(self.world_from_camera.rotation.apply([0.0, 0.0, 1.0]))


@dataclass(frozen=True, eq=False)
class Grip:
    """What the closed jaw holds: the `gap` (m) between its pads, and the connector's pose, tool_from_connector."""

    gap: float
    pose: "RigidTransform"


@dataclass(frozen=True, eq=False)
class PluggedIn:
    """How a plug went in: at which of the `tries`, how far `across` (2,) m from where the socket was believed to be.

    `strongest` is the greatest force in N that the hand felt on the way.
    """

    tries: int
    across: FloatArray
    strongest: float
