"""`regrasp explain`, `replay` and `diff`: inspect the records of runs."""

import json
import os
import shutil
import sys
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

import regrasp
from regrasp.app.files.findings import Finding, Findings
from regrasp.interfaces.quote import printable

if TYPE_CHECKING:
    from regrasp.app.records.reader import RunRecord

EXIT_RUNS_DIFFER = 1
WIDTHS = (80, 120)  # least and largest width of a page
Folder = Annotated[Path, typer.Argument(metavar="DIR", help="A run's folder.")]


def add_to(app: typer.Typer) -> None:
    """Add the commands to `app`."""
    app.command()(explain)
    app.command()(replay)
    app.command()(diff)


def explain(
    folder: Folder, as_json: Annotated[bool, typer.Option("--json", help="Print it as JSON, for a program.")] = False
) -> None:
    """Say what a run tried and why it ended so.

    Each attempt with when it began and how it ended, the chain of causes, what the task measured, and what the robot
    knew at the end.

    \b
    Example:
      regrasp explain runs/short_obstacle-0-1
    """
    record = _read(folder)
    if as_json:
        typer.echo(_json(record))
        return
    from regrasp.app.records.explain import explanation

    width = min(max(shutil.get_terminal_size((100, 24)).columns, WIDTHS[0]), WIDTHS[1])
    typer.echo(explanation(record, width), nl=False)


def replay(
    folder: Folder,
    begin: Annotated[float | None, typer.Option("--from", metavar="SECONDS", help="Begin here.")] = None,
    end: Annotated[float | None, typer.Option("--to", metavar="SECONDS", help="End here.")] = None,
    part: Annotated[str, typer.Option("--filter", metavar="TEXT", help="Only nodes with this in their path.")] = "",
) -> None:
    """Step through a run on the terminal.

    The tree, what changed in it, what happened. In a pipe the changes are printed.

    A change is a tick in which a node's status changed or something happened; ticks that went like the one before are
    left out.

    \b
    Keys: right/left step, PgDn/PgUp ten changes, Home/End, n next failure,
    g go to a time, / filter, q quit.
    \b
    Examples:
      regrasp replay runs/short_obstacle-0-1
      regrasp replay runs/short_obstacle-0-1 --from 8 --to 12 --filter deliver
    """
    from regrasp.app.records.replay import Replay, check_span

    check_span(begin, end)
    run = Replay(_read(folder), float("inf") if end is None else end)
    run.check(begin or 0.0, part)
    if sys.stdin.isatty() and sys.stdout.isatty() and os.environ.get("TERM") != "dumb":
        from regrasp.app.cli.replay_screen import replay_on_screen

        replay_on_screen(run, part, begin or 0.0)
        return
    for line in run.lines(begin or 0.0, part):
        typer.echo(line)


def diff(folder: Folder, other: Annotated[Path, typer.Argument(metavar="DIR", help="Another run's folder.")]) -> None:
    """Say where two runs part.

    Their outcome, the first tick and the first event that differ, and what was run differently.

    \b
    Example:
      regrasp diff runs/short_obstacle-0-1 runs/short_obstacle-0-2
    \b
    Exit code: 0 they went the same way, 1 they did not, 2 bad input.
    """
    from regrasp.app.records.diff import beginnings, differences

    first, second = _read_both(folder, other)
    begun, parted = beginnings(first, second), differences(first, second)
    if begun or parted:
        typer.echo("\n".join([f"{printable(str(folder))} | {printable(str(other))}", *begun, *parted]))
    if parted:
        raise typer.Exit(EXIT_RUNS_DIFFER)
    typer.echo(f"the same {len(first.ticks)} lines of ticks and {len(first.events)} events")


def _read(folder: Path) -> "RunRecord":

    return regrasp.read_record(folder)


def _read_both(*folders: Path) -> "list[RunRecord]":
    """The records. Raises the findings of all of them."""
    found: list[Finding] = []
    records: list[RunRecord] = []
    for folder in folders:
        try:
            records.append(_read(folder))
        except Findings as error:
            found += error.items
    if found:
        raise Findings(found)
    return records


def _json(record: "RunRecord") -> str:
    from regrasp.app.records.history import attempts
    from regrasp.app.records.result import plain

    result = record.result.values() if record.result else None
    value: dict[str, Any] = {"run": record.begin, "result": result, "remarks": record.remarks}
    if result is None:
        value["attempts"] = [asdict(attempt) for attempt in attempts(record)]
    return json.dumps(plain(value), indent=2, allow_nan=False)
