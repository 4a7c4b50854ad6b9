"""The printer task's commands."""

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Literal, get_args

import typer

from regrasp.app.cli.options import parse_seeds
from regrasp.app.files.findings import Finding, Findings
from regrasp.app.interrupts import late_imports
from regrasp.app.records import folders
from regrasp.app.tasks.printer.detector_commands import evaluate_part_detector, train_part_detector
from regrasp.interfaces.quote import nearest, quoted

Block = Literal["A", "A0", "B", "C"]


def add_commands(app: typer.Typer, study: typer.Typer) -> None:
    """Add the studies to `regrasp study`, and the commands about the approach and the detector."""
    study.command(reach.__name__)(reach)
    study.command(approach.__name__)(approach)
    app.command("calibrate-approach")(calibrate_approach)
    for command in (train_part_detector, evaluate_part_detector):
        app.command()(command)


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


def approach(
    seeds: Annotated[str, typer.Option(metavar="A:B", help="Seeds from A up to, not including, B.")],
    blocks: Annotated[
        str,
        typer.Option(
            help="A: the source's eight starts; A0: A without errors; B: drawn part and start; C: part drifts."
        ),
    ] = "A,B,C",
    approaches: Annotated[
        str, typer.Option(help="Which of one_step, two_step, three_step and servo.")
    ] = "one_step,two_step,three_step,servo",
    jobs: Annotated[int, typer.Option(min=1, help="Trials side by side.")] = os.cpu_count() or 1,
    out: Annotated[
        Path | None,
        typer.Option(help="Folder of approach.json, approach.csv and plots. The same command again goes on there."),
    ] = None,
) -> None:
    """Measure how near each approach brings the hand to the part.

    And whether the hand then takes it.

    As the source's Table 4-5: the errors of the tool from its goal, in the Y-Z plane, along X and in all three. In C
    only the servo is tried. A trial takes about 5 seconds: a seed 41 trials, with A0 73.

    \b
    Examples:
      regrasp study approach --seeds 0:2 --blocks A --out results/approach
      regrasp study approach --seeds 0:20 --approaches servo --out results/servo
    """
    from regrasp.interfaces.printer.actions import Approach  # late: --help needs no numpy

    chosen = parse_seeds(seeds)
    wrong = [] if out is None else list(folders.folder_findings(out))
    picked = [_names("--blocks", blocks, get_args(Block)), _names("--approaches", approaches, get_args(Approach))]
    for names in picked:
        wrong += [name for name in names if isinstance(name, Finding)]
    if wrong:
        raise Findings(wrong)
    with late_imports():
        from regrasp.app.tasks.printer.studies.approach import run_approach

    raise typer.Exit(run_approach(chosen, jobs, out, *picked))  # type: ignore[arg-type]  # checked above


def calibrate_approach(
    out: Annotated[Path, typer.Option("-o", "--out", metavar="FILE", help="The tables, a new JSON file.")],
    cell: Annotated[str, typer.Option(help="The cell with the printer, its door open.")] = "habitat_open",
) -> None:
    """Make the tables of the source's approaches.

    From rendered pictures of the printed part.

    From a hand that is aligned with the part, 0.15 to 0.55 m before its goal: the area of the part's box, and the
    metres that a pixel shows.

    \b
    Example:
      regrasp calibrate-approach -o approach_tables.json
    """
    if wrong := folders.file_findings(out, new=True):
        raise Findings(wrong)
    with late_imports():
        from regrasp.app.tasks.printer.cells import printer_cell
        from regrasp.app.tasks.printer.studies.approach_calibration import calibrated, write_tables
        from regrasp.interfaces.request import RequestError
    read = printer_cell(cell)
    try:
        tables = calibrated(read)
    except (ValueError, RequestError) as error:
        raise Findings([Finding("--cell", 0, f"{error}; is the door of {quoted(cell)} open?")]) from None
    write_tables(tables, out)


def _names(option: str, text: str, known: Sequence[str]) -> list[str | Finding]:
    """The names in a list with commas; a Finding for each that is not known."""
    given = [name.strip() for name in text.split(",")]
    return [
        name if name in known else Finding(option, 0, f"no {quoted(name)}; {nearest(name, known)}")
        for name in dict.fromkeys(given)
    ]
