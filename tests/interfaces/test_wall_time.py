import time

import pytest

from regrasp.interfaces.wall_time import counts_as, measured


@counts_as("physics")
def inner() -> int:
    time.sleep(0.03)
    return 7


@counts_as("step loop")
def outer() -> int:
    time.sleep(0.01)
    return inner()


def test_a_part_s_time_does_not_count_twice_and_all_of_it_counts() -> None:
    began = time.perf_counter()
    with measured("start") as wall:
        assert outer() == 7
        wall.switch("tree")
    whole = time.perf_counter() - began
    assert wall.seconds["physics"] >= 0.03
    assert 0.01 <= wall.seconds["step loop"] <= whole - 0.03
    assert sum(wall.seconds.values()) <= whole
    assert set(wall.seconds) == {"start", "step loop", "physics"}


def test_a_part_that_raises_gives_the_clock_back() -> None:
    @counts_as("planning")
    def fails() -> None:
        raise ValueError("lost")

    with measured("tree") as wall:
        with pytest.raises(ValueError, match="lost"):
            fails()
        assert wall.switch("record") == "tree"


def test_without_a_measurement_nothing_is_timed() -> None:
    assert inner() == 7
