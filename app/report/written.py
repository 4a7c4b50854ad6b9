"""What a folder's report is: the page of a run, or that of a campaign."""

from dataclasses import dataclass
from pathlib import Path

from regrasp.app.files.findings import Finding, Findings
from regrasp.app.report.run_report import run_page


@dataclass(frozen=True)
class Written:
    """A page, the folder that it shows, a word for it, and what is wrong in the folder."""

    content: bytes
    folder: Path
    about: str
    found: tuple[Finding, ...] = ()


def report_of(name: str, against: str | None = None) -> Written:
    """The report of a run's folder, or of a campaign's; `against`: another campaign to compare it with.

    Raises `Findings` for a folder that is neither.
    """
    if against is not None:
        raise Findings([Finding("--against", 0, "is for campaigns")])
    folder = Path(name)
    content, found = run_page(folder)
    return Written(content, folder, "run", tuple(found))
