"""Draws what a seed decides in a scenario: where obstacles stand and when faults begin."""

from dataclasses import dataclass

import numpy as np

from regrasp.app.scenario.schema import ScenarioFile
from regrasp.interfaces.cell import Box
from regrasp.interfaces.fault import Fault
from regrasp.interfaces.fields import Color
from regrasp.interfaces.scene import Obstacle, SceneSetup


@dataclass(frozen=True)
class StandParameters:
    """The post that holds a foam piece off the floor."""

    min_height: float = 1e-3  # m; a piece lower than this stands on the floor
    edge: float = 0.02  # m, of the square section; choice: thin, so that it hides little
    color: Color = (0.35, 0.35, 0.38)  # grey


def draw_obstacles(
    file: ScenarioFile, rng: np.random.Generator, stands: StandParameters = StandParameters()
) -> tuple[Obstacle, ...]:
    """The foam pieces where this seed puts them, each with a stand if it does not stand on the floor.

    Three uniform numbers are drawn for each piece, in the file's order: its jitter along x, y and z.
    """
    drawn = []
    for piece in file.obstacles:
        x, y, bottom = (np.asarray(piece.position_in(file.gravity)) + rng.uniform(-1.0, 1.0, 3) * piece.jitter).tolist()
        center = (x, y, bottom + piece.size[2] / 2)
        box = Box(name=piece.name, center=center, size=piece.size, color=piece.color)
        stand = None
        if bottom > stands.min_height:
            post = (stands.edge, stands.edge, bottom)
            stand = Box(name=f"{piece.name} stand", center=(x, y, bottom / 2), size=post, color=stands.color)
        drawn.append(Obstacle(box, float(np.deg2rad(piece.yaw_deg)), stand))
    return tuple(drawn)


def scene_setup(file: ScenarioFile, seed: int) -> SceneSetup:
    """What this seed adds to the cell: the obstacles where it puts them, and the faults with their beginnings."""
    rng = np.random.default_rng([seed, 0])
    obstacles = draw_obstacles(file, rng)
    return SceneSetup(obstacles, draw_faults(file, rng))


def draw_faults(file: ScenarioFile, rng: np.random.Generator) -> tuple[Fault, ...]:
    """The faults with their beginnings drawn, in the file's order."""
    return tuple(fault.model_copy(update={"when": fault.when.drawn(rng)}) for fault in file.faults)
