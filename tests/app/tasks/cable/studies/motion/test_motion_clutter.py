from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from regrasp.app.tasks.cable.cells import cable_cell
from regrasp.app.tasks.cable.studies.motion.clutter import (
    ClutteredCell,
    ClutterParameters,
    draw_pieces,
    piece_at,
    solid_parts,
    surface,
)

CELL = cable_cell("thesis")
SIZES = ClutterParameters()


def drawn(seed: int) -> ClutteredCell:
    rng = np.random.default_rng(seed)
    return ClutteredCell(CELL.known, draw_pieces(CELL, rng), seed)


def test_a_seed_draws_its_own_pieces() -> None:
    first, again, other = (drawn(seed).pieces for seed in (1, 1, 2))
    assert first == again != other


@pytest.mark.parametrize("seed", range(6))
def test_pieces_are_seen_whole_and_touch_no_sleeping_arm(seed: int) -> None:
    cell = drawn(seed)
    assert 1 <= len(cell.pieces) <= 4
    spheres = np.vstack([cell.motion.model(name).spheres(arm.positions) for name, arm in cell.arms.items()])
    for piece in cell.pieces:
        seen = surface(piece, SIZES.voxel)
        gaps = np.linalg.norm(seen[:, None] - spheres[None, :, :3], axis=2) - spheres[:, 3]
        assert gaps.min() > 0.025, "what is seen so near to an arm counts as the arm"


def test_a_surface_has_no_hole_wider_than_a_voxel() -> None:
    piece = piece_at("foam", (0.3, 0.1, 0.2), (0.083, 0.051, 0.127), 0.6)
    points = surface(piece, 0.01)
    rng = np.random.default_rng(0)
    for box in solid_parts(piece):
        for axis in range(3):
            on_face = rng.uniform(-0.5, 0.5, (200, 3))
            on_face[:, axis] = 0.5
            place = box.center + Rotation.from_euler("z", piece.yaw).apply(on_face * box.size)
            far = np.linalg.norm(points[None] - place[:, None], axis=2).min(axis=1)
            assert far.max() <= 0.5 * np.sqrt(2) * 0.01 + 1e-9


def test_a_raised_piece_stands_on_a_post() -> None:
    stand = piece_at("foam", (0.3, 0.1, 0.2), (0.08, 0.05, 0.1), 0.6).stand
    assert stand is not None
    assert (stand.center, stand.size[2]) == ((0.3, 0.1, 0.1), 0.2)
    assert piece_at("foam", (0.3, 0.1, 0.0), (0.08, 0.05, 0.1), 0.6).stand is None


def test_no_room_is_an_error() -> None:
    with pytest.raises(ValueError, match=r"no room for \d pieces of foam in 10 times 5 tries"):
        draw_pieces(CELL, np.random.default_rng(0), ClutterParameters(edges=(2.0, 2.0), tries=5))


def test_pieces_that_leave_no_room_for_the_last_one_are_placed_anew() -> None:
    few = ClutterParameters(pieces=(4, 4), tries=60)
    assert len(draw_pieces(CELL, np.random.default_rng(1), few)) == 4
    with pytest.raises(ValueError, match="no room"):
        draw_pieces(CELL, np.random.default_rng(1), replace(few, starts=1))
