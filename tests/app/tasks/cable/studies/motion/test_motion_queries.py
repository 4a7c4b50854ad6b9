from itertools import islice, pairwise

import numpy as np
import pytest

from regrasp.app.tasks.cable.cells import cable_cell
from regrasp.app.tasks.cable.studies.motion.birrt import birrt_in
from regrasp.app.tasks.cable.studies.motion.queries import KINDS, Query, draw_queries
from regrasp.app.tasks.cable.studies.motion.reference import ReferenceParameters, reference_path
from regrasp.app.tasks.cable.studies.motion.trial import QueryRow, TrialParameters, mesh_check, run_trial, touched_by
from regrasp.interfaces.arrays import FloatArray
from regrasp.motion.planning.planner import plan

CELL = cable_cell("thesis")
KEYS = list(KINDS)


def with_something_in_the_way(kind: str, seed: int) -> Query:
    drawn = islice(draw_queries(CELL, kind, np.random.default_rng(seed)), 20)
    return next(query for query in drawn if not query.model.edge_free(query.start, query.goal, query.margin))


@pytest.fixture(scope="module")
def blocked() -> Query:
    return with_something_in_the_way("to a grasp", 0)


def free_everywhere(query: Query, path: FloatArray, margin: float) -> bool:
    """Independent of the planners' own checks: four times as fine."""
    steps = [np.linspace(a, b, 2 + int(np.abs(b - a).max() / 0.0025)) for a, b in pairwise(path)]
    return all(query.model.free(q, margin) for q in np.vstack(steps))


@pytest.mark.parametrize("kind", KEYS)
def test_queries_lead_from_one_free_place_to_another(kind: str) -> None:
    query = next(draw_queries(CELL, kind, np.random.default_rng(3)))
    motion = query.cell.motion
    assert query.arm == (motion.search_arm if KEYS.index(kind) < 2 else motion.hand)
    assert query.model.free(query.start, query.margin)
    assert query.model.free(query.goal, query.margin)
    assert np.abs(query.goal - query.start).max() > 1e-3
    assert (query.held is not None) == (kind == "to the clip")
    again = next(draw_queries(CELL, kind, np.random.default_rng(3)))
    assert np.array_equal([again.start, again.goal], [query.start, query.goal])


def test_the_references_path_is_a_proof(blocked: Query) -> None:
    path = reference_path(blocked, 1)
    assert path is not None
    assert path[[0, -1]] == pytest.approx(np.array([blocked.start, blocked.goal]))
    assert free_everywhere(blocked, path, blocked.margin - 0.01)  # the map's voxels are a centimetre
    assert blocked.model.path_free(path, blocked.margin - 1e-4)
    assert reference_path(blocked, 1, ReferenceParameters(max_checks=10)) is None


def test_meshes_touch_the_foam_on_the_straight_way_only_and_none_on_a_planned_one(blocked: Query) -> None:
    pytest.importorskip("coal")
    path = plan(blocked.model, blocked.start, blocked.goal[None], 0, blocked.margin)
    assert touched_by(blocked, path) == ""
    middle = blocked.cell.pieces[0].box.center
    kin = blocked.model.kinematics
    inside = min(
        (q for q in np.random.default_rng(0).uniform(kin.lower, kin.upper, (2000, 6))),
        key=lambda q: float(np.linalg.norm(kin.tool_matrix(q)[:3, 3] - middle)),
    )
    assert mesh_check(blocked).touches(np.array([inside, inside]))


@pytest.mark.parametrize("seed", [20, 29])
def test_narrow_ways_are_found(seed: int) -> None:
    """20: every shortened path grazed the arm itself. 29: a search finds its way early, or not in a long time."""
    (row,) = run_trial(CELL, seed, TrialParameters(birrt=False, coal=False))
    assert isinstance(row, QueryRow)
    assert row.why == ""


def test_birrt_answers_with_free_paths_by_either_check(blocked: Query) -> None:
    package = pytest.importorskip("pybullet_planning")
    if package.is_connected():
        pytest.skip("pybullet-planning plans in the first client only, and another test holds it")
    held = next(draw_queries(CELL, "to the clip", np.random.default_rng(3)))
    for query in (blocked, held):
        with birrt_in(CELL, query) as birrt:
            assert birrt is not None
            path = birrt.with_our_check(0)
            assert path is not None
            assert all(query.model.free(q, query.margin) for q in path)
            path = birrt.with_its_check(0)
            assert path is not None
            assert path[[0, -1]] == pytest.approx(np.array([query.start, query.goal]))
            again = birrt.with_its_check(0)
            assert again is not None
            assert np.array_equal(path, again)
