"""The tree and the scenario of docs/printer.md, and the commands that it names."""

import json
import re
from pathlib import Path

from typer.testing import CliRunner

import regrasp
from regrasp.app.cli.commands import app

PAGE = Path(__file__).parents[2] / "docs" / "printer.md"


def test_the_pages_tree_opens_the_door_and_sees_the_part(tmp_path: Path) -> None:
    text = PAGE.read_text(encoding="utf-8")
    for name, language in (("look_inside.xml", "xml"), ("look_inside.yaml", "yaml")):
        (written,) = re.findall(rf"```{language}\n(.*?)```", text, re.DOTALL)
        (tmp_path / name).write_text(written, encoding="utf-8")
    result = regrasp.run(tmp_path / "look_inside.yaml", seed=1, out=tmp_path / "run")
    assert result.succeeded, [str(e) for e in result.expectations]
    events = [json.loads(line) for line in (tmp_path / "run/events.jsonl").read_text().splitlines()]
    (seen,) = [event for event in events if event["event"] == "saw the target"]
    assert seen["area"] > 300.0


def test_the_pages_leaves_and_commands_are_there() -> None:
    text = PAGE.read_text(encoding="utf-8")
    listed = CliRunner().invoke(app, ["trees", "leaves"]).output
    rows = re.findall(r"^\| (?:manipulator|gripper|rail|image analyzer) \|(.*?)\|", text, re.MULTILINE)
    leaves = [leaf for row in rows for leaf in re.findall(r"`(\w+)`", row)]
    assert len(leaves) == 7
    assert all(f"\n{leaf} " in listed for leaf in leaves)
    for words in re.findall(r"^regrasp (.*?)  +#", text, re.MULTILINE):
        assert CliRunner().invoke(app, [*words.split(), "--help"]).exit_code == 0
