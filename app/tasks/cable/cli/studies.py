"""The cable task's studies in `regrasp study`."""

import math
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from regrasp.app.cli.options import RendererOption, Sets, WallLimitSeconds, parse_seeds
from regrasp.app.files.findings import Finding, Findings
from regrasp.app.interrupts import late_imports
from regrasp.app.records import folders
from regrasp.interfaces.quote import nearest, quoted

_KEPT = "are kept there as they end: the same command again goes on there."


def add_to(study: typer.Typer) -> None:
    """Add the studies to `regrasp study`."""
    for command in (demo, pose, coverage, contact, motion):
        study.command(command.__name__)(command)


def demo(
    seeds: Annotated[str, typer.Option(metavar="A:B", help="Seeds from A up to, not including, B.")],
    jobs: Annotated[int, typer.Option(min=1, help="Episodes side by side.")] = os.cpu_count() or 1,
    out: Annotated[
        Path | None,
        typer.Option(help=f"Folder of demo.json and the runs' records. Runs {_KEPT}"),
    ] = None,
    sets: Sets = None,
    renderer: RendererOption = "software",
    wall_limit: WallLimitSeconds = None,
) -> None:
    """Run the whole demonstration over many seeds.

    No, short and tall obstacle, each without and with gravity: six runs a seed, about a minute each.

    \b
    Example:
      regrasp study demo --seeds 0:20 --jobs 2 --out results/demo
    """
    chosen = parse_seeds(seeds)
    if out is not None and (wrong := folders.folder_findings(out)):
        raise Findings(wrong)
    with late_imports():
        from regrasp.app.run.batch import Settings
        from regrasp.app.tasks.cable.studies.demo import run_demo

    settings = Settings(renderer=renderer, wall_limit=math.inf if wall_limit is None else wall_limit)
    raise typer.Exit(run_demo(chosen, jobs, out, sets or [], settings))


Techniques = Annotated[str | None, typer.Option(metavar="A,B", help="Techniques to try; default all.")]
CellName = Annotated[
    str | None,
    typer.Option("--cell", help="A cell's name, or a .yaml file; for fiducial thesis_tags, else thesis."),
]


def pose(
    seeds: Annotated[str, typer.Option(metavar="A:B", help="Trials: seeds from A up to, not including, B.")] = "0:3",
    techniques: Techniques = None,
    configurations: Annotated[
        str | None, typer.Option(metavar="A,B", help="Configurations to try; default all.")
    ] = None,
    no_grasp: Annotated[bool, typer.Option("--no-grasp", help="Only look: less than half the time.")] = False,
    both_cameras: Annotated[
        bool, typer.Option("--both-cameras", help="A second row each: the wrist camera looks, too.")
    ] = False,
    cell: CellName = None,
    renderer: RendererOption = "software",
    jobs: Annotated[int, typer.Option(min=1, help="Scenes side by side.")] = os.cpu_count() or 1,
    out: Annotated[
        Path | None, typer.Option(help=f"Folder of pose.json, pose.csv and the plots. Scenes {_KEPT}")
    ] = None,
) -> None:
    """Repeat the thesis's pose experiment.

    The connector in nine configurations: found, measured against the truth, and grasped.

    \b
    Examples:
      regrasp study pose --seeds 0:3 --out results/pose
      regrasp study pose --techniques rgbd --configurations 3,6,7,8,9 --no-grasp

    \b
    The configurations, and how a trial goes: POSE.md in
    app/tasks/cable/studies/pose/.
    Exit code: 0 done, 1 a scene broke off, 2 bad input, 130 Ctrl-C.
    """
    chosen, wrong = parse_seeds(seeds), folders.folder_findings(out) if out is not None else []
    names = _techniques(techniques, wrong)
    with late_imports():
        from regrasp.app.tasks.cable.studies.pose.scenes import CONFIGURATIONS

    shown_ones = _listed("--configurations", configurations, tuple(CONFIGURATIONS), wrong)
    if wrong:
        raise Findings(wrong)
    with late_imports():
        from regrasp.app.tasks.cable.studies.pose.study import run_pose
        from regrasp.app.tasks.cable.studies.pose.trial import setups_of

    setups = setups_of(names, cell, grasps=not no_grasp, renderer=renderer)
    raise typer.Exit(run_pose(setups, chosen, jobs, out, shown_ones, both_cameras))


