import numpy as np
import pytest

from regrasp.app.tasks.cable.cells import cable_cell
from regrasp.app.tasks.cable.studies.motion.clutter import piece_at
from regrasp.app.tasks.cable.studies.motion.infeasible import INFEASIBLE, crosses_foam, draw_infeasible
from regrasp.app.tasks.cable.studies.motion.trial import infeasible_row
from regrasp.motion.robots.kinematics import ArmKinematics

CELL = cable_cell("thesis")


@pytest.mark.parametrize("kind", INFEASIBLE)
@pytest.mark.parametrize("seed", [0, 1])
def test_what_cannot_be_done_is_refused_with_its_cause_and_numbers(kind: str, seed: int) -> None:
    row = infeasible_row(CELL, seed, kind)
    assert row.named, row
    assert row.cause == row.expected
    assert any(character.isdigit() for character in row.message)
    assert infeasible_row(CELL, seed, kind).message == row.message


def test_another_cause_or_sentence_is_not_named() -> None:
    request = draw_infeasible(CELL, "walled in", np.random.default_rng(0))
    sentence = "no path to 1 goals at 15 mm margin in 40000 checked configurations"
    assert request.is_named("planning_failed", sentence)
    assert not request.is_named("out_of_reach", sentence)
    assert not request.is_named("planning_failed", "no path")


def test_walls_close_the_way_only_without_a_gap() -> None:
    request = draw_infeasible(CELL, "walled in", np.random.default_rng(0))
    spec = CELL.known.arm(CELL.known.cable.hand)
    kin = ArmKinematics(spec.robot, spec.world_from_base)
    pieces, turn = request.cell.pieces, request.cell.pieces[0].yaw
    assert crosses_foam(kin, pieces, turn)
    assert not crosses_foam(kin, pieces[:-1], turn), "without the lid the upper arm passes between the walls"
    assert not crosses_foam(kin, pieces, turn + 0.3)
    assert not crosses_foam(kin, (piece_at("foam", (0.3, 0.0, 0.0), (0.1, 0.1, 0.1), 0.0),), turn)
