"""Cells with random pieces of foam, which the planning scene has seen as voxels."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from regrasp.app.scenario.placement import overlaps
from regrasp.app.scenario.sampling import StandParameters
from regrasp.app.scenario.shapes import JitteredBox, penetration_depth
from regrasp.app.studies.standing import StandingArm, StandingClock, StandingGripper
from regrasp.app.tasks.cable.placement import obstacle_overlaps
from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cable.cell import CableCell, CableKnown
from regrasp.interfaces.cell import Box
from regrasp.interfaces.scene import Obstacle
from regrasp.motion.cable.service import CableMotion
from regrasp.motion.cable.taking import CableMotionParameters


@dataclass(frozen=True)
class ClutterParameters:
    """The pieces of foam, in m. All are choices: what would stand on a bench before the panels."""

    pieces: tuple[int, int] = (1, 4)  # how many, both ends included
    edges: tuple[float, float] = (0.05, 0.16)  # of a piece's horizontal edges
    heights: tuple[float, float] = (0.08, 0.40)
    lower: tuple[float, float] = (0.14, -0.38)  # corners of where the pieces' middles are
    upper: tuple[float, float] = (0.44, 0.38)
    raised_share: float = 0.3  # of pieces on a stand
    raised: tuple[float, float] = (0.05, 0.25)  # from the floor to such a piece
    # along x, y and z between a piece and the cubes in a sleeping arm's spheres: what is seen within 25 mm of an arm
    # counts as the arm
    clear: float = 0.07
    voxel: float = 0.01  # edge of the voxels in which the pieces are seen, as in a run
    tries: int = 1000  # to place the pieces, after which all are placed anew: some leave no room for the last one
    starts: int = 10


def draw_pieces(
    cell: CableCell, rng: np.random.Generator, parameters: ClutterParameters = ClutterParameters()
) -> tuple[Obstacle, ...]:
    """Pieces of random number, size, place and yaw that overlap neither each other, nor the cell, nor a sleeping arm.

    Raises ValueError where there is no room for them.
    """
    count = int(rng.integers(parameters.pieces[0], parameters.pieces[1] + 1))
    for _ in range(parameters.starts):
        pieces: list[Obstacle] = []
        for _ in range(parameters.tries):
            if len(pieces) == count:
                return tuple(pieces)
            piece = _draw(f"piece_{len(pieces)}", rng, parameters)
            if _has_room(piece, cell, pieces, parameters.clear):
                pieces.append(piece)
    raise ValueError(f"no room for {count} pieces of foam in {parameters.starts} times {parameters.tries} tries")


def surface(piece: Obstacle, voxel: float) -> FloatArray:
    """Points (n, 3) m on the surfaces of a piece and of its stand, at most `voxel` m apart."""
    turn, points = Rotation.from_euler("z", piece.yaw), []
    for box in solid_parts(piece):
        axes = [np.linspace(-0.5, 0.5, 1 + int(np.ceil(edge / voxel))) for edge in box.size]
        grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
        shell = grid[np.abs(grid).max(axis=1) == 0.5]
        points.append(turn.apply(shell * np.asarray(box.size)) + np.asarray(box.center))
    return np.vstack(points)


def solid_parts(piece: Obstacle) -> list[Box]:
    """The box of a piece and that of its stand, if it has one; both are turned by its yaw about their own middles."""
    return [piece.box] if piece.stand is None else [piece.box, piece.stand]


class ClutteredCell:
    """A cell with pieces of foam, seen as voxels while both arms slept; and the motion service in it.

    `arms` by name may be put elsewhere. The jaws stand open as before a grasp.
    """

    def __init__(
        self, known: CableKnown, pieces: Sequence[Obstacle], seed: int, voxel: float = ClutterParameters().voxel
    ) -> None:
        self.known, self.pieces = known, tuple(pieces)
        parameters = CableMotionParameters()
        self.gap = parameters.execution.jaw.open_gap
        self.arms = {spec.name: StandingArm(spec.name, np.array(spec.sleep)) for spec in known.arms}
        jaws = {spec.name: StandingGripper(self.gap) for spec in known.arms}
        self.motion = CableMotion(known, self.arms, jaws, StandingClock(), seed, parameters)
        seen = [surface(piece, voxel) for piece in pieces]
        self.motion.set_obstacles(np.vstack([np.empty((0, 3)), *seen]), voxel)


def _draw(name: str, rng: np.random.Generator, parameters: ClutterParameters) -> Obstacle:
    x, y = rng.uniform(parameters.lower, parameters.upper).tolist()
    size = (*rng.uniform(*parameters.edges, 2).tolist(), float(rng.uniform(*parameters.heights)))
    bottom = float(rng.uniform(*parameters.raised)) if rng.random() < parameters.raised_share else 0.0
    yaw = float(rng.uniform(-np.pi, np.pi))
    return piece_at(name, (x, y, bottom), size, yaw)


def piece_at(
    name: str,
    bottom: tuple[float, float, float],
    size: tuple[float, float, float],
    yaw: float,
    stands: StandParameters = StandParameters(),  # noqa: B008 - it does not change
) -> Obstacle:
    """A piece of `size` m whose lower face's middle is at `bottom` m; off the floor it has a stand."""
    x, y, z = bottom
    box = Box(name=name, center=(x, y, z + 0.5 * size[2]), size=size)
    stand = None
    if z > stands.min_height:
        stand = Box(name=f"{name} stand", center=(x, y, 0.5 * z), size=(stands.edge, stands.edge, z))
    return Obstacle(box, yaw, stand)


def _has_room(piece: Obstacle, cell: CableCell, others: Sequence[Obstacle], clear: float) -> bool:
    swept = [_shape(box, piece.yaw, clear) for box in solid_parts(piece)]
    if any(_meet(part, _shape(box, other.yaw)) for part in swept for other in others for box in solid_parts(other)):
        return False
    if any(name.endswith("asleep") for part in swept for name, _ in overlaps(cell.known, part)):
        return False
    bare = [_shape(box, piece.yaw) for box in solid_parts(piece)]
    return not any(list(overlaps(cell.known, part)) or list(obstacle_overlaps(cell, part, None)) for part in bare)


def _shape(box: Box, yaw: float, clear: float = 0.0) -> JitteredBox:
    return JitteredBox(np.array(box.center), box.size, float(np.rad2deg(yaw)), (clear, clear, clear))


def _meet(a: JitteredBox, b: JitteredBox) -> bool:
    return penetration_depth(np.vstack([a.generators, b.generators]), a.center - b.center) > 0.0
