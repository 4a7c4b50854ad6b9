"""docs/networks.md: its network is right, and is planned as the page says."""

import re
from pathlib import Path

from typer.testing import CliRunner

from regrasp.app.cli.commands import app

PAGE = Path(__file__).parents[2] / "docs" / "networks.md"


def test_the_page_s_network_is_planned_as_it_says(tmp_path: Path) -> None:
    text = PAGE.read_text(encoding="utf-8")
    (network,) = re.findall(r"```yaml\n(.*?)```", text, re.DOTALL)
    (tmp_path / "lamp.yaml").write_text(network)
    result = CliRunner().invoke(app, ["plan", str(tmp_path / "lamp.yaml"), "--state", "key=lost"])
    assert result.exit_code == 0, result.output
    (told,) = re.findall(r"`regrasp plan lamp.yaml --state key=lost` plans `([^`]+)`", text)
    assert result.stdout.splitlines()[-1] == f"3 actions: {told}"


def test_the_page_s_commands_run(tmp_path: Path) -> None:
    (commands,) = re.findall(r"```sh\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    for line in commands.splitlines():
        arguments = line.partition("#")[0].split()[1:]
        if "-o" in arguments:
            at = arguments.index("-o") + 1
            arguments[at] = str(tmp_path / arguments[at])
        assert CliRunner().invoke(app, arguments).exit_code == 0, line
