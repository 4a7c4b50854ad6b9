"""Counts and pairs: published figures, and what must hold of any."""

import math
import random

import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import binomtest

from regrasp.app.campaigns.statistics import detectable_share, mcnemar_p, median_interval, wilson_interval


@pytest.mark.parametrize(
    ("better", "worse", "p"),
    [
        (6, 0, 2 / 64),
        (0, 5, 2 / 32),
        (0, 0, 1.0),
        (4, 4, 1.0),
        (15, 4, 0.0192108),  # Fagerland, Lydersen, Laake 2013: twice the binomial tail
    ],
)
def test_mcnemar(better: int, worse: int, p: float) -> None:
    assert mcnemar_p(better, worse) == pytest.approx(p, rel=1e-3)


def test_as_many_scenes_show_what_they_say_they_would() -> None:
    draw, n = random.Random(1), 300
    share = detectable_share(n)
    shown = [mcnemar_p(sum(draw.random() < share for _ in range(n)), 0) < 0.05 for _ in range(600)]
    assert sum(shown) / len(shown) == pytest.approx(0.8, abs=0.05)
    assert detectable_share(5) == 1.0
    assert detectable_share(6) == pytest.approx(0.8 ** (1 / 6))


def test_the_interval_holds_the_median_as_often_as_it_says() -> None:
    draw, inside = random.Random(2), 0
    for _ in range(1000):
        middle, low, high = median_interval([draw.expovariate(1.0) for _ in range(25)])
        assert low <= middle <= high
        inside += low <= math.log(2) <= high
    assert 0.95 <= inside / 1000 < 0.98
    assert median_interval([3.0]) == (3.0, 3.0, 3.0)
    assert math.isnan(median_interval([])[0])


@given(st.integers(0, 2000).flatmap(lambda n: st.tuples(st.integers(0, n), st.just(n))), st.floats(0.5, 0.999))
def test_wilson_s_interval_is_scipy_s(counts: tuple[int, int], level: float) -> None:
    successes, trials = counts
    right = binomtest(successes, trials).proportion_ci(level, method="wilson") if trials else (0.0, 1.0)
    assert wilson_interval(successes, trials, level) == pytest.approx((right[0], right[1]), abs=1e-12)
