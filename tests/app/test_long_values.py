"""Whatever somebody writes, a message quotes little of it."""

import re
from pathlib import Path

import pytest
from toy_scenario import SCENARIO, TREE, write_scenario
from typer.testing import CliRunner

from regrasp.app.cli.commands import app
from regrasp.app.files.findings import Findings
from regrasp.app.files.resources import shipped
from regrasp.app.scenario.cell_file import load_cell
from regrasp.app.scenario.load import cases
from regrasp.interfaces.quote import MAX_QUOTE
from regrasp.trees import check_tree

LONG = ("9" * 5000, "a" * 5000, "{" + "a" * 5000 + "}", "[" + "a, " * 90 + "]")
MOST_OF_A_MESSAGE = 700  # letters: some words of ours, and some values
VARY = "vary:\n  seed: [1, 2]\n  inputs.tries: [1, 2]\n"
_WORD = re.compile(r"[\w.]+")


def replaced(text: str, new: str) -> list[str]:
    """The text, each of its words in turn with `new` in its place."""
    return [text[: m.start()] + new + text[m.end() :] for m in _WORD.finditer(text)]


def said(error: Findings) -> list[str]:
    return [item.message for item in error.items]


@pytest.mark.parametrize("new", LONG, ids=lambda new: new[:3])
def test_findings_in_scenarios_are_short(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, new: str) -> None:
    scenario = write_scenario(tmp_path, monkeypatch)
    for text in replaced(SCENARIO + VARY, new)[::9]:
        scenario.write_text(text)
        with pytest.raises(Findings) as raised:
            cases("mine.yaml", [f"inputs.{new}=1", f"{new}=3", f"seed={new}", new])
        assert [m for m in said(raised.value) if len(m) > MOST_OF_A_MESSAGE] == []


@pytest.mark.parametrize("new", LONG, ids=lambda new: new[:3])
def test_findings_in_trees_and_cells_are_short(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, new: str) -> None:
    write_scenario(tmp_path, monkeypatch)
    found = []
    for text in replaced(TREE, new):
        (tmp_path / "a.xml").write_text(text)
        found += [message for _, message in check_tree(Path("a.xml"), names={"socket": [new]})]
    for text in replaced(shipped("cell")["thesis"].read_text(), new)[::80]:
        (tmp_path / "a.yaml").write_text(text)
        try:
            load_cell(Path("a.yaml"))
        except Findings as error:
            found += said(error)
    assert [m for m in found if len(m) > MOST_OF_A_MESSAGE] == []


@pytest.mark.parametrize(
    "line",
    ["run short_obstacle --seed {}", "run {}", "run short_obstacle --case {}", "run short_obstacle --set {}",
     "run short_obstacle --jobs {}", "study demo --seeds {}", "study pose --seeds 0:{}",
     "study pose --techniques {}", "study pose --configurations {}", "trees check {}", "scenarios show {}"],
)  # fmt: skip
def test_what_is_wrong_on_the_command_line_is_told_in_short(line: str) -> None:
    result = CliRunner().invoke(app, [word.format("9" * 5000) for word in line.split()])
    assert result.exit_code == 2
    assert len(result.output) < 4 * MOST_OF_A_MESSAGE
    assert "9" * 2 * MAX_QUOTE not in result.output or "..." in result.output
