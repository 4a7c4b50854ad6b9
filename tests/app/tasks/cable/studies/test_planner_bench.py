import sys
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from regrasp.app.run.compose import build_world
from regrasp.app.scenario.load import load_scenario
from regrasp.app.scenario.sampling import draw_obstacles
from regrasp.app.tasks.cable.studies.birrt import Birrt
from regrasp.app.tasks.cable.studies.planner_bench import (
    Answer,
    compare,
    comparison_lines,
    ours,
    path_lengths,
    print_planner_bench,
)
from regrasp.app.tasks.cable.studies.planner_queries import Query, draw_queries
from regrasp.interfaces.arrays import FloatArray
from regrasp.motion.scene.planning_scene import PlanningScene
from regrasp.sim.world import World

SCENARIO = load_scenario("tall_obstacle")


@pytest.fixture(scope="module")
def world() -> Iterator[World[Any]]:
    made = build_world(SCENARIO, 0, "software")
    yield made
    made.close()


def drawn(world: World[Any], seed: int, count: int) -> list[Query]:
    scene = PlanningScene(world.cell.known, world.arms, {name: arm.gripper for name, arm in world.arms.items()})
    obstacles = draw_obstacles(SCENARIO.file, np.random.default_rng([0, 0]))
    return draw_queries(scene, obstacles, np.random.default_rng(seed), count)


def test_queries_lead_from_one_free_place_to_another(world: World[Any]) -> None:
    queries = drawn(world, 3, 24)
    assert [query.arm for query in queries] == ["left", "right"] * 12
    for query in queries:
        assert query.model.free(query.start, query.margin)
        assert query.model.free(query.goal, query.margin)
        assert np.abs(query.goal - query.start).max() > 1e-3
    assert any(not q.model.edge_free(q.start, q.goal, q.margin) for q in queries), "nothing stands in the way"


def test_a_seed_draws_its_own_queries(world: World[Any]) -> None:
    first, again, other = ([(q.start, q.goal) for q in drawn(world, seed, 6)] for seed in (1, 1, 2))
    assert np.array_equal(first, again)
    assert not np.array_equal(first, other)


def test_planners_are_asked_the_same_in_turn(world: World[Any], capsys: pytest.CaptureFixture[str]) -> None:
    queries, asked = drawn(world, 0, 2), []

    def fake(query: Query, seed: int) -> FloatArray | None:
        asked.append((query, seed))
        return np.array([query.start, query.start + 0.1, query.goal]) if seed else None

    answers = compare(queries, {"ours": ours, "fake": fake}, "two")
    assert asked == [(queries[0], 0), (queries[1], 1)]
    assert capsys.readouterr().err == "planner: two 1/2\nplanner: two 2/2\n"
    lines = comparison_lines(answers, queries[0].model.kinematics.chain.levers)
    assert [line[:3] for line in lines[:2]] == [("ours", "2", "2"), ("fake", "2", "1")]
    path = answers["ours"][1].path
    assert path is not None
    assert np.array_equal(path[[0, -1]], [queries[1].start, queries[1].goal])


def test_times_count_all_queries_and_paths_those_that_all_solved() -> None:
    short, long = np.zeros((2, 6)), np.zeros((3, 6))
    short[1, 0], long[1:, 0] = 1.0, (2.0, 4.0)
    answers = {
        "a": [Answer(0.01, short), Answer(0.02, long), Answer(0.03, None)],
        "b": [Answer(0.1, short), Answer(0.2, None), Answer(0.3, short)],
    }
    levers = np.array([0.75, 0.75, 0.5, 0.25, 0.25, 0.12])
    assert comparison_lines(answers, levers) == [
        ("a", "3", "2", "20.0", "1.0", "1.00", "0.75"),
        ("b", "3", "2", "200.0", "10.0", "1.00", "0.75"),
        ("a, not straight", "2", "1", "25.0", "1.0", "nan", "nan"),
        ("b, not straight", "2", "1", "250.0", "10.0", "nan", "nan"),
    ]
    assert path_lengths(long, levers) == pytest.approx((4.0, 3.0))


def test_without_the_package_one_line_says_how_to_get_it(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "pybullet_planning", None)
    print_planner_bench()
    out = capsys.readouterr().out
    assert out.count("\n") == 1
    assert "pip install -e '.[bench]'" in out


def test_birrt_answers_with_free_paths_by_either_check(world: World[Any]) -> None:
    package = pytest.importorskip("pybullet_planning")
    if world.client != package.CLIENT:
        pytest.skip("pybullet-planning plans in the first client only, and another test holds it")
    queries = drawn(world, 0, 2)
    birrt = Birrt(world, queries)
    for query in queries:
        for planner in (birrt.with_our_check, birrt.with_its_check):
            path = planner(query, 0)
            assert path is not None
            assert path[[0, -1]] == pytest.approx(np.array([query.start, query.goal]))
            again = planner(query, 0)
            assert again is not None
            assert np.array_equal(path, again)
        checked = birrt.with_our_check(query, 1)
        assert checked is not None
        assert all(query.model.free(q, query.margin) for q in checked)
