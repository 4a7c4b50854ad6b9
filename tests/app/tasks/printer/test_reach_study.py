"""The reach study through its command."""

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from regrasp.app.cli.commands import app
from regrasp.app.files.resources import shipped
from regrasp.app.scenario.cell_file import load_cell
from regrasp.app.tasks.printer.studies import reach
from regrasp.interfaces.printer.cell import PrinterCell


def test_every_place_of_the_job_is_reached_and_the_figures_are_kept(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    words = ["study", "reach", "--seeds", "0:2", "--jobs", "1", "--out", str(tmp_path)]
    ended = CliRunner().invoke(app, words)
    assert ended.exit_code == 0, ended.output
    found = json.loads((tmp_path / "reach.json").read_text())
    assert found["all"]["reached"] == [36, 36]
    assert found["places"]["start 45-CE"]["reached"] == [2, 2]
    assert found["all"]["plan_ms"]["median"] > 0.0
    assert len(found["rows"]) == 2
    out = ended.output + capfd.readouterr().out
    assert "twist in the clamp" in out
    assert "36/36" in out


def test_a_place_that_cannot_be_reached_is_told_with_its_cause() -> None:
    """A beam that lies across the printer's opening, a hand's width before it."""
    cell = load_cell(shipped("cell")["habitat"])
    assert isinstance(cell, PrinterCell)
    beam = cell.known.boxes[0].model_copy(
        update={"name": "beam", "center": (-0.20, 2.55, 1.51), "size": (0.04, 1.6, 0.04)}
    )
    known = cell.known.model_copy(update={"boxes": (*cell.known.boxes, beam)})
    (row,) = reach.run_seed(cell.model_copy(update={"known": known}), 0, reach.ReachParameters())
    missed = {place.name: place.why for place in row.places if place.why}
    assert "goal" in missed
    assert "beam" in missed["goal"] or "keeps" in missed["goal"]
    assert "start 45-CE" not in missed
    assert "places reached; " in str(row)


def test_the_goal_is_reached_with_joints_from_which_the_straight_way_to_the_section_is_free() -> None:
    """From the nearest joints of this seed's goal the elbow would meet the printer's top on the way."""
    cell = load_cell(shipped("cell")["habitat"])
    assert isinstance(cell, PrinterCell)
    (row,) = reach.run_seed(cell, 115, reach.ReachParameters())
    assert [place for place in row.places if place.why] == []
