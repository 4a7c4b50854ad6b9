"""`regrasp campaign`: many runs that are kept, counted and compared."""

import csv
import io
import json
import math
import os
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer
from typer.core import TyperGroup

from regrasp.app.cli.options import EXIT_UNMET, RendererOption, Sets, WallLimitSeconds, parse_seeds
from regrasp.app.files.findings import Finding, Findings, shown
from regrasp.app.interrupts import EXIT_INTERRUPTED, late_imports
from regrasp.app.records import folders
from regrasp.interfaces.quote import printable

if TYPE_CHECKING:
    from regrasp.app.campaigns.campaign import Engine
    from regrasp.app.campaigns.store import Store, StoredRow, Version

RESULTS = Path("results")  # where campaigns go by default
_RUN = "run"


class _Group(TyperGroup):
    """Takes what is no command's name as the scenario of `run`."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        if args and args[0] not in (*self.commands, "--help"):
            args = [_RUN, *args]
        return super().parse_args(ctx, args)


app = typer.Typer(
    cls=_Group,
    no_args_is_help=True,
    rich_markup_mode=None,
    help="""Many runs that are kept, counted and compared.

    \b
    Examples:
      regrasp campaign tall_obstacle --seeds 0:100 --out results/tall
      regrasp campaign show results/tall
      regrasp campaign failures results/tall

    `regrasp campaign SCENARIO` is short for `regrasp campaign run SCENARIO`.
    """,
)
Folder = Annotated[str, typer.Argument(metavar="DIR", help="A campaign's folder; DIR@2 is its second version.")]


@app.command(_RUN)
def run_campaign(
    scenario: Annotated[
        str, typer.Argument(metavar="SCENARIO|FILE", help="A scenario's name or .yaml file, or a campaign file.")
    ],
    seeds: Annotated[
        str | None,
        typer.Option(metavar="A:B", help="Seeds from A up to, not including, B; default the file's, else one."),
    ] = None,
    sets: Sets = None,
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="The campaign's folder; default results/ and the name.")
    ] = None,
    jobs: Annotated[int | None, typer.Option(min=1, help="Runs side by side; default one a processor.")] = None,
    engine: Annotated[
        Literal["local", "dask"], typer.Option(help="Processes of this machine, or the workers of a Dask scheduler.")
    ] = "local",
    scheduler: Annotated[
        str | None, typer.Option(metavar="ADDRESS", help="With --engine dask: such as tcp://10.0.0.5:8786.")
    ] = None,
    keep: Annotated[Literal["all", "failed", "none"], typer.Option(help="Which runs' records are kept.")] = "failed",
    pictures: Annotated[
        bool, typer.Option("--pictures", help="Keep the cameras' frames at events in the records, as JPEG.")
    ] = False,
    require: Annotated[
        float | None,
        typer.Option(
            min=0.0, max=1.0, metavar="SHARE", help="Exit 1 if the 95 % interval of success begins below, such as 0.95."
        ),
    ] = None,
    wall_limit: WallLimitSeconds = None,
    renderer: RendererOption = "software",
    quiet: Annotated[bool, typer.Option("--quiet", help="No progress; only the summary.")] = False,
) -> None:
    """Run every case with every seed, and count.

    The same command again goes on where it stopped: a row is kept for each run as it ends. A run is known by all that
    decides it: the scenario with its cell, robots and tree, the seed, the renderer, and the sources and packages that
    run it. After a change the runs are done anew, beside the old ones.

    Without --seeds, and without seeds in a campaign file, each case runs once, with the seed of its scenario (0 if it
    names none).

    \b
    A campaign file:
      scenarios:
        - {scenario: no_obstacle, seeds: "0:50"}
        - {scenario: mine.yaml, set: [gravity=earth], seeds: [3, 7]}

    \b
    Examples:
      regrasp campaign tall_obstacle --seeds 0:100
      regrasp campaign mine.yaml --jobs 2 --require 0.95
      regrasp campaign mine.yaml --engine dask --scheduler tcp://10.0.0.5:8786

    \b
    Exit code: 0 all runs were done, however they came out; 1 less than
    --require, 2 bad input, 130 Ctrl-C, which keeps what is done.
    """
    from regrasp.app.cli.progress import tell_of_compilation

    wrong = []
    if (engine == "dask") != (scheduler is not None):
        right = "name one with --scheduler, such as tcp://127.0.0.1:8786" if engine == "dask" else "write --engine dask"
        wrong.append(Finding("--scheduler", 0, f"{'missing' if engine == 'dask' else 'is for Dask'}; {right}"))
    if engine == "dask" and jobs is not None:
        wrong.append(Finding("--jobs", 0, "the scheduler's workers decide that; leave it out"))
    if wrong:
        raise Findings(wrong)
    chosen = parse_seeds(seeds) if seeds is not None else None
    with late_imports():
        from regrasp.app.campaigns.campaign import Effort, do_all, version_of
        from regrasp.app.campaigns.episodes import KIND, Stored, jobs_of
        from regrasp.app.campaigns.plan import one_seed_each, planned
        from regrasp.app.campaigns.progress import Progress
        from regrasp.app.campaigns.store import Store
        from regrasp.app.run.batch import Settings

    runs = planned(scenario, sets or [], chosen)
    folder = out or RESULTS / folders.folder_name(Path(scenario).stem)
    if found := folders.folder_findings(folder):
        raise Findings(found)
    if not quiet:
        tell_of_compilation()
    if chosen is None and one_seed_each(runs):
        typer.echo("note: one seed each: --seeds 0:100 asks for more", err=True)
    settings = Settings(pictures=pictures, renderer=renderer)
    effort = Effort(wall_limit=math.inf if wall_limit is None else wall_limit)
    where = _engine(scheduler, jobs)
    with Store.create(folder, KIND) as store:
        asked = jobs_of(runs, settings)
        version = version_of(store, asked)
        _tell_of_other_versions(store, version)
        _tell_what_stays(store, version, {job.key for job in asked}, keep, pictures)
        interrupted = do_all(asked, store, where, Stored(runs, keep, effort.wall_limit), Progress(quiet), effort)
        low = _print_cases(store, version, {job.key for job in asked})
    if interrupted:
        raise typer.Exit(EXIT_INTERRUPTED)
    if require is not None and low < require:
        typer.echo(f"the interval begins at {100 * low:.1f} %, below the required {100 * require:.1f} %", err=True)
        raise typer.Exit(EXIT_UNMET)


def _engine(scheduler: str | None, jobs: int | None) -> "Engine":
    if scheduler is None:
        from regrasp.app.campaigns.campaign import Local

        return Local(jobs or os.cpu_count() or 1)
    try:
        from regrasp.app.campaigns.dask_engine import Dask
    except ImportError as error:
        message = f"{error.name} is not installed; pip install -e '.[cluster]' in the project's folder"
        raise Findings([Finding("--engine", 0, message)]) from None
    return Dask.connected(scheduler)


def _tell_of_other_versions(store: "Store", version: int) -> None:
    """Say on stderr that the store holds runs of other sources, packages or scenarios."""
    others = [other for other in store.versions() if other.id != version and other.runs]
    for other in others:
        typer.echo(
            f"note: {other.runs} runs here are of other sources, packages or scenarios, from {other.began}; these are "
            f"done beside them (`regrasp campaign show {shown(store.folder or Path())}@{other.id}` shows those)",
            err=True,
        )


def _tell_what_stays(store: "Store", version: int, keys: set[str], keep: str, pictures: bool) -> None:
    """Say on stderr that runs which are done already get no records, or no pictures, by being asked for again."""
    done = [row for row in store.rows(version) if row.key in keys] if pictures or keep == "all" else []
    missing = done if pictures else [row for row in done if not row.record]
    if not missing:
        return
    wanted, word = ("--pictures", " --pictures") if pictures else ("--keep all", "")
    typer.echo(
        f"note: {wanted} changes nothing in the {len(missing)} that are done already; `regrasp campaign rerun "
        f"{shown(store.folder or Path())} {missing[0].number}{word}` makes a record of one",
        err=True,
    )


def _tell_of_versions_beside(store: "Store", version: int) -> None:
    """Say on stderr that the store holds runs of other sources, packages or scenarios than those shown."""
    for other in store.versions():
        if other.id != version and other.runs:
            typer.echo(
                f"note: {other.runs} more here are of {'newer' if other.id > version else 'older'} sources, packages "
                f"or scenarios, from {other.began}; `regrasp campaign show {shown(store.folder or Path())}@{other.id}` "
                "shows those",
                err=True,
            )


@app.command("show")
def show_campaign(
    folder: Folder,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON instead of a table.")] = False,
    as_csv: Annotated[bool, typer.Option("--csv", help="Print each run's figures as CSV instead.")] = False,
    junit: Annotated[Path | None, typer.Option(metavar="FILE", help="Write JUnit XML, too.")] = None,
) -> None:
    """Show how a campaign's runs came out, by case.

    Of the newest sources, packages and scenarios; DIR@1 shows the first ones'. A campaign that goes on can be shown,
    too.

    \b
    Examples:
      regrasp campaign show results/tall_obstacle
      regrasp campaign show results/tall_obstacle --json | jq .succeeded
    """
    if as_json and as_csv:
        raise Findings([Finding("--csv", 0, "is for CSV, and --json for JSON; leave one of them out")])
    if junit is not None and (found := folders.file_findings(junit)):
        raise Findings(found)
    with _opened(folder) as (store, version):
        if junit is not None:
            _write_junit(junit, store, version)
        if as_json:
            from regrasp.app.campaigns.figures import summary_json

            found_figures = summary_json(lambda: store.rows(version.id), version.program)
            typer.echo(json.dumps(found_figures, indent=2, allow_nan=False))
        elif as_csv:
            typer.echo(_csv(store.rows(version.id)), nl=False)
        else:
            _print_cases(store, version.id)
            _tell_of_versions_beside(store, version.id)


@app.command("failures")
def show_failures(folder: Folder) -> None:
    """Show why runs failed, one of each in full.

    By cause, and by the node of the tree.

    \b
    Example:
      regrasp campaign failures results/tall_obstacle
    """
    from regrasp.app.campaigns.episodes import row_in
    from regrasp.app.campaigns.figures import failure_groups
    from regrasp.app.records.explain import explanation
    from regrasp.app.records.reader import read_record

    with _opened(folder) as (store, version):
        groups = failure_groups(store.rows(version.id))
        assert store.folder is not None
        if not groups:
            typer.echo(f"all {version.runs} runs came out as expected")
        for group in groups:
            where = f" at {printable(group.node)}" if group.node else ""
            typer.echo(f"{len(group.rows)} x {group.reason}{where}")
            for stored in group.rows[:_SHOWN]:
                typer.echo(f"  row {stored.number}  {printable(stored.title)}: {printable(row_in(stored).why)}")
            if more := len(group.rows) - _SHOWN:
                typer.echo(f"  and {more} more" if more > 0 else "", nl=more > 0)
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


@app.command("compare")
def compare_campaigns(
    first: Annotated[str, typer.Argument(metavar="A", help="A campaign's folder, or DIR@1 for its first version.")],
    second: Annotated[str, typer.Argument(metavar="B", help="The other, such as after a change.")],
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> None:
    """Compare two campaigns scene by scene.

    Which got better or worse, and whether that can be chance. A scene is a scenario, its case and a seed; those that
    only one of the two has do not count.

    \b
    Examples:
      regrasp campaign compare results/before results/after
      regrasp campaign compare results/tall@1 results/tall@2
    """
    from dataclasses import asdict

    from regrasp.app.campaigns.figures import COMPARISON_SCHEMA, compare
    from regrasp.app.records.result import plain

    with _opened(first) as (a, version_a), _opened(second) as (b, version_b):
        found = compare(a.rows(version_a.id), b.rows(version_b.id))
    if as_json:
        typer.echo(json.dumps({"schema": COMPARISON_SCHEMA, **plain(asdict(found))}, indent=2, allow_nan=False))
        return
    if not found.scenes:
        raise Findings(
            [Finding(second, 0, f"has no scene of {first}; compare campaigns of the same scenarios and seeds")]
        )
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


@app.command("rerun")
def rerun(
    folder: Folder,
    row: Annotated[int, typer.Argument(metavar="ROW", min=1, help="The run's row, as `failures` names it.")],
    out: Annotated[Path | None, typer.Option(help="The record's folder; default in runs/.")] = None,
    video: Annotated[bool, typer.Option("--video", help="Film the run into the record.")] = False,
    pictures: Annotated[
        bool, typer.Option("--pictures", help="Keep the cameras' frames at events in the record, as JPEG.")
    ] = False,
    quiet: Annotated[bool, typer.Option("--quiet", help="No progress; only the summary.")] = False,
) -> None:
    """Do a run again, with a record of it.

    And with a film if you like. With the same sources and packages the same comes out, byte for byte.

    \b
    Example:
      regrasp campaign rerun results/tall_obstacle 17 --video
    """
    from regrasp.app.campaigns.episodes import again, row_in
    from regrasp.app.cli.progress import shown_progress
    from regrasp.app.cli.run import exit_code
    from regrasp.app.records.summary import run_summary

    with _opened(folder) as (store, _):
        stored = store.row(row)
        if stored is None:
            raise Findings([Finding(folder, 0, f"no row {row}; `regrasp campaign show {folder} --csv` lists them")])
        run, remarks = again(stored, store)
    if found := folders.folder_findings(folders.RUNS) if out is None else folders.run_folder_findings(out):
        raise Findings(found)
    for remark in remarks:
        typer.echo(f"note: {remark}", err=True)
    into = out or folders.new_folder(f"{run.scenario.name}-{run.seed}")
    if "the process died" in row_in(stored).why or "the process was killed" in row_in(stored).why:
        typer.echo(f"note: it killed its process; if it does so again, the record so far is in {shown(into)}", err=True)
    from regrasp.app.run.episode import run_episode

    renderer: Any = row_in(stored).renderer
    with shown_progress(quiet) as observers:
        how = {"video": video, "pictures": pictures, "renderer": renderer, "observers": observers}
        result = run_episode(run.scenario, into, seed=run.seed, **how)
    typer.echo(run_summary(result, into))
    raise typer.Exit(exit_code(result))


_SHOWN = 5  # runs of a group of failures
_WIDTH = 116  # characters of an explanation
_LEVEL = 0.05  # of p


@contextmanager
def _opened(name: str) -> "Iterator[tuple[Store, Version]]":
    """The store in a folder, and the version that the name means: DIR@2, or the last one that did any run."""
    with late_imports():
        from regrasp.app.campaigns.episodes import KIND
        from regrasp.app.campaigns.store import Store

    text, at, number = name.rpartition("@")
    if not at or not number.isdecimal() or Path(name).is_dir():
        text, number = name, ""
    with Store.read(Path(text)) as store:
        if store.kind != KIND:
            raise Findings([Finding(text, 0, f"holds {store.kind}; name the folder of a campaign of scenarios")])
        with_runs = [version for version in store.versions() if version.runs]
        if not with_runs:
            raise Findings([Finding(text, 0, "holds no run yet; wait for the first")])
        chosen = [version for version in with_runs if str(version.id) == number] if number else with_runs[-1:]
        if not chosen:
            known = ", ".join(f"@{version.id}" for version in with_runs)
            raise Findings([Finding(name, 0, f"no version {number} with runs; there is {known}")])
        yield store, chosen[0]


def _print_cases(store: "Store", version: int, keys: set[str] | None = None) -> float:
    """Print the table by case of all rows, or of those with these keys. Returns where the interval of all begins."""
    from regrasp.app.campaigns.figures import by_case
    from regrasp.app.campaigns.table import print_table

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


_HEADER = ("case", "as expected", "95 % interval", "simulated s, 5 %", "50 %", "95 %", "wall s, 50 %")


def _csv(rows: "Iterable[StoredRow]") -> str:
    from dataclasses import fields

    from regrasp.app.campaigns.episodes import row_in
    from regrasp.app.run.batch import Row

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


def _write_junit(path: Path, store: "Store", version: "Version") -> None:
    from regrasp.app.campaigns.episodes import row_in
    from regrasp.app.run.junit import JunitCase, write_junit

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
