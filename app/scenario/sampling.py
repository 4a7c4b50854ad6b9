"""What a seed makes of a scenario's varying parts."""

import numpy as np

from regrasp.app.scenario.schema import ScenarioFile
from regrasp.interfaces.cell import Box
from regrasp.interfaces.fault import AnyFault
from regrasp.interfaces.scene import Obstacle

LEAST_STAND = 1e-3  # m: a piece that is lower stands on the floor
STAND = 0.02  # m: the edge of the post that holds a foam piece off the floor
STAND_COLOR = (0.35, 0.35, 0.38)


def draw_obstacles(file: ScenarioFile, rng: np.random.Generator) -> tuple[Obstacle, ...]:
    """The foam pieces where this seed puts them, each with a stand if it does not stand on the floor."""
    drawn = []
    for piece in file.obstacles:
        x, y, bottom = (np.asarray(piece.position_in(file.gravity)) + rng.uniform(-1.0, 1.0, 3) * piece.jitter).tolist()
        center = (x, y, bottom + piece.size[2] / 2)
        box = Box(name=piece.name, center=center, size=piece.size, color=piece.color)
        stand = None
        if bottom > LEAST_STAND:
            post = (STAND, STAND, bottom)
            stand = Box(name=f"{piece.name} stand", center=(x, y, bottom / 2), size=post, color=STAND_COLOR)
        drawn.append(Obstacle(box, float(np.deg2rad(piece.yaw_deg)), stand))
    return tuple(drawn)


def draw_faults(file: ScenarioFile, rng: np.random.Generator) -> tuple[AnyFault, ...]:
    """The faults at this seed's moments."""
    return tuple(fault.model_copy(update={"when": fault.when.drawn(rng)}) for fault in file.faults)
