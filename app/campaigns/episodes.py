"""Episodes as jobs of a campaign, and what their rows hold."""

import errno
import math
import os
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, cast

from regrasp.app.campaigns.campaign import Ended, Job, is_of_this_program
from regrasp.app.campaigns.digest import digest_of, scenario_digest
from regrasp.app.campaigns.scene import drawn_numbers
from regrasp.app.campaigns.store import Store, StoredRow, damaged_row
from regrasp.app.records.folders import folder_name
from regrasp.app.records.result import Result, plain
from regrasp.app.run.batch import Row, Run, RunEpisode, Settings, row_of, run_task, summary
from regrasp.app.run.processes import Done
from regrasp.app.scenario.load import load_scenario

if TYPE_CHECKING:
    from regrasp.sim.render.renderer import RendererName

KIND = "runs of scenarios"
Keep = Literal["all", "failed", "none"]
_DISK_FULL = "[Errno 28]"


def jobs_of(runs: Iterable[Run], settings: Settings, episode: RunEpisode | None = None) -> list[Job]:
    """A job for each run; `episode` replaces `run_episode` in tests."""
    digests: dict[int, str] = {}
    jobs = []
    for run in runs:
        if id(run.scenario) not in digests:
            digests[id(run.scenario)] = scenario_digest(run.scenario)
        name = f"{run.scenario.name}-{folder_name(run.scenario.case)}-{run.seed}"
        content = digests[id(run.scenario)]
        key = digest_of(content, run.seed, settings.renderer)
        family = f"{run.scenario.name} {run.scenario.case}", content
        jobs.append(Job(str(run), key, partial(_run, episode, run, settings), name, family))
    return jobs


def _run(episode: RunEpisode | None, run: Run, settings: Settings, folder: Path | None) -> Result:
    return run_task(replace(run, folder=folder), settings, episode)()


@dataclass(frozen=True)
class Stored:
    """Makes what is stored of an episode that has ended."""

    runs: Sequence[Run]
    keep: Keep
    wall_limit: float = math.inf  # s

    def __call__(self, number: int, done: Done[Result], folder: Path | None) -> Ended:
        """The row's values. Raises `OSError` when the disk is full: that says nothing about the robot."""
        run = replace(self.runs[number], folder=folder if folder and folder.is_dir() else None)
        row = row_of(run, done)
        cause = row.cause or {}
        if _DISK_FULL in done.error or _DISK_FULL in str(cause.get("message", "")):
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        keep = self.keep == "all" or (self.keep == "failed" and not row.succeeded)
        value = {**plain(asdict(row)), "source": _source(run)}
        if done.timed_out:
            value["stopped_after"] = self.wall_limit
        return Ended(value, summary(row), row.succeeded, keep)


def _source(run: Run) -> dict[str, Any]:
    """What the command line needs to do a run again, and what the seed drew of its scene."""
    scene = drawn_numbers(run.scenario, run.folder)
    source = {"scenario": str(run.scenario.path.absolute()), "overrides": list(run.scenario.overrides)}
    return {**source, "scene": scene} if scene else source


def row_in(stored: StoredRow) -> Row:
    """The figures of a stored run. Raises `Findings` for a damaged row."""
    try:
        return Row(**{key: value for key, value in stored.value.items() if key not in ("source", "stopped_after")})
    except TypeError:
        raise damaged_row(stored.number) from None


def again(stored: StoredRow, store: Store) -> tuple[Run, list[str]]:
    """The run of a row, to be done again, and sentences on what may make it come out otherwise.

    Raises `Findings` if its scenario cannot be read any more.
    """
    source, row = stored.value["source"], row_in(stored)
    run = Run(load_scenario(source["scenario"], source["overrides"], row.case), row.seed)
    remarks = []
    if jobs_of([run], Settings(renderer=cast("RendererName", row.renderer)))[0].key != stored.key:
        remarks.append("the scenario, its cell, a robot or its tree has changed since; it may come out otherwise")
    if not any(is_of_this_program(version) for version in store.versions() if version.id == stored.version):
        remarks.append("other sources or packages did it; it may come out otherwise")
    return run, remarks
