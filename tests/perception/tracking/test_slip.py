import numpy as np
import pytest

from regrasp.perception.tracking.slip import distance_slip, seen_at

CENTER = np.array([0.3, -0.1, 0.4])


def test_distance_beyond_the_thesiss_limit_is_a_slip() -> None:
    assert not distance_slip(CENTER, np.add(CENTER, [0.0, 0.0, -0.199])).detected
    evidence = distance_slip(CENTER, np.add(CENTER, [0.0, 0.0, -0.25]))
    assert (evidence.detected, evidence.by, evidence.limit) == (True, "distance", 0.2)
    assert evidence.value == pytest.approx(0.25)
    assert "0.250 m" in evidence.sentence


def test_seen_at_a_place() -> None:
    assert seen_at(CENTER, np.add(CENTER, [0.0, 0.03, 0.0]), 0.05).detected
    assert not seen_at(CENTER, np.add(CENTER, [0.0, 0.06, 0.0]), 0.05).detected
