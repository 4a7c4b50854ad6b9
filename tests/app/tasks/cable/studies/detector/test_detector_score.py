import numpy as np
import pytest

from regrasp.app.studies.detector.precision import true_box
from regrasp.app.tasks.cable.studies.detector.score import (
    OCCLUSION,
    ScoredPicture,
    ScoreParameters,
    average_precision,
    held_out_shots,
    occlusion_class,
    precision_interval,
)
from regrasp.interfaces.cable.cell import CableCell
from regrasp.perception.pose.detector import Detection

BOX = (10.0, 10.0, 50.0, 20.0)
ELSEWHERE = (100.0, 100.0, 140.0, 110.0)


def found(score: float, box: tuple[float, float, float, float] = BOX) -> Detection:
    return Detection(score, box, 0.0, 1.0)


def test_all_right_is_one_and_nothing_found_is_none() -> None:
    assert (
        average_precision([ScoredPicture([found(0.9)], BOX), ScoredPicture([found(0.4)], BOX), ScoredPicture([])])
        == 1.0
    )
    assert average_precision([ScoredPicture([], BOX)]) == 0.0
    assert average_precision([ScoredPicture([found(0.9)])]) == 0.0


def test_a_false_box_costs_by_its_score() -> None:
    pictures = [ScoredPicture([found(0.9)], BOX), ScoredPicture([found(0.5)], BOX)]
    assert average_precision([*pictures, ScoredPicture([found(0.95)])]) == pytest.approx(2 / 3)  # precision 1/2, 2/3
    assert average_precision([*pictures, ScoredPicture([found(0.7)])]) == pytest.approx(0.5 + 0.5 * 2 / 3)
    assert average_precision([*pictures, ScoredPicture([found(0.1)])]) == 1.0


def test_fewer_pictures_tell_the_precision_less_well() -> None:
    some = [ScoredPicture([found(0.9 - 0.01 * i)] if i % 4 else [found(0.8, ELSEWHERE)], BOX) for i in range(40)]
    (low, high), (lower, higher) = precision_interval(10 * some), precision_interval(some)
    assert lower < low < average_precision(some) < high < higher
    assert precision_interval(some) == (lower, higher)
    assert precision_interval([ScoredPicture([found(0.9)], BOX), ScoredPicture([])]) == (
        0.0,
        1.0,
    )  # some draws have none
    assert average_precision([]) == 0.0


def test_a_second_box_on_the_connector_and_a_shifted_one_are_wrong() -> None:
    assert ScoredPicture([found(0.9), found(0.8)], BOX).correct() == [True, False]
    assert ScoredPicture([found(0.9, (30.0, 10.0, 70.0, 20.0))], BOX).correct() == [False]
    assert ScoredPicture([found(0.9, ELSEWHERE), found(0.8)], BOX).correct() == [False, True]
    assert (
        ScoredPicture([found(0.9, ELSEWHERE), found(0.8)], BOX).false_positives,
        ScoredPicture([found(0.01, ELSEWHERE)]).false_positives,
    ) == (1, 0)


def test_a_masks_box_has_the_pixels_edges() -> None:
    mask = np.zeros((20, 30), np.bool_)
    assert true_box(mask) is None
    mask[4:7, 10:20] = True
    assert true_box(mask) == (9.5, 3.5, 19.5, 6.5)


def test_held_out_pictures_fill_every_class(cell: CableCell) -> None:
    least = 6  # px: the cell of tests has pictures of a sixteenth
    shots = held_out_shots(cell, 1, 1, parameters=ScoreParameters(min_visible_area=least))
    classes = [occlusion_class(s, least) if s.mask.any() else None for s in shots]
    assert classes == [*range(len(OCCLUSION)), None]