def coverage(
    seeds: Annotated[str, typer.Option(metavar="A:B", help="Scenes: seeds from A up to, not including, B.")] = "0:200",
    techniques: Techniques = None,
    cell: CellName = None,
    renderer: RendererOption = "software",
    jobs: Annotated[int, typer.Option(min=1, help="Scenes side by side.")] = os.cpu_count() or 1,
    out: Annotated[Path | None, typer.Option(help=f"Folder of coverage.json. Scenes {_KEPT}")] = None,
) -> None:
    """Check that estimates are as sure as they say.

    How often the truth lies in an estimate's 95 % region, by its covariance; ten frames a seed.

    \b
    Example:
      regrasp study coverage --seeds 0:200 --techniques rgbd
    """
    chosen, wrong = parse_seeds(seeds), folders.folder_findings(out) if out is not None else []
    names = _techniques(techniques, wrong)
    if wrong:
        raise Findings(wrong)
    with late_imports():
        from regrasp.app.tasks.cable.studies.pose.coverage import run_coverage
        from regrasp.app.tasks.cable.studies.pose.trial import setups_of

    raise typer.Exit(run_coverage(setups_of(names, cell, renderer=renderer), chosen, jobs, out))


def contact(
    seeds: Annotated[str, typer.Option(metavar="A:B", help="Trials: seeds from A up to, not including, B.")] = "0:20",
    jobs: Annotated[int, typer.Option(min=1, help="Trials side by side.")] = os.cpu_count() or 1,
    out: Annotated[Path | None, typer.Option(help=f"Folder of contact.json. Trials {_KEPT}")] = None,
) -> None:
    """Put a foam block in a moving arm's way, unseen.

    How hard the arm presses before it stops, and whether it finds another way; how soon it halts when it is told to.
    Two trials a seed, without and with gravity, some seconds each.

    \b
    Example:
      regrasp study contact --seeds 0:20 --out results/contact
    """
    chosen, wrong = parse_seeds(seeds), folders.folder_findings(out) if out is not None else []
    if wrong:
        raise Findings(wrong)
    with late_imports():
        from regrasp.app.tasks.cable.studies.contact import run_contact

    raise typer.Exit(run_contact(chosen, jobs, out))


def motion(
    seeds: Annotated[str, typer.Option(metavar="A:B", help="Queries: seeds from A up to, not including, B.")] = "0:100",
    jobs: Annotated[int, typer.Option(min=1, help="Queries side by side; more than one blurs the times.")] = 1,
    out: Annotated[Path | None, typer.Option(help=f"Folder of motion.json. Queries {_KEPT}")] = None,
) -> None:
    """Ask the planner retrieval queries in cluttered cells.

    Each seed puts one to four pieces of foam into the thesis's cell. Three of four ask for a path that exists: from
    sleep or a viewpoint to a view of the lost end, to a grasp of it, with it to the clip, to sleep. Every fourth asks
    for what cannot be done, whose cause must be named. birrt of pybullet-planning is asked the same, and coal checks
    every path by meshes, where they are installed: pip install -e '.[bench]' in the project's folder.

    \b
    Example:
      regrasp study motion --seeds 0:100 --out results/motion

    \b
    Exit code: 0 done, 1 a query broke off, 2 bad input, 130 Ctrl-C.
    """
    chosen = parse_seeds(seeds)
    if out is not None and (wrong := folders.folder_findings(out)):
        raise Findings(wrong)
    with late_imports():
        from regrasp.app.tasks.cable.studies.motion.study import run_motion

    raise typer.Exit(run_motion(chosen, jobs, out))


def _techniques(text: str | None, wrong: list[Finding]) -> list[str]:
    with late_imports():
        from regrasp.perception.pose.technique import TECHNIQUES  # it brings the arithmetic

    return _listed("--techniques", text, TECHNIQUES, wrong)


def _listed(option: str, text: str | None, known: Sequence[str], wrong: list[Finding]) -> list[str]:
    """The names in "A,B", each once; without a text all known ones. Findings of unknown names are added to `wrong`."""
    names = list(known) if text is None else list(dict.fromkeys(name.strip() for name in text.split(",")))
    wrong += [Finding(option, 0, f"no {quoted(name)}; {nearest(name, known)}") for name in names if name not in known]
    return names
