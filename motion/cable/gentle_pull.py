"""A gentle pull at what the hand has inserted, by which it feels whether that is held there."""

from collections.abc import Callable, Generator
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import RigidTransform

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cable.cell import CableKnown
from regrasp.interfaces.evidence import Evidence


@dataclass(frozen=True)
class GentlePullParameters:
    """How far is pulled, and what counts as held."""

    # m out of the clip, at each of which is felt: the clip's lips pull with 1.5 N/mm over 10 mm
    ways: tuple[float, ...] = (0.0015, 0.003, 0.0045)
    speed: float = 0.4  # share of the joints' speed in the small steps; choice
    # N/m that the force rises at least where something holds. Measured, 8 seeds on Earth, 8 without gravity: in the
    # clip 1410 to 1660; with open lips at the seat, 25 degrees askew, or 35 mm off on five sides -60 to 60
    stiffness: float = 600.0


def across_the_cable(known: CableKnown, world_from_connector: RigidTransform, way: FloatArray) -> FloatArray:
    """Unit vector (3,) nearest to a `way` (3,), both in the world, across the line from the cable's anchor to its end.

    Along that line the cable itself resists, by 3 N/mm where it is nearly straight.
    """
    anchor, _ = known.cable.anchor
    line = world_from_connector.apply([-0.5 * known.cable.connector.length, 0.0, 0.0]) - anchor
    across = way - (way @ line) / (line @ line) * line
    return np.asarray(across / np.linalg.norm(across))


def pull_gently(
    go_out: Callable[[float], Generator[None, None, FloatArray]],
    force: Callable[[FloatArray], float],
    parameters: GentlePullParameters = GentlePullParameters(),
) -> Generator[None, None, Evidence]:
    """Steps that pull; whether the force rises with the way as something that holds makes it.

    `go_out` are steps that bring the hand so many m out from where it stands, and return the efforts (n,) that its
    drives then need; `force` is the force in N against the pull that explains a change of them. A cable pulls too, but
    across itself hardly more after some millimetres.
    """
    ways, efforts = parameters.ways, []
    for way in ways:
        efforts.append((yield from go_out(way)))
    forces = [force(felt - efforts[0]) for felt in efforts]
    stiffness = float(np.polyfit(ways, forces, 1)[0])
    over = 1e3 * (ways[-1] - ways[0])
    least = f"held from {1e-3 * parameters.stiffness:.2f} on"
    told = f"over {over:.1f} mm the pull rose by {1e-3 * stiffness:.2f} N/mm ({least})"
    return Evidence(stiffness > parameters.stiffness, "pull", stiffness, parameters.stiffness, told)
