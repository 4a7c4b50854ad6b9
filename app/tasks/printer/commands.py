"""The printer task's study in `regrasp study`."""

import os
from pathlib import Path
from typing import Annotated

import typer

from regrasp.app.cli.options import parse_seeds
from regrasp.app.files.findings import Findings
from regrasp.app.interrupts import late_imports
from regrasp.app.records import folders


def add_commands(app: typer.Typer, study: typer.Typer) -> None:
    """Add the study to `regrasp study`."""
    study.command(reach.__name__)(reach)


def reach(
    seeds: Annotated[str, typer.Option(metavar="A:B", help="Seeds from A up to, not including, B.")],
    jobs: Annotated[int, typer.Option(min=1, help="Seeds side by side.")] = os.cpu_count() or 1,
    out: Annotated[
        Path | None,
        typer.Option(
            help="Folder of reach.json. Seeds are kept there as they end: the same command again goes on there."
        ),
    ] = None,
) -> None:
    """Plan the habitat's whole job over many draws of the errors.

    From the door's handle over the source's eight starts, the part, the clamp and the tray to sleep. It counts the
    places that the arm reaches and times the planner: about a second a seed.

    \b
    Example:
      regrasp study reach --seeds 0:200 --out results/reach
    """
    chosen = parse_seeds(seeds)
    if out is not None and (wrong := folders.folder_findings(out)):
        raise Findings(wrong)
    with late_imports():
        from regrasp.app.tasks.printer.studies.reach import run_reach

    raise typer.Exit(run_reach(chosen, jobs, out))
