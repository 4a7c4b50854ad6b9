"""`regrasp report`: a run or a campaign as one page to look at."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from regrasp.app.files.findings import Finding, Findings, shown
from regrasp.app.interrupts import late_imports
from regrasp.app.records import folders

if TYPE_CHECKING:
    from regrasp.app.report.written import Written

_OWN = (*folders.FILES, "campaign.db", "campaign.lock", "video.mp4", "at_work.json")  # no page may take their place


def add_to(app: typer.Typer) -> None:
    """Add the command."""
    app.command()(report)


def report(
    folder: Annotated[
        str, typer.Argument(metavar="DIR", help="A run's folder, or a campaign's; DIR@2 is its second version.")
    ],
    out: Annotated[
        Path | None, typer.Option("-o", "--out", metavar="FILE", help="The page; default report.html in DIR.")
    ] = None,
    against: Annotated[
        str | None, typer.Option(metavar="DIR", help="For a campaign: another one, to compare it with.")
    ] = None,
    runs: Annotated[
        bool, typer.Option("--runs", help="For a campaign: write the reports of its failed runs, too, and link them.")
    ] = False,
    follow: Annotated[
        bool, typer.Option("--follow", help="Of a run that goes on: write the page anew every 3 s until it ends.")
    ] = False,
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
      regrasp report runs/short_obstacle-0-1 --follow    # watch it in a browser
      regrasp report results/tall_obstacle -o tall.html --runs
      regrasp report results/after --against results/before

    Exit code: 0, or 2 for bad input, also where a page was written of a
    damaged record.
    """
    with late_imports():
        from regrasp.app.campaigns.store import folder_named
        from regrasp.app.report import written

    place, _ = folder_named(folder)
    page = out or place / written.FILE
    campaign = written.is_campaign(place)
    found = _for_runs(follow=follow) if campaign else _for_campaigns(against=against, runs=runs)
    found += [*_taken(page, force)] if out is not None or place.is_dir() else []
    if found:
        raise Findings(found)
    damage = written.write_kept_reports(folder) if runs else []
    if campaign:
        made = written.write_campaign_report(folder, place, page, against)
    elif follow:
        made = _followed(Path(folder), page)
    else:
        made = written.write_run_report(Path(folder), page)
    typer.echo(str(made))
    if damage or made.found:
        raise Findings([*damage, *made.found])


def _for_campaigns(**options: object) -> list[Finding]:
    return [Finding(f"--{name}", 0, "is for campaigns; leave it out") for name, given in options.items() if given]


def _for_runs(**options: object) -> list[Finding]:
    return [Finding(f"--{name}", 0, "is for a run; leave it out") for name, given in options.items() if given]


def _followed(folder: Path, page: Path) -> "Written":
    """Write the page until the run ends, or Ctrl-C comes."""
    from regrasp.app.report.written import ended, follow_run

    pages = follow_run(folder, page)
    made = next(pages)
    if not ended(folder):
        typer.echo(
            f"{shown(page)}: open it in a browser; it follows the run until that ends. Ctrl-C stops it.", err=True
        )
    return [made, *pages][-1]


def _taken(page: Path, force: bool) -> list[Finding]:
    """Why the page cannot be written; [] if it can."""
    if found := folders.file_findings(page):
        return found
    if page.name in _OWN:
        return [Finding(shown(page), 0, "is the name of a record's own file; name another, such as report.html")]
    if page.is_file() and not force:
        return [Finding(shown(page), 0, "exists already; name another file with -o, or write --force")]
    return []
