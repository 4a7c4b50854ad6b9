"""docs/report.md: its commands are ours, its pictures are small."""

import re
import shlex
from pathlib import Path
from typing import Any

import typer.main

from regrasp.app.cli.commands import app

PAGE = Path(__file__).parents[2] / "docs" / "report.md"
MAX_BYTES = 150_000


def test_the_page_s_commands_are_ours() -> None:
    (commands,) = re.findall(r"```sh\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    group: Any = typer.main.get_command(app)
    for line in commands.splitlines():
        words = shlex.split(line, comments=True)[1:]
        assert group.commands[words[0]].make_context(words[0], words[1:]).params


def test_its_pictures_are_small() -> None:
    pictures = re.findall(r"!\[[^]]+\]\(([^)]+\.jpg)\)", PAGE.read_text(encoding="utf-8"))
    assert len(pictures) == 2
    for name in pictures:
        assert (PAGE.parent / name).stat().st_size < MAX_BYTES
