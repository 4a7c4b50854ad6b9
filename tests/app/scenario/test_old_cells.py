"""Cells from before they had sections: what stood in `known` and `hidden` themselves."""

from pathlib import Path
from typing import Any

import pytest
import yaml

from regrasp.app.files.resources import shipped
from regrasp.app.scenario.load import load_scenario
from regrasp.app.scenario.old_words import OldWordWarning
from regrasp.app.tasks.cable import TASK
from regrasp.app.tasks.cable.cells import cable_cell


def old_cell(folder: Path) -> Path:
    """The thesis's cell as it was written."""
    content: Any = yaml.safe_load(shipped("cell")["thesis"].read_text(encoding="utf-8"))
    for old, new in TASK.old_cell_keys.items():
        half, section, key = new.split(".")
        content[half][old.removeprefix(f"{half}.")] = content[half][section].pop(key)
    for role in ("hand", "overview", "search"):
        del content["known"]["cable"][role]
    assert not content["known"].pop("cable")
    path = folder / "old.yaml"
    path.write_text(yaml.safe_dump(content, sort_keys=False))
    return path


def test_an_old_cell_is_read_with_a_warning_for_each_key(tmp_path: Path) -> None:
    path = old_cell(tmp_path)
    with pytest.warns(OldWordWarning) as told:
        assert cable_cell(path) == cable_cell("thesis")
    assert len(told) == len(TASK.old_cell_keys)
    lines = [i for i, text in enumerate(path.read_text().splitlines(), 1) if text.startswith("  cable_length")]
    message = f"{path}:{lines[0]}: known.cable_length is an old key; write known.cable.length"
    assert message in {str(warning.message) for warning in told}


def test_a_scenario_and_the_command_line_may_say_the_old_key(tmp_path: Path) -> None:
    path = tmp_path / "mine.yaml"
    head = "description: old\ncell: thesis\ntree: recovery\ngravity: zero\n"
    path.write_text(f"{head}vary: {{cell.known.plugged_into: [back_2]}}\n")
    with pytest.warns(
        OldWordWarning, match=r"mine.yaml:5: cell.known.plugged_into is an old key; write cell.known.cable"
    ):
        varied = load_scenario(str(path))
    typed = load_scenario("no_obstacle", ["cell.known.cable_length=0.52", "cell.hidden.connector_mass=0.03"])
    assert varied.cell.model_dump()["known"]["cable"]["plugged_into"] == "back_2"
    assert typed.cell.model_dump()["known"]["cable"]["length"] == 0.52
    assert typed.cell.model_dump()["hidden"]["cable"]["connector_mass"] == 0.03
