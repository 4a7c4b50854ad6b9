import numpy as np
import pytest

from regrasp.perception.detection import intersection_over_union

torch = pytest.importorskip("torch", reason="the extra train is missing")


def test_the_distance_of_boxes_is_one_less_their_overlap_plus_that_of_their_middles() -> None:
    from regrasp.app.studies.detector.training import box_distance

    rng = np.random.default_rng(0)
    middles, edges = rng.normal(size=(2, 100, 2)), np.exp(rng.normal(size=(2, 100, 2)))
    low, high = middles - edges / 2, middles + edges / 2
    boxes, others = (
        torch.from_numpy(np.hstack(b).T[None, None, :, :, None].copy())
        for b in zip(middles, np.log(edges), strict=True)
    )
    found = box_distance(boxes, others).numpy().ravel()
    for i, distance in enumerate(found):
        overlap = intersection_over_union(*((*low[k, i], *high[k, i]) for k in range(2)))
        across = np.linalg.norm(high[:, i].max(axis=0) - low[:, i].min(axis=0))
        apart = np.linalg.norm(middles[0, i] - middles[1, i])
        assert distance == pytest.approx(1 - overlap + (apart / across) ** 2)
    assert np.abs(box_distance(boxes, boxes).numpy()).max() < 1e-12


def test_a_thin_box_pays_for_an_error_that_a_square_one_hardly_feels() -> None:
    from regrasp.app.studies.detector.training import loss

    def losses(height: float) -> list[float]:
        wanted = torch.zeros(1, 1, 7, 2, 2)
        wanted[0, 0, 0, 0, 0] = wanted[0, 0, 5, 0, 0] = 1.0
        wanted[0, 0, 6] = 1.0
        wanted[0, 0, 4] = float(np.log(height))
        maps = torch.cat([wanted[:, :, 0], wanted[0, :, 1:5]], dim=1)
        maps[0, 2] += 0.2  # cells off along v
        return [float(loss(maps, wanted, weight)) for weight in (0.0, 1.0)]

    thin, square = losses(0.4), losses(4.0)
    assert thin[0] == pytest.approx(square[0], abs=1e-5)
    assert thin[1] - thin[0] > 5 * (square[1] - square[0])
