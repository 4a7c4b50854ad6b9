"""What the campaign commands print and write: tables, failures, a comparison, CSV and JUnit."""

import csv
import io
import math
from collections.abc import Iterable
from dataclasses import fields
from pathlib import Path
from typing import Any

import typer

from regrasp.app.campaigns.episodes import row_in
from regrasp.app.campaigns.figures import Comparison, by_case, failure_groups
from regrasp.app.campaigns.store import Store, StoredRow, Version
from regrasp.app.campaigns.table import print_table
from regrasp.app.files.findings import Findings, shown
from regrasp.app.records.explain import explanation
from regrasp.app.records.reader import read_record
from regrasp.app.run.batch import Row
from regrasp.app.run.junit import JunitCase, write_junit
from regrasp.interfaces.quote import printable

_SHOWN = 5  # runs of a group of failures
_WIDTH = 116  # characters of an explanation
_LEVEL = 0.05  # of p
_HEADER = ("case", "as expected", "95 % interval", "simulated s, 5 %", "50 %", "95 %", "wall s, 50 %")


def print_failures(store: Store, version: Version) -> None:
    """Print the groups of failures, the first kept record of each in full."""
    groups = failure_groups(store.rows(version.id))
    assert store.folder is not None
    if not groups:
        typer.echo(f"all {version.runs} runs came out as expected")
    for group in groups:
        where = f" at {printable(group.node)}" if group.node else ""
        typer.echo(f"{len(group.rows)} x {group.reason}{where}")
        for stored in group.rows[:_SHOWN]:
            typer.echo(f"  row {stored.number}  {printable(stored.title)}: {printable(row_in(stored).why)}")
        if len(group.rows) > _SHOWN:
            typer.echo(f"  and {len(group.rows) - _SHOWN} more")
        kept = next((stored for stored in group.rows if stored.record), None)
        if kept is None:
            first = group.rows[0].number
            typer.echo(f"  no record was kept; regrasp campaign rerun {shown(store.folder)} {first}\n")
            continue
        typer.echo(f"\n  row {kept.number} in full, {shown(store.folder / kept.record)}:")
        try:
            told = explanation(read_record(store.folder / kept.record), _WIDTH)
        except Findings as error:
            told = str(error)
        typer.echo("".join(f"    {line}\n" if line else "\n" for line in told.splitlines()))


def print_comparison(found: Comparison) -> None:
    """Print a comparison that has scenes."""
    k, n = found.succeeded, found.scenes
    left_out = f" ({found.only_first} are only in A, {found.only_second} only in B)"
    typer.echo(f"{n} scenes in both{left_out if found.only_first or found.only_second else ''}")
    typer.echo(f"as expected: {k[0]} in A, {k[1]} in B")
    for name, scenes in (("better in B", found.better), ("worse in B", found.worse)):
        typer.echo(f"{name}: {len(scenes)}")
        for scene in scenes:
            typer.echo(f"  {printable(scene)}")
    verdict = "more than chance" if found.p < _LEVEL else "chance can explain it"
    typer.echo(f"exact McNemar test: p = {found.p:.3g}: {verdict}")
    if math.isnan(found.medians[0]):
        typer.echo("no scene came out as expected in both, so times are not compared")
    else:
        middle, low, high = found.difference
        typer.echo(
            f"simulated seconds where both did: median {found.medians[0]:.1f} in A, {found.medians[1]:.1f} in B; "
            f"B takes {middle:+.2f} (95 % interval {low:+.2f} to {high:+.2f})"
        )
    typer.echo(
        f"so many scenes would show, with 80 % probability, that {100 * found.detectable:.1f} % of them got better and "
        "none worse; smaller differences may be missed"
    )


def print_cases(store: Store, version: int, keys: set[str] | None = None) -> float:
    """Print the table by case of all rows, or of those with these keys. Returns where the interval of all begins."""
    cases = by_case(row for row in store.rows(version) if keys is None or row.key in keys)
    if not cases[-1].runs:  # interrupted before the first had ended
        return cases[-1].interval[0]
    lines = []
    for case in cases:
        low, high = case.interval
        sim = [f"{seconds:.1f}" for seconds in case.sim_seconds] or ["-"] * 3
        wall = f"{case.wall_seconds[1]:.1f}" if case.wall_seconds else "-"
        share = f"{100 * low:.1f} to {100 * high:.1f} %"
        lines.append((printable(case.case), f"{case.succeeded}/{case.runs}", share, *sim, wall))
    print_table(_HEADER, lines)
    for case in cases[:-1]:
        for cause, count in case.causes.items():
            typer.echo(f"{printable(case.case)}: {count} x {printable(cause)}")
    return cases[-1].interval[0]


def csv_text(rows: Iterable[StoredRow]) -> str:
    """A line a run, with a header."""
    plain_fields = [field.name for field in fields(Row) if field.name not in ("measured", "wall_by_part", "cause")]
    text = io.StringIO(newline="")
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["row", "ended", "record", "cause", "node", *plain_fields])
    for stored in rows:
        row = row_in(stored)
        cause = row.cause or {}
        values = [_cell(getattr(row, name)) for name in plain_fields]
        what = (_cell(cause.get(key)) for key in ("code", "node"))
        writer.writerow([stored.number, stored.ended, stored.record, *what, *values])
    return text.getvalue()


def _cell(value: Any) -> Any:
    value = " ".join(value) if isinstance(value, list) else value
    return printable(value) if isinstance(value, str) else value


def write_rows_junit(path: Path, store: Store, version: Version) -> None:
    """Write a JUnit test case for each run; folders on the way are made."""
    assert store.folder is not None
    cases = [
        JunitCase(
            row_in(stored).scenario,
            f"{row_in(stored).case} seed {row_in(stored).seed}",
            row_in(stored),
            store.folder / stored.record if stored.record else None,
        )
        for stored in store.rows(version.id)
    ]
    path.parent.mkdir(parents=True, exist_ok=True)
    write_junit(path, store.folder.name, cases)
