"""Runs every case of a scenario and reports the results."""

import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from regrasp.app.cli.options import EXIT_UNMET
from regrasp.app.files.findings import Finding, Findings
from regrasp.app.interrupts import EXIT_INTERRUPTED
from regrasp.app.records import folders
from regrasp.interfaces.quote import printable

if TYPE_CHECKING:
    from regrasp.app.run.batch import Row, Run, RunEpisode, Settings


def run_every(
    scenario: str,
    overrides: Sequence[str],
    jobs: int,
    out: Path | None = None,
    junit: Path | None = None,
    settings: "Settings | None" = None,
    wrong: Sequence[Finding] = (),
    episode: "RunEpisode | None" = None,
) -> int:
    """Run every case, each in its own process, its record in a folder of `out` with its name.

    Progress goes to stderr, a table to stdout, JUnit XML to `junit`. Returns the exit code: 0 if all came out as
    expected, 1 if not, 130 after Ctrl-C, which keeps what was done. `episode` replaces `run_episode` in tests.

    Raises:
        Findings: bad input; `wrong` holds what the caller found.
        OSError: the disk is full or the like.
    """
    from regrasp.app.run.batch import Run, Settings, run_all
    from regrasp.app.run.junit import JunitCase, write_junit
    from regrasp.app.scenario.load import cases

    found = [*wrong, *(folders.file_findings(junit) if junit else [])]
    try:
        loaded = cases(scenario, overrides)
    except Findings as error:
        raise Findings([*found, *error.items]) from None
    names = [folders.folder_name(case.case) for case in loaded]
    found += (
        [f for name in names for f in folders.run_folder_findings(out / name)]
        if out
        else folders.folder_findings(folders.RUNS)
    )
    if found:
        raise Findings(found)
    into = out or folders.new_folder(f"{loaded[0].name}-all")
    runs = [Run(case, case.file.seed, into / name) for case, name in zip(loaded, names, strict=True)]
    rows, interrupted = run_all(runs, jobs, settings=settings or Settings(), episode=episode)
    if junit:
        junit.parent.mkdir(parents=True, exist_ok=True)
        cases_done = [JunitCase(r.scenario.name, r.scenario.case, rows.get(n), r.folder) for n, r in enumerate(runs)]
        write_junit(junit, loaded[0].name, cases_done)
    _tell(loaded[0].name, runs, rows, into)
    if settings and settings.report:
        _report([run.folder for number, run in enumerate(runs) if number in rows and run.folder])
    if interrupted:
        return EXIT_INTERRUPTED
    return 0 if all(row.succeeded for row in rows.values()) else EXIT_UNMET


def _report(records: Sequence[Path]) -> None:
    """Write each record's report into it; what is in the way of one goes to stderr."""
    from regrasp.app.report.written import FILE, write_run_report

    for folder in records:
        try:
            write_run_report(folder)
        except Findings as error:
            print(f"no report: {error}", file=sys.stderr)
    print(f"reports: {FILE} in each record")


def _tell(name: str, runs: "Sequence[Run]", rows: "Mapping[int, Row]", into: Path) -> None:
    from regrasp.app.campaigns.table import print_table

    header = ("case", "as expected", "outcome", "simulated s", "seconds")
    lines = [
        (
            printable(row.case),
            "yes" if row.succeeded else "no",
            row.outcome,
            f"{row.sim_seconds:.1f}",
            f"{row.wall_seconds:.1f}",
        )
        for row in rows.values()
    ]
    if lines:
        print_table(header, lines)
    for row in rows.values():
        if not row.succeeded:
            print(f"{printable(row.case)}: {printable(row.why)}")
    succeeded = sum(row.succeeded for row in rows.values())
    print(f"{name}: {succeeded} of {len(runs)} cases as expected; records in {into}")
