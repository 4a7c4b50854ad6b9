"""`regrasp campaign`: many runs that are kept, counted and compared."""

import json
import math
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer
from typer.core import TyperGroup

from regrasp.app.cli.options import EXIT_UNMET, RendererOption, Sets, WallLimitSeconds, parse_seeds
from regrasp.app.files.findings import Finding, Findings, shown
from regrasp.app.interrupts import EXIT_INTERRUPTED, late_imports
from regrasp.app.records import folders

if TYPE_CHECKING:
    from regrasp.app.campaigns.campaign import Engine
    from regrasp.app.campaigns.store import Store, Version

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
        bool,
        typer.Option("--pictures", help="Keep the cameras' frames at events and every 2 s in the records, as JPEG."),
    ] = False,
    report: Annotated[
        bool, typer.Option("--report", help="Write a page that shows the campaign into its folder: report.html.")
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
        from regrasp.app.cli.campaign_output import print_cases
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
        low = print_cases(store, version, {job.key for job in asked})
    if interrupted:
        raise typer.Exit(EXIT_INTERRUPTED)
    if report:
        from regrasp.app.report.written import write_campaign_report

        typer.echo(f"report: {write_campaign_report(f'{folder}@{version}', folder)}")
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
    with late_imports():
        from regrasp.app.cli.campaign_output import csv_text, print_cases, write_rows_junit
    if junit is not None and (found := folders.file_findings(junit)):
        raise Findings(found)
    with _opened(folder) as (store, version):
        if junit is not None:
            write_rows_junit(junit, store, version)
        if as_json:
            from regrasp.app.campaigns.figures import summary_json

            found_figures = summary_json(lambda: store.rows(version.id), version.program)
            typer.echo(json.dumps(found_figures, indent=2, allow_nan=False))
        elif as_csv:
            typer.echo(csv_text(store.rows(version.id)), nl=False)
        else:
            print_cases(store, version.id)
            _tell_of_versions_beside(store, version.id)


@app.command("failures")
def show_failures(folder: Folder) -> None:
    """Show why runs failed, one of each in full.

    By cause, and by the node of the tree.

    \b
    Example:
      regrasp campaign failures results/tall_obstacle
    """
    from regrasp.app.cli.campaign_output import print_failures

    with _opened(folder) as (store, version):
        print_failures(store, version)


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
    from regrasp.app.cli.campaign_output import print_comparison
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
    print_comparison(found)


@app.command("rerun")
def rerun(
    folder: Folder,
    row: Annotated[int, typer.Argument(metavar="ROW", min=1, help="The run's row, as `failures` names it.")],
    out: Annotated[Path | None, typer.Option(help="The record's folder; default in runs/.")] = None,
    video: Annotated[bool, typer.Option("--video", help="Film the run into the record.")] = False,
    pictures: Annotated[
        bool,
        typer.Option("--pictures", help="Keep the cameras' frames at events and every 2 s in the record, as JPEG."),
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
    if row_in(stored).outcome == "internal_error" and not row_in(stored).wall_seconds:  # it told nothing any more
        typer.echo(f"note: it killed its process; if it does so again, the record so far is in {shown(into)}", err=True)
    from regrasp.app.run.episode import run_episode

    renderer: Any = row_in(stored).renderer
    with shown_progress(quiet) as observers:
        how = {"video": video, "pictures": pictures, "renderer": renderer, "observers": observers}
        result = run_episode(run.scenario, into, seed=run.seed, **how)
    typer.echo(run_summary(result, into))
    raise typer.Exit(exit_code(result))


@contextmanager
def _opened(name: str) -> "Iterator[tuple[Store, Version]]":
    """As `regrasp.app.campaigns.opened.opened`, which is imported late."""
    with late_imports():
        from regrasp.app.campaigns.opened import opened

    with opened(name) as found:
        yield found
