"""The command line: `regrasp`."""

import errno
import os
import sys
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from typer.core import TyperGroup

from app import (
    calibrate_commands,
    detector_commands,
    output,
    perceive_commands,
    record_commands,
    scenario_commands,
    study_commands,
    tree_commands,
)
from app.findings import Finding, Findings, printable
from app.options import MOST_SEED, Sets
from app.progress import late_imports, shown_progress
from app.run_every import run_every
from app.scenario_file import load_scenario
from app.summary import summary
from interfaces.quote import MOST, cut

if TYPE_CHECKING:
    from app.record import Result

EXIT_UNMET, EXIT_BAD_INPUT, EXIT_INTERRUPTED = 1, 2, 130


class _Group(TyperGroup):
    """Tells findings one a line on stderr, and Ctrl-C by its exit code, whatever the command."""

    def invoke(self, ctx: Any) -> Any:
        try:
            return super().invoke(ctx)
        except Findings as error:
            for finding in error.items:
                typer.echo(str(finding), err=True)
            raise typer.Exit(EXIT_BAD_INPUT) from None
        except typer.BadParameter as error:  # quotes all that was typed
            error.message = cut(error.message, 3 * MOST)
            raise
        except OSError as error:  # a disk that is full, a name that is too long
            if error.errno == errno.EPIPE:
                raise  # typer's: the reader of a pipe has gone
            where = str(error.filename or "output")
            typer.echo(printable(f"{where[:200]}: {error.strerror}; write somewhere else"), err=True)
            raise typer.Exit(EXIT_BAD_INPUT) from None
        except KeyboardInterrupt:
            typer.echo("interrupted", err=True)
            raise typer.Exit(EXIT_INTERRUPTED) from None


# Plain help: the same on a terminal and in a pipe.
app = typer.Typer(
    cls=_Group, no_args_is_help=True, add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False
)
app.add_typer(tree_commands.app, name="trees")
app.add_typer(scenario_commands.app, name="scenarios")
app.add_typer(study_commands.app, name="study")
record_commands.add_to(app)
calibrate_commands.add_to(app)
detector_commands.add_to(app)
perceive_commands.add_to(app)


def _version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"regrasp {version('regrasp')}")
        raise typer.Exit


@app.callback()
def _root(
    wanted: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Show the version.")
    ] = False,
) -> None:
    """Two simulated arms unplug a cable, lose its end, and get it back with cameras alone.

    \b
      regrasp doctor                           is this machine ready?
      regrasp scenarios list                   what is there to run?
      regrasp run short_obstacle --video       run one, and film it
      regrasp explain DIR                      why did it end so?
    """


@app.command()
def run(
    scenario: Annotated[str, typer.Argument(help="A shipped scenario's name, or a path to a .yaml file.")],
    case: Annotated[
        str | None, typer.Option(metavar="NAME", help="The case to run; default that of the first values.")
    ] = None,
    every: Annotated[bool, typer.Option("--all", help="Run every case, each in a process of its own.")] = False,
    jobs: Annotated[
        int | None, typer.Option(min=1, help="With --all: cases side by side; default one a processor.")
    ] = None,
    seed: Annotated[
        int | None,
        typer.Option(min=0, max=MOST_SEED, help="Draws every error, noise and jitter; default the scenario's."),
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="The record's folder, with --all that of all records; default in runs/.")
    ] = None,
    junit: Annotated[Path | None, typer.Option(metavar="FILE", help="With --all: write JUnit XML, too.")] = None,
    video: Annotated[bool, typer.Option("--video", help="Film the run into the record.")] = False,
    sets: Sets = None,
    gui: Annotated[bool, typer.Option("--gui", help="Show PyBullet's window.")] = False,
    quiet: Annotated[bool, typer.Option("--quiet", help="No progress; only the summary.")] = False,
) -> None:
    """Run a scenario and leave a record of it.

    \b
    Examples:
      regrasp run short_obstacle --video
      regrasp run tall_obstacle --seed 7 --case gravity=earth --out runs/tall-7
      regrasp run my/scenario.yaml --set obstacles.0.size=[0.08,0.12,0.3] --set cell.hidden.errors.arm_tool=0
      regrasp run short_obstacle --all --set 'vary.seed="0:5"' --jobs 2 --junit short.xml

    \b
    Exit code: 0 all that the scenario expects came out, 1 something did not, 2 bad input, 130 Ctrl-C.
    """
    overrides = [*(sets or []), *([] if seed is None else [f"seed={seed}"])]
    wrong: list[Finding] = [] if not gui or _display() else [_NO_DISPLAY]
    if every:
        wrong += _given("is for a single case; leave --all out", case=case, gui=gui)
        raise typer.Exit(run_every(scenario, overrides, jobs or os.cpu_count() or 1, out, junit, video, quiet, wrong))
    wrong += _given("is for many cases; write --all, too", jobs=jobs, junit=junit)
    if out is not None:
        wrong += output.findings(out)
    try:
        loaded = load_scenario(scenario, overrides, case)
    except Findings as error:
        raise Findings([*wrong, *error.items]) from None
    folder = out or output.free_folder(loaded.name, loaded.file.seed)
    wrong += [] if out else output.findings(folder)
    if wrong:
        raise Findings(wrong)
    with late_imports():
        from app.episode import run_episode  # brings the planner, the compiler and the physics: seconds

    with shown_progress(quiet) as progress:
        result = run_episode(loaded, folder, seed=loaded.file.seed, video=video, gui=gui, progress=progress)
    typer.echo(summary(result, folder))
    raise typer.Exit(exit_code(result))


def _given(message: str, **options: object) -> list[Finding]:
    """A finding for each of these options that is given."""
    return [Finding(f"--{name}", 0, message) for name, value in options.items() if value]


_NO_DISPLAY = Finding(
    "--gui", 0, "there is no display here (DISPLAY is not set); run without it, and film with --video"
)


def _display() -> bool:
    return sys.platform != "linux" or bool(os.environ.get("DISPLAY"))


def exit_code(result: "Result") -> int:
    """0 when all that was expected came out, 130 after Ctrl-C, else 1."""
    if result.outcome == "interrupted":
        return EXIT_INTERRUPTED
    return 0 if result.succeeded else EXIT_UNMET


@app.command()
def doctor() -> None:
    """Say what a run needs from this machine, and whether it is there. Exit code 1 when something is missing."""
    from app.doctor import checks

    wrong = False
    for check in checks():
        typer.echo(f"{check.status:<6}{check.name:<24}{check.seen}")
        wrong |= check.status == "wrong"
    raise typer.Exit(1 if wrong else 0)
