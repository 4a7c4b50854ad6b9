"""Runs that stand in for real ones in the processes of the plugin's tests."""

import os
import time
from pathlib import Path
from typing import Any

from regrasp.app.records.record import Record
from regrasp.app.records.result import Result
from regrasp.app.task.expectation import Expectation
from regrasp.interfaces.cable.cause import CableCause
from regrasp.interfaces.cause import Cause


def by_gravity(scenario: Any, folder: Path) -> Result:
    """On earth the run fails; with seed 13 its process dies."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "pid").write_text(str(os.getpid()))
    if scenario.file.seed == 13:
        os._exit(3)
    stowed = scenario.file.gravity == "zero"
    result = Result(
        scenario.name,
        scenario.file.seed,
        "success" if stowed else "failure",
        succeeded=stowed,
        task="cable",
        cause=None if stowed else Cause(CableCause.SEARCH_EXHAUSTED, "not seen from 18 stops"),
        expectations=(Expectation("outcome", stowed, "success" if stowed else "failure", "success"),),
    )
    with Record(folder, scenario.name, scenario.file.seed) as record:
        record.finish(result)
    return result


def until_stopped(scenario: Any, folder: Path) -> Result:
    """Waits to be interrupted, and says so in its folder."""
    folder.mkdir(parents=True, exist_ok=True)
    try:
        (folder / "started").touch()
        time.sleep(60)
    except KeyboardInterrupt:
        (folder / "interrupted").touch()
    return by_gravity(scenario, folder)
