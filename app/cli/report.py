"""`regrasp report`: a run or a campaign as one page to look at."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from regrasp.app.files.findings import Finding, Findings, shown
from regrasp.app.files.whole_file import write_named
from regrasp.app.interrupts import late_imports
from regrasp.app.records import folders

if TYPE_CHECKING:
    from regrasp.app.report.written import Written

FILE = "report.html"


def add_to(app: typer.Typer) -> None:
    """Add the command."""
    app.command()(report)


def report(
    folder: Annotated[
        str, typer.Argument(metavar="DIR", help="A run's folder, or a campaign's; DIR@2 is its second version.")
    ],
    out: Annotated[
        Path | None, typer.Option("-o", "--out", metavar="FILE", help=f"The page; default {FILE} in DIR.")
    ] = None,
    against: Annotated[
        str | None, typer.Option(metavar="DIR", help="For a campaign: another one, to compare it with.")
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Write over a page that exists.")] = False,
) -> None:
    """Write a page that shows a run or a campaign.

    One HTML file that needs no other file and no network. Of a run: what was asked, what came out and why, and its
    course, with a slider that moves tree, pictures, curves and log. Of a campaign: how often, why not, and what
    decides it.

    What can be read of a damaged record is shown; the page and a line here say what is missing.

    \b
    Examples:
      regrasp report runs/short_obstacle-0-1
      regrasp report results/tall_obstacle -o tall.html
      regrasp report results/after --against results/before

    Exit code: 0, or 2 for bad input, also where a page was written of a
    damaged record.
    """
    with late_imports():
        from regrasp.app.report.written import report_of
    if out is not None:
        _check(out, force)
    made = report_of(folder, against)
    page = out or made.folder / FILE
    if out is None:
        _check(page, force)
    write_named(page, made.content)
    _tell(made, page)


def _check(page: Path, force: bool) -> None:
    """Raises `Findings` if the page cannot be written, or stands for something else."""
    found = folders.file_findings(page)
    if not found and page.exists():
        if page.name in folders.FILES and (page.parent / "events.jsonl").exists():
            found = [Finding(shown(page), 0, "belongs to a run's record; name another file")]
        elif not force and page.is_file():
            found = [Finding(shown(page), 0, "exists already; name another file with -o, or write --force")]
    if found:
        raise Findings(found)


def _tell(made: "Written", page: Path) -> None:
    typer.echo(f"{made.about}: {shown(page)}, {len(made.content) / 1e6:.1f} MB")
    if made.found:
        raise Findings([*made.found])
