"""The habitat's first job, end to end."""

from pathlib import Path

import pytest

import regrasp
from regrasp.app.scenario.load import load_scenario


@pytest.mark.parametrize("gravity", ["zero", "earth"])
def test_the_door_is_opened_by_its_handle(gravity: str, tmp_path: Path) -> None:
    result = regrasp.run(load_scenario("printer_door", [f"gravity={gravity}"]), seed=3, out=tmp_path / "run")
    assert result.succeeded, [str(e) for e in result.expectations]
    assert result.measured["door_open"] == pytest.approx(0.42, abs=0.01)
    assert result.sim_seconds < 30.0
