import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from regrasp.app.scenario.sampling import draw_faults, draw_obstacles
from regrasp.app.scenario.schema import ObstacleSpec, ScenarioFile, scenario_model
from regrasp.app.tasks.cable import TASK
from regrasp.interfaces.fault import JawOpens
from regrasp.interfaces.scene import Gravity

JITTER = (0.004, 0.006, 0.002)


def a_file(gravity: Gravity = "zero", bottom: float = 0.10) -> ScenarioFile:
    piece = ObstacleSpec.model_validate(
        {
            "name": "short",
            "size": (0.08, 0.12, 0.18),
            "position": {"zero": (0.22, 0.12, bottom), "earth": (0.25, 0.10, 0.0)},
            "yaw_deg": 30.0,
            "jitter": JITTER,
        }
    )
    floor = piece.model_copy(update={"name": "flat", "jitter": (0.0, 0.0, 0.0)})
    return scenario_model(TASK).model_validate(
        {
            "description": "",
            "cell": "thesis",
            "tree": "recovery",
            "gravity": gravity,
            "obstacles": (piece, floor),
            "faults": ({"type": "jaw_opens", "when": {"carried": (0.3, 0.8)}, "seconds": 1.5},),
        }
    )


def test_the_same_seed_draws_the_same() -> None:
    def draw(seed: int) -> tuple[object, object]:
        rng = np.random.default_rng(seed)
        return draw_obstacles(a_file(), rng), draw_faults(a_file(), rng)

    assert draw(3) == draw(3)
    assert draw(3) != draw(4)


@given(st.integers(0, 10_000))
def test_pieces_lie_within_their_jitter(seed: int) -> None:
    piece, exact = draw_obstacles(a_file(), np.random.default_rng(seed))
    place = np.array(piece.box.center) - [0.0, 0.0, 0.09]
    assert np.all(np.abs(place - [0.22, 0.12, 0.10]) <= np.add(JITTER, 1e-12))
    assert exact.box.center == pytest.approx((0.22, 0.12, 0.19))
    assert piece.yaw == pytest.approx(np.pi / 6)
    assert piece.box.size == (0.08, 0.12, 0.18)


@given(st.integers(0, 10_000))
def test_faults_lie_within_their_share_of_the_way(seed: int) -> None:
    [fault] = draw_faults(a_file(), np.random.default_rng(seed))
    assert isinstance(fault, JawOpens)
    least, most = fault.when.model_dump()["carried"]
    assert 0.3 <= least == most <= 0.8
    assert fault.seconds == 1.5


def test_draws_spread_over_the_whole_jitter() -> None:
    rng = np.random.default_rng(0)
    places = np.array([draw_obstacles(a_file(), rng)[0].box.center for _ in range(300)])
    assert np.ptp(places, axis=0) == pytest.approx(2 * np.array(JITTER), rel=0.05)


def test_a_piece_off_the_floor_has_a_stand_that_reaches_from_the_floor_to_it() -> None:
    piece = draw_obstacles(a_file(), np.random.default_rng(1))[0]
    assert piece.stand is not None
    x, y, z = piece.box.center
    bottom = z - 0.09
    assert piece.stand.center == pytest.approx((x, y, bottom / 2))
    assert piece.stand.size[2] == pytest.approx(bottom)


def test_a_piece_on_the_floor_has_none_and_each_gravity_has_its_place() -> None:
    pieces = draw_obstacles(a_file("earth"), np.random.default_rng(1))
    assert pieces[1].stand is None
    assert pieces[1].box.center == pytest.approx((0.25, 0.10, 0.09))
