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
    slow_at_rigid: float = 0.10  # m/s at `touching` and nearer to a known box or another arm; choice
    # m/s where one is nearer than `rigid_error`. With 0.10, a panel was met with 100 N; choice
    slowest_at_rigid: float = 0.03
    rigid_error: float = 0.005  # m; by so much an arm errs
    touching: float = 0.015  # m; by so much a map of 10 mm voxels may err
    fast: float = 1.0  # m/s just within `separation`: about an arm's full speed; choice
    separation: float = 0.05  # m from which on the speed is free; choice

    def at_surfaces(self, clearances: FloatArray) -> FloatArray:
        """The speeds (...) m/s allowed at these clearances (...) m from seen surfaces, linear between the distances."""
        return self._ramp(clearances, [self.touching, self.separation], [self.slow, self.fast])

    def at_rigid(self, clearances: FloatArray) -> FloatArray:
        """The speeds (...) m/s allowed at these clearances (...) m from what is rigid, linear between the distances."""
        distances = [self.rigid_error, self.touching, self.separation]
        return self._ramp(clearances, distances, [self.slowest_at_rigid, self.slow_at_rigid, self.fast])

    def _ramp(self, clearances: FloatArray, distances: list[float], speeds: list[float]) -> FloatArray:
        return np.asarray(np.where(clearances < self.separation, np.interp(clearances, distances, speeds), np.inf))


@dataclass(frozen=True, eq=False)
class SpeedBySeparation:
    """Implements `regrasp.motion.execution.Separation` for the arm of a model and all that it could touch.

    That is the surfaces of a grid, and the model's boxes and other arms, which are rigid.

    A sphere meets a surface no faster than its centre moves, so each is held to what its own clearance allows.
    """

    model: CollisionModel
    surfaces: DistanceGrid
    parameters: SeparationParameters

    def __call__(self, path: FloatArray, slopes: FloatArray) -> FloatArray:
        """See `PathSpeed`."""
        to_surfaces, to_rigid, ways = self.model.along(path, slopes, self.surfaces)
        values = self.parameters
        speeds = np.minimum(values.at_surfaces(to_surfaces), values.at_rigid(to_rigid))
        with np.errstate(divide="ignore"):  # what does not move is free to
            return np.asarray((speeds / ways).min(axis=1))

    def near(self, q: FloatArray) -> bool:
        """Whether at joints (n,) something that moves is within the separation of a surface, a box or another arm."""
        if not self.model.free(q, self.parameters.separation):
            return True
        to_surfaces, _, ways = self.model.along(q[None], np.ones((1, len(q))), self.surfaces)
        return bool((to_surfaces[ways > 0.0] < self.parameters.separation).any())
