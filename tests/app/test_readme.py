"""The README's commands are commands of ours, and its samples are what the program prints; `make readme` runs them."""

import re
import shlex
from typing import Any

import pytest
import typer.main
from readme_commands import README, commands

from regrasp.app.cli.commands import app
from regrasp.app.scenario.load import cases

TEXT = README.read_text(encoding="utf-8")
OURS = [command for command in commands(TEXT) if command.startswith("regrasp ")]


@pytest.mark.parametrize("command", OURS)
def test_a_command_of_the_readme_is_one_of_ours(command: str) -> None:
    """All of its options and values are taken."""
    group: Any = typer.main.get_command(app)
    words = shlex.split(command)[1:]
    context = group.make_context("regrasp", list(words))
    while hasattr(group, "resolve_command"):
        name, group, words = group.resolve_command(context, words)
        context = group.make_context(name, list(words), parent=context)
    assert context.command is group


def test_runs_are_made_before_they_are_looked_at() -> None:
    made: dict[str, int] = {}
    for command in OURS:
        words = shlex.split(command)
        for record in (
            word for word in words if word.startswith("runs/") and words[1] in ("explain", "replay", "diff")
        ):
            name, _, number = record.removeprefix("runs/").rpartition("-")
            assert made.get(name, 0) >= int(number), command
        if words[1] == "run" and "--all" not in words:
            seed = words[words.index("--seed") + 1] if "--seed" in words else "0"
            name = f"{words[2].rsplit('/', 1)[-1]}-{seed}"
            made[name] = made.get(name, 0) + 1


def test_the_readme_s_scenario_is_right(tmp_path: Any) -> None:
    _, _, rest = TEXT.partition("```yaml\n")
    (tmp_path / "mine.yaml").write_text(rest.partition("```")[0])
    assert len(cases(str(tmp_path / "mine.yaml"))) == 30


def test_every_link_leads_somewhere() -> None:
    for link in re.findall(r"\]\(([^)]+)\)", TEXT):
        assert link.startswith("https://") or (README.parent / link).exists(), link
