"""The command line `regrasp`: its commands, and how errors end them."""

import errno
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from regrasp.app.cli import (
    calibrate,
    campaign,
    migrate,
    perceive,
    plan,
    records,
    report,
    robots,
    run,
    scenarios,
    snapshot,
    trees,
)
from regrasp.app.cli.options import EXIT_BAD_INPUT, EXIT_UNMET
from regrasp.app.files.findings import Findings
from regrasp.app.interrupts import EXIT_INTERRUPTED
from regrasp.app.task.find import tasks
from regrasp.interfaces.quote import MAX_QUOTE, cut, printable

COMMANDS = (  # in the order in which a newcomer uses them; those that only a task has come last
    "run",
    "explain",
    "replay",
    "diff",
    "report",
    "campaign",
    "scenarios",
    "migrate",
    "trees",
    "plan",
    "robots",
    "study",
    "doctor",
    "perceive",
    "snapshot",
    "calibrate",
)


class _Group(TyperGroup):
    """Prints the findings of any command on stderr, one per line, and sets the exit code, also after Ctrl-C."""

    def list_commands(self, ctx: Any) -> list[str]:
        return sorted(super().list_commands(ctx), key=(*COMMANDS, *self.commands).index)

    def invoke(self, ctx: Any) -> Any:
        try:
            return super().invoke(ctx)
        except Findings as error:
            for finding in error.items:
                typer.echo(str(finding), err=True)
            raise typer.Exit(EXIT_BAD_INPUT) from None
        except typer.BadParameter as error:  # it quotes all that was typed
            error.message = cut(error.message.removeprefix("Value error, "), 3 * MAX_QUOTE)
            raise
        except OSError as error:  # a disk that is full, a name that is too long
            if error.errno == errno.EPIPE:
                raise  # the reader of a pipe has gone: Typer handles this
            where = str(error.filename or "output")
            typer.echo(printable(f"{where[:200]}: {error.strerror}; write somewhere else"), err=True)
            raise typer.Exit(EXIT_BAD_INPUT) from None
        except KeyboardInterrupt:
            typer.echo("interrupted", err=True)
            raise typer.Exit(EXIT_INTERRUPTED) from None


# Plain help: the same on a terminal and in a pipe.
app = typer.Typer(cls=_Group, no_args_is_help=True, rich_markup_mode=None, pretty_exceptions_enable=False)
run.add_to(app)
records.add_to(app)
report.add_to(app)
app.add_typer(campaign.app, name="campaign")
app.add_typer(scenarios.app, name="scenarios")
app.add_typer(trees.app, name="trees")
plan.add_to(app)
app.add_typer(robots.app, name="robots")
study = typer.Typer(no_args_is_help=True, rich_markup_mode=None, help="Run many episodes or scenes, and count.")
app.add_typer(study, name="study")
calibrate.add_to(app)
perceive.add_to(app)
snapshot.add_to(app)
migrate.add_to(app)
for task in tasks():
    try:
        if task.commands is not None:
            task.commands()(app, study)
    except Exception as error:  # another package's code: the other commands go on
        typer.echo(f"warning: the task {task.name} adds no commands: {printable(str(error))}", err=True)


def _version(wanted: bool) -> None:
    if wanted:
        from importlib.metadata import version

        typer.echo(f"regrasp {version('regrasp')}")
        raise typer.Exit


@app.callback()
def _root(
    wanted: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Show the version.")
    ] = False,
) -> None:
    """Robots in a simulated cell do a task by a behaviour tree, with what goes wrong on the way.

    \b
      regrasp doctor                           is this machine ready?
      regrasp scenarios list                   what is there to run?
      regrasp run short_obstacle --video       run one, and film it
      regrasp explain DIR                      why did it end so?
    """


@app.command()
def doctor() -> None:
    """Check that this machine has what a run needs.

    Exit code 1 when something is missing.
    """
    from regrasp.app.cli.doctor import checks

    wrong = False
    for check in checks():
        typer.echo(f"{check.status:<6}{check.name:<24}{check.seen}")
        wrong |= check.status == "wrong"
    raise typer.Exit(EXIT_UNMET if wrong else 0)
