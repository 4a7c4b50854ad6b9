"""Speed and separation: near things an arm moves slowly enough that an unexpected touch stays soft."""

from dataclasses import dataclass

import numpy as np

from regrasp.interfaces.arrays import FloatArray
from regrasp.motion.scene.collision import CollisionModel
from regrasp.motion.scene.distance_grid import DistanceGrid


@dataclass(frozen=True)
class SeparationParameters:
    """How fast a part of an arm may move, by how far it is from things (the idea of ISO/TS 15066).

    Foam of 1 kN/m at an arm of 1 to 2 kg presses with v sqrt(k m): 5 to 7 N at `slow`, where it is stopped at once.
    """

    slow: float = 0.15  # m/s at `touching` and nearer to a seen surface; choice
    slow_at_boxes: float = 0.10  # m/s at `touching` and nearer to a known box, which is rigid; choice
    touching: float = 0.015  # m; by so much a map of 10 mm voxels may err
    fast: float = 1.0  # m/s just within `separation`: about an arm's full speed; choice
    separation: float = 0.05  # m from which on the speed is free; choice

    def speeds(self, clearances: FloatArray, slow: float) -> FloatArray:
        """The speeds (...) m/s allowed at these clearances (...) m: from `slow`, linear between the two distances."""
        ramp = np.interp(clearances, [self.touching, self.separation], [slow, self.fast])
        return np.asarray(np.where(clearances < self.separation, ramp, np.inf))


@dataclass(frozen=True, eq=False)
class SpeedBySeparation:
    """Implements `regrasp.motion.execution.Separation` for the arm and boxes of a model and the surfaces of a grid.

    A sphere meets a surface no faster than its centre moves, so each is held to what its own clearance allows.
    """

    model: CollisionModel
    surfaces: DistanceGrid
    parameters: SeparationParameters

    def __call__(self, path: FloatArray, slopes: FloatArray) -> FloatArray:
        """See `PathSpeed`."""
        to_surfaces, to_boxes, ways = self.model.along(path, slopes, self.surfaces)
        values = self.parameters
        speeds = np.minimum(values.speeds(to_surfaces, values.slow), values.speeds(to_boxes, values.slow_at_boxes))
        with np.errstate(divide="ignore"):  # what does not move is free to
            return np.asarray((speeds / ways).min(axis=1))

    def near(self, q: FloatArray) -> bool:
        """Whether at joints (n,) something that moves is within the separation of a surface, a box or another arm."""
        if not self.model.free(q, self.parameters.separation):
            return True
        to_surfaces, _, ways = self.model.along(q[None], np.ones((1, len(q))), self.surfaces)
        return bool((to_surfaces[ways > 0.0] < self.parameters.separation).any())
