"""`regrasp run`."""

import math
import os
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

import regrasp
from regrasp.app.cli.options import EXIT_UNMET, LogLevel, RendererOption, ScenarioName, Seed, Sets, WallLimitSeconds
from regrasp.app.files.findings import Finding, Findings, shown
from regrasp.app.interrupts import EXIT_INTERRUPTED
from regrasp.app.records import folders
from regrasp.interfaces.quote import printable

if TYPE_CHECKING:
    from regrasp.app.records.result import Result
    from regrasp.app.run.batch import Run, Settings
    from regrasp.app.scenario.load import Scenario


def add_to(app: typer.Typer) -> None:
    """Add the command to `app`."""
    app.command("run")(run_scenario)


def run_scenario(
    scenario: ScenarioName,
    case: Annotated[
        str | None, typer.Option(metavar="NAME", help="The case to run; default that of the first values.")
    ] = None,
    every: Annotated[bool, typer.Option("--all", help="Run every case, each in a process of its own.")] = False,
    jobs: Annotated[
        int | None, typer.Option(min=1, help="With --all: cases side by side; default one a processor.")
    ] = None,
    seed: Seed = None,
    sets: Sets = None,
    out: Annotated[
        Path | None, typer.Option(help="The record's folder, with --all that of all records; default in runs/.")
    ] = None,
    junit: Annotated[Path | None, typer.Option(metavar="FILE", help="With --all: write JUnit XML, too.")] = None,
    video: Annotated[bool, typer.Option("--video", help="Film the run into the record.")] = False,
    pictures: Annotated[
        bool,
        typer.Option("--pictures", help="Keep the cameras' frames at events and every 2 s in the record, as JPEG."),
    ] = False,
    report: Annotated[
        bool, typer.Option("--report", help="Write a page that shows the run into its record: report.html.")
    ] = False,
    renderer: RendererOption = "software",
    wall_limit: WallLimitSeconds = None,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Check everything, say what would run, and run nothing.")
    ] = False,
    gui: Annotated[bool, typer.Option("--gui", help="Show PyBullet's window.")] = False,
    log_level: LogLevel = None,
    quiet: Annotated[bool, typer.Option("--quiet", help="No progress; only the summary.")] = False,
) -> None:
    """Run a scenario and leave a record of it.

    \b
    Examples:
      regrasp run short_obstacle --video
      regrasp run tall_obstacle --seed 7 --case gravity=earth --out runs/tall-7
      regrasp run mine.yaml --set obstacles.0.size=[0.08,0.12,0.3] --dry-run
      regrasp run mine.yaml --all --set 'vary.seed="0:5"' --junit mine.xml

    \b
    Exit code: 0 every expectation met, 1 not, 2 bad input, 130 Ctrl-C.
    """
    from regrasp.app.cli.progress import tell_of_compilation
    from regrasp.app.cli.run_every import run_every
    from regrasp.app.records.summary import run_summary
    from regrasp.app.run.batch import Run, Settings

    if not quiet:
        tell_of_compilation()
    overrides = [*(sets or []), *([] if seed is None else [f"seed={seed}"])]
    twice = seed is not None and any(text.partition("=")[0].strip() == "seed" for text in sets or [])
    wrong = [Finding("--seed", 0, "the seed is given by --set, too; leave one out")] if twice else []
    wrong += [] if not gui or regrasp.has_display() else [_NO_DISPLAY]
    if every:
        wrong += _given("is for a single case; leave --all out", case=case, gui=gui, log_level=log_level)
        if dry_run:
            wrong += folders.file_findings(junit) if junit else []
            _tell(_checked(partial(regrasp.load_cases, scenario, overrides), wrong, out), out)
            return
        settings = Settings(video, pictures, renderer, quiet, wall_limit or math.inf, report)
        raise typer.Exit(run_every(scenario, overrides, jobs or os.cpu_count() or 1, out, junit, settings, wrong))
    wrong += _given("is for many cases; write --all, too", jobs=jobs, junit=junit)
    [loaded] = _checked(lambda: [regrasp.load_scenario(scenario, overrides, case)], wrong, out)
    if dry_run:
        _tell([loaded], out)
        return
    folder = out or folders.new_folder(f"{loaded.name}-{loaded.file.seed}")
    settings = Settings(video, pictures, renderer, quiet, wall_limit or math.inf)
    here = partial(_run, loaded, folder, settings, gui, log_level)
    try:
        result = here() if wall_limit is None else _watched(Run(loaded, loaded.file.seed, folder), here, wall_limit)
    finally:
        if out is None:
            folders.leave_if_empty(folder)
    if wall_limit is not None and result.cause and not folder.exists():  # the run was stopped before it began
        typer.echo(f"{result.cause.code}: {result.cause.message}, before the run began; there is no record", err=True)
        raise typer.Exit(EXIT_UNMET)
    typer.echo(run_summary(result, folder))
    if report:
        tell_report(folder)
    raise typer.Exit(exit_code(result))


