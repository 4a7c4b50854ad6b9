import numpy as np
import pytest

from regrasp.interfaces.cable.cell import CableCell
from regrasp.sim.cable.random_scenes.clutter import rearranged
from regrasp.sim.cable.random_scenes.scene import RandomScene, Shot
from regrasp.sim.render.renderer import RendererName

RENDERERS: tuple[RendererName, ...] = ("moderngl", "software")


def shots(
    cell: CableCell, seed: int, count: int, held_out: bool = False, renderer: RendererName = "software"
) -> list[Shot]:
    try:
        scene = RandomScene(cell, np.random.default_rng(seed), held_out, renderer)
    except Exception as error:
        pytest.skip(f"no EGL here: {error}")
    try:
        return [scene.shot(present=i % 3 != 2, measured=True) for i in range(count)]
    finally:
        scene.close()


@pytest.mark.parametrize("held_out", [False, True])
def test_the_same_seed_gives_the_same_pictures(cell: CableCell, held_out: bool) -> None:
    first, again, other = (shots(cell, seed, 3, held_out) for seed in (1, 1, 2))
    for a, b, c in zip(first, again, other, strict=True):
        assert np.array_equal(a.rgb, b.rgb)
        assert np.array_equal(a.mask, b.mask)
        assert not np.array_equal(a.rgb, c.rgb)


@pytest.mark.parametrize("renderer", RENDERERS)
def test_the_mask_lies_in_the_outline_and_is_empty_without_a_connector(cell: CableCell, renderer: RendererName) -> None:
    seen = 0
    for i, shot in enumerate(shots(cell, 3, 18, renderer=renderer)):
        if i % 3 == 2:
            assert not shot.mask.any()
            assert np.isnan(shot.occlusion)
            continue
        if not shot.mask.any():
            continue
        seen += 1
        assert 0.0 <= shot.occlusion < 1.0
        v, u = np.nonzero(shot.mask)
        k = shot.camera.intrinsics
        z = shot.depth[shot.mask]
        points = np.column_stack([(u - k.cx) / k.fx * z, (v - k.cy) / k.fy * z, z])
        local = (shot.world_from_connector.inv() * shot.world_from_camera).apply(points)
        assert np.abs(local[:, 0]).max() < 0.047
        assert np.linalg.norm(local[:, 1:], axis=1).max() < 0.013
    assert seen > 5


def test_a_piece_of_foam_hides_parts_of_all_sizes(cell: CableCell) -> None:
    hidden = [s.occlusion for seed in range(4) for s in shots(cell, seed, 15, renderer="software") if s.mask.any()]
    counts, _ = np.histogram(hidden, [-1, 0.1, 0.3, 0.5, 0.7, 1.0])
    assert (counts > 0).all()


def test_held_out_cells_are_laid_out_otherwise(cell: CableCell) -> None:
    known = rearranged(cell.known, np.random.default_rng(0))
    before = {box.name: box.center for box in cell.known.boxes}
    after = {box.name: box.center for box in known.boxes}
    # the right panel's place is on the left
    assert before["right_panel"][1] < 0 < after["right_panel"][1]
    assert {s.center for s in known.cable.sockets}.isdisjoint({s.center for s in cell.known.cable.sockets})
