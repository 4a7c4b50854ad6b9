"""Options that several commands take, and how commands exit."""

from collections.abc import Iterator
from typing import Annotated, Literal

import typer

from regrasp.app.files.findings import Finding, Findings
from regrasp.interfaces.seed import MAX_SEED, seed_range

EXIT_UNMET = 1  # something did not come out as expected, or is not as it should be
EXIT_BAD_INPUT = 2


def _scenarios(incomplete: str) -> Iterator[str]:
    """Scenario names for the shell's completion; the shell completes paths by itself."""
    from regrasp.app.files.resources import shipped

    return (name for name in shipped("scenario") if name.startswith(incomplete))


ScenarioName = Annotated[
    str,
    typer.Argument(help="A shipped scenario's name, or a path to a .yaml file.", autocompletion=_scenarios),
]
Seed = Annotated[
    int | None, typer.Option(min=0, max=MAX_SEED, help="Draws every error, noise and jitter; default the scenario's.")
]
RendererOption = Annotated[
    Literal["software", "moderngl"],
    typer.Option(help="What draws the cameras' pictures: compiled loops, or OpenGL, for a graphics card."),
]
WallLimitSeconds = Annotated[
    float | None,
    typer.Option(min=1.0, metavar="SECONDS", help="Stop a run that takes longer, by the clock on the wall."),
]
LogLevel = Annotated[
    Literal["debug", "info", "warning", "error"] | None,
    typer.Option(help="Show the run's events from this level on, as events.jsonl has them all."),
]
Sets = Annotated[
    list[str] | None,
    typer.Option(
        "--set", metavar="KEY=VALUE", help="Change a value of the scenario, or with cell. of its cell; repeat."
    ),
]


def parse_seeds(text: str) -> range:
    """The seeds of "A:B", without B. Raises `Findings` for anything else."""
    try:
        return seed_range(text)
    except ValueError as error:
        raise Findings([Finding("--seeds", 0, str(error))]) from None
