import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from regrasp.app.cli.commands import app
from regrasp.app.tasks.cable.studies.contact import ContactTrial, contact_figures, contact_trial
from regrasp.interfaces.scene import Gravity


@pytest.mark.parametrize("gravity", ["zero", "earth"])
def test_an_arm_feels_an_unseen_block_presses_little_and_goes_round_it(gravity: Gravity) -> None:
    trial = contact_trial(gravity, 704)
    assert 0.0 < trial.peak_force < 15.0
    assert trial.touches >= 1
    assert trial.cause == ""
    assert trial.halt_seconds < 0.3


@pytest.mark.slow
def test_the_same_trial_again_is_the_same() -> None:
    assert contact_trial("zero", 700) == contact_trial("zero", 700)


def test_figures_count_forces_and_name_the_greatest() -> None:
    trials = [
        ContactTrial("zero", n, "left", force, int(force > 0), cause, 1.0, 0.2)
        for n, (force, cause) in enumerate([(0.0, ""), (12.0, ""), (20.0, "motion_blocked: x"), (31.0, "")])
    ]
    figures = contact_figures(trials)
    assert figures["at_most_15_N"] == [2, 4]
    assert figures["at_most_30_N"] == [3, 4]
    assert figures["felt"] == [3, 3]
    assert figures["came_to_goal"] == [3, 4]
    assert figures["peak_force"]["max"] == 31.0


@pytest.mark.slow
def test_the_command_prints_a_table_and_writes_the_figures(tmp_path: Path) -> None:
    done = CliRunner().invoke(app, ["study", "contact", "--seeds", "704:705", "--jobs", "1", "--out", str(tmp_path)])
    assert done.exit_code == 0, done.output
    assert "at most 15 N" in done.output
    written = json.loads((tmp_path / "contact.json").read_text(encoding="utf-8"))
    assert written["at_most_15_N"] == [2, 2]
    assert len(written["trials"]) == 2
