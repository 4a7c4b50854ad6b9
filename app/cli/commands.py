"""The command line `regrasp`: its commands, and how errors end them."""

import errno
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from regrasp.app.cli import calibrate, detector, migrate, perceive, records, run, scenarios, studies, trees
from regrasp.app.cli.options import EXIT_BAD_INPUT, EXIT_UNMET
from regrasp.app.files.findings import Findings
from regrasp.app.interrupts import EXIT_INTERRUPTED
from regrasp.interfaces.quote import MAX_QUOTE, cut, printable

COMMANDS = (  # in the order in which a newcomer uses them
    "run",
    "explain",
    "replay",
    "diff",
    "scenarios",
    "migrate",
    "trees",
    "study",
    "doctor",
    "snapshot",
    "perceive",
    "calibrate",
    "evaluate-detector",
    "train-detector",
)


class _Group(TyperGroup):
    """Prints the findings of any command on stderr, one per line, and sets the exit code, also after Ctrl-C."""

    def list_commands(self, ctx: Any) -> list[str]:
        return sorted(super().list_commands(ctx), key=COMMANDS.index)

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
app.add_typer(scenarios.app, name="scenarios")
app.add_typer(trees.app, name="trees")
app.add_typer(studies.app, name="study")
perceive.add_to(app)
calibrate.add_to(app)
migrate.add_to(app)
detector.add_to(app)


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
    """Two simulated arms unplug a cable, lose its end, and get it back with cameras alone.

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
