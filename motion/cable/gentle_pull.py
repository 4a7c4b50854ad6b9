"""A gentle pull at what the hand has inserted, by which it feels whether that is held there."""

from collections.abc import Callable, Generator
from dataclasses import dataclass

import numpy as np

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.evidence import Evidence


@dataclass(frozen=True)
class GentlePullParameters:
    """How far is pulled, and what counts as held."""

    # m back from the seat, at each of which is felt: the clip's lips pull with 1.5 N/mm over 10 mm
    ways: tuple[float, ...] = (0.0015, 0.003, 0.0045)
    speed: float = 0.4  # share of the joints' speed in the small steps; choice
    # N/m that the force rises at least where something holds. Measured, 20 seeds on Earth, 20 without gravity: in the
    # clip 1490 to 1650; at the seat with open lips up to 90, 35 mm short of it up to 50, 35 mm beside it up to 260
    stiffness: float = 600.0


def pull_gently(
    go_back: Callable[[float], Generator[None, None, FloatArray]],
    force: Callable[[FloatArray], float],
    parameters: GentlePullParameters = GentlePullParameters(),
) -> Generator[None, None, Evidence]:
    """Steps that pull; whether the force rises with the way as something that holds makes it.

    `go_back` are steps that bring the hand so many m back from where it stands, and return the efforts (n,) that its
    drives then need; `force` is the force in N against the pull that explains a change of them. A cable pulls too, but
    hardly more after some millimetres.
    """
    ways, efforts = parameters.ways, []
    for way in ways:
        efforts.append((yield from go_back(way)))
    forces = [force(felt - efforts[0]) for felt in efforts]
    stiffness = float(np.polyfit(ways, forces, 1)[0])
    over = 1e3 * (ways[-1] - ways[0])
    told = f"over {over:.1f} mm the pull rose by {1e-3 * stiffness:.2f} N/mm, limit {1e-3 * parameters.stiffness:.2f}"
    return Evidence(stiffness > parameters.stiffness, "pull", stiffness, parameters.stiffness, told)
