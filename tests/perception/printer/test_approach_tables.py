"""The source's two tables: interpolation, extrapolation, and files that hold no such tables."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from regrasp.interfaces.printer.actions import Sighting
from regrasp.perception.printer.approach_tables import ApproachTables, linear, load_tables

KNOTS = st.lists(st.floats(-10, 10), min_size=2, max_size=8, unique=True).map(sorted)
GOOD: dict[str, Any] = {
    "area": [9000, 4000, 2000],
    "distance": [0.2, 0.3, 0.4],
    "scale": [6e-4, 8e-4, 1e-3],
    "aim": [0, 0],
}


@given(KNOTS.filter(lambda knots: min(np.diff(knots)) > 1e-3), st.floats(0, 1), st.randoms())
def test_between_the_knots_it_is_numpys_interpolation(knots: list[float], share: float, random: Any) -> None:
    values = [random.uniform(-1, 1) for _ in knots]
    at = knots[0] + share * (knots[-1] - knots[0])
    assert linear(tuple(knots), tuple(values), at) == pytest.approx(float(np.interp(at, knots, values)), abs=1e-6)


def test_beyond_the_knots_the_first_and_the_last_piece_go_on() -> None:
    assert linear((1.0, 2.0, 4.0), (10.0, 20.0, 30.0), 0.0) == pytest.approx(0.0)
    assert linear((1.0, 2.0, 4.0), (10.0, 20.0, 30.0), 8.0) == pytest.approx(50.0)


def test_a_box_right_of_and_below_the_middle_is_to_the_right_and_below() -> None:
    """The hand points along -x, so that right in the picture is +y in the world."""
    tables = ApproachTables.model_validate(GOOD)
    offset = tables.offset(Sighting((100.0, 50.0), 4000.0, 0.0, (0.0, 0.0, 100.0, 40.0)))
    assert offset == pytest.approx([-0.3, 0.08, -0.04])


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"area": [9000, 4000, 4000]}, "areas do not fall"),
        ({"distance": [0.2, 0.1, 0.4]}, "distance do not rise"),
        ({"scale": [1e-3, 8e-4, 6e-4]}, "scale do not rise"),
        ({"scale": [-1e-3, 8e-4, 9e-4]}, "not above 0"),
        ({"area": [9000, 4000]}, "2, 3 and 3 knots"),
        ({"area": [9000]}, "area"),
        ({"distance": "near"}, "distance"),
    ],
)
def test_tables_that_cannot_be_are_refused(change: dict[str, Any], told: str, tmp_path: Path) -> None:
    path = tmp_path / "tables.json"
    path.write_text(json.dumps(GOOD | change))
    with pytest.raises(ValueError, match=told) as error:
        load_tables(path)
    assert str(path) in str(error.value)


def test_the_shipped_tables_are_right() -> None:
    tables = load_tables()
    assert tables.distance[0] <= 0.2
    assert tables.distance[-1] >= 0.5
