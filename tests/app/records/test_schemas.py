"""Records of every schema there has been are read: short runs, left by the program of their time."""

from pathlib import Path

import pytest
from typer.testing import CliRunner

from regrasp.app.cli.commands import app
from regrasp.app.records.reader import read_record
from regrasp.app.records.result import SCHEMA

SCHEMAS = sorted((Path(__file__).parent / "schemas").iterdir())


def test_there_is_one_of_each() -> None:
    assert [path.name for path in SCHEMAS] == [str(n + 1) for n in range(SCHEMA)]


@pytest.mark.parametrize("folder", SCHEMAS, ids=lambda path: str(path.name))
def test_a_record_of_it_is_read_and_explained(folder: Path) -> None:
    record = read_record(folder)
    assert record.result is not None
    assert record.remarks == ()
    assert (record.result.outcome, record.result.task, record.result.seed) == ("time_limit", "cable", 0)
    assert record.events[0].event == "begin"
    assert record.ticks
    assert (record.signals() is not None) == (folder / "signals.f32").exists()
    page = CliRunner().invoke(app, ["explain", str(folder)])
    assert page.exit_code == 0
    assert "not done after" in page.stdout
    assert CliRunner().invoke(app, ["diff", str(folder), str(folder)]).exit_code == 0
