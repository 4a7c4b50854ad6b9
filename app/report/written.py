"""Writes the report of a run or of a campaign."""

import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from regrasp.app.campaigns import store
from regrasp.app.files.findings import Finding, Findings, shown
from regrasp.app.files.whole_file import write_named
from regrasp.app.records import folders
from regrasp.app.report.page import FILE as FILE
from regrasp.app.report.run_report import run_page


@dataclass(frozen=True)
class Written:
    """A page that was written, its bytes, and what is wrong in the folder that it shows."""

    page: Path
    size: int
    found: tuple[Finding, ...] = ()

    def __str__(self) -> str:
        return f"{shown(self.page)}, {self.size / 1e6:.1f} MB"


def is_campaign(folder: Path) -> bool:
    """Whether a folder holds a campaign."""
    return (folder / store.FILE).exists()


def write_run_report(folder: Path, page: Path | None = None, reload: int = 0) -> Written:
    """Write the report of a run's folder, by default into it; for `reload` see `run_page`. Raises `Findings`."""
    page = page or folder / FILE
    content, found = run_page(folder, reload)
    write_named(page, content)
    return Written(page, len(content), tuple(found))


@dataclass(frozen=True)
class FollowParameters:
    """How a run that goes on is shown. Real seconds."""

    every: int = 3  # between two pages
    silence: float = 60.0  # in which nothing was written: the run was killed; choice: a tick takes 1 s at most


def follow_run(folder: Path, page: Path, parameters: FollowParameters = FollowParameters()) -> Iterator[Written]:
    """Write the report of a run again and again until it ends or falls silent; the last one loads no other.

    Raises `Findings`.
    """
    try:
        while not ended(folder) and _silence(folder) < parameters.silence:
            yield write_run_report(folder, page, parameters.every)
            time.sleep(parameters.every)
    except KeyboardInterrupt:
        write_run_report(folder, page)
        raise
    yield write_run_report(folder, page)


def ended(folder: Path) -> bool:
    """Whether the run of a folder has its result."""
    return (folder / folders.RUN_FILES[0]).exists()


def _silence(folder: Path) -> float:
    """How long (s) nothing has been written into a run's folder; endless where there is none."""
    if not folder.is_dir():
        return float("inf")
    return time.time() - max((file.stat().st_mtime for file in folder.iterdir() if file.suffix != ".html"), default=0.0)


def write_campaign_report(name: str, folder: Path, page: Path | None = None, against: str | None = None) -> Written:
    """Write the report of the campaign of that name, by default into its folder; `against`: another, to compare it.

    Raises `Findings`.
    """
    from regrasp.app.report.campaign_report import campaign_page  # late: a run's report needs none of it

    page = page or folder / FILE
    content = campaign_page(name, against, page.absolute().parent)
    write_named(page, content)
    return Written(page, len(content))


def write_kept_reports(name: str) -> list[Finding]:
    """Write the reports of the failed runs whose records a campaign keeps, each into its record.

    Returns what is wrong in the records. Raises `Findings` if there is no such campaign.
    """
    from regrasp.app.report.campaign_report import kept_records

    found: list[Finding] = []
    for folder in kept_records(name):
        try:
            found += write_run_report(folder).found
        except Findings as error:
            found += error.items
    return found