def _checked(load: "Callable[[], list[Scenario]]", wrong: list[Finding], out: Path | None) -> "list[Scenario]":
    """The scenarios. Raises `Findings` of all that is wrong with them and with the options."""
    wrong += folders.folder_findings(folders.RUNS) if out is None else folders.run_folder_findings(out)
    try:
        loaded = load()
    except Findings as error:
        raise Findings([*wrong, *error.items]) from None
    if wrong:
        raise Findings(wrong)
    return loaded


def _run(scenario: "Scenario", folder: Path, settings: "Settings", gui: bool, log_level: LogLevel) -> "Result":
    """Run in this process, with progress on stderr."""
    from regrasp.app.cli.progress import shown_progress

    with shown_progress(settings.quiet, log_level) as observers:
        try:
            return regrasp.run(
                scenario,
                out=folder,
                video=settings.video,
                pictures=settings.pictures,
                gui=gui,
                renderer=settings.renderer,
                on_tick=observers.tick,
                on_event=observers.event,
            )
        except regrasp.Interrupted as stopped:
            return stopped.result


def _watched(run: "Run", task: Callable[[], "Result"], wall_limit: float) -> "Result":
    """Do the run in a process of its own, which is stopped after `wall_limit` seconds."""
    from regrasp.app.run.batch import result_of
    from regrasp.app.run.processes import run_each

    assert run.folder is not None
    try:
        [done] = run_each([task], 1, wall_limit)
    except KeyboardInterrupt:
        if (kept := regrasp.read_record(run.folder).result) is None:
            raise
        return kept
    return result_of(run, done)


def _tell(loaded: "list[Scenario]", out: Path | None) -> None:
    """Print what a dry run found."""
    first = loaded[0]
    typer.echo(f"{shown(first.path)}: nothing wrong; tree {shown(first.tree)}, cell {first.file.cell}")
    for scenario in loaded:
        typer.echo(f"  would run {printable(scenario.title)}, seed {scenario.file.seed}")
    typer.echo(f"  record{'s' if len(loaded) > 1 else ''} in {out or 'a new folder of runs/'}")


def _given(message: str, **options: object) -> list[Finding]:
    """A finding with this message for each of these options that was given."""
    return [Finding(f"--{name.replace('_', '-')}", 0, message) for name, value in options.items() if value]


_NO_DISPLAY = Finding(
    "--gui", 0, "there is no display here (DISPLAY is not set); run without it, and film with --video"
)


def tell_report(folder: Path) -> None:
    """Write the report of a run into its record, and say where; what is in its way goes to stderr."""
    from regrasp.app.report.written import write_run_report

    try:
        made = write_run_report(folder)
    except Findings as error:
        typer.echo(f"no report: {error}", err=True)
        return
    typer.echo(f"  report  {made}")
    for finding in made.found:
        typer.echo(str(finding), err=True)


def exit_code(result: "Result") -> int:
    """0 if all expectations were met, 130 after Ctrl-C, else 1."""
    if result.outcome == "interrupted":
        return EXIT_INTERRUPTED
    return 0 if result.succeeded else EXIT_UNMET
