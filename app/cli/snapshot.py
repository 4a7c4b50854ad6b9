"""`regrasp snapshot`."""

from pathlib import Path
from typing import Annotated

import typer

from regrasp.app.cli.options import Sets
from regrasp.app.files.findings import Finding, Findings, shown
from regrasp.app.interrupts import late_imports
from regrasp.app.records import folders
from regrasp.interfaces.quote import nearest, quoted
from regrasp.interfaces.seed import MAX_SEED

# A snapshot writes some of these. A camera pose that an earlier one left would not belong to the new pictures.
SNAPSHOT_FILES = ("rgb.png", "rgb_001.png", "depth.png", "depth_001.png", "intrinsics.yaml", "camera_pose.yaml")


def add_to(app: typer.Typer) -> None:
    """Add the command to `app`."""
    app.command("snapshot")(snapshot)


def snapshot(
    scenario: Annotated[str, typer.Argument(help="A shipped scenario's name, or a path to a .yaml file.")],
    out: Annotated[Path, typer.Option(metavar="DIR", help="A folder for the files.")],
    camera: Annotated[
        str | None, typer.Option(metavar="NAME", help="Which camera of the cell; by default its first.")
    ] = None,
    frames: Annotated[int, typer.Option(min=1, max=100, help="How many.")] = 1,
    seed: Annotated[
        int | None, typer.Option(min=0, max=MAX_SEED, help="Draws every error and noise; default the scenario's.")
    ] = None,
    sets: Sets = None,
) -> None:
    """Write a scenario's first camera frames as files.

    rgb.png, depth.png (16 bit, millimetres) and intrinsics.yaml. Of a camera that stands still camera_pose.yaml, too:
    where the robot believes it to be. Several frames are rgb_001.png, depth_001.png, and so on.

    \b
    Example:
      regrasp snapshot no_obstacle --seed 3 --frames 4 --out four
      regrasp snapshot no_obstacle --camera wrist --out wrist
    """
    from regrasp.app.scenario.load import load_scenario

    wrong = folders.folder_findings(out)
    if there := [name for name in SNAPSHOT_FILES if (out / name).exists()]:
        wrong.append(Finding(shown(out), 0, f"already holds {', '.join(there)}; name another folder"))
    loaded = load_scenario(scenario, [*(sets or []), *([] if seed is None else [f"seed={seed}"])], None)
    names = [c.name for c in loaded.cell.known.cameras]
    camera = camera or next(iter(names), "")
    if camera not in names:
        wrong.append(Finding("--camera", 0, f"no camera {quoted(camera)}; {nearest(camera, names)}"))
    if wrong:
        raise Findings(wrong)
    with late_imports():
        from regrasp.app.frames.snapshot import write_snapshot  # brings the physics and the compiler: seconds

    write_snapshot(loaded, camera, frames, out)
    typer.echo(f"written to {shown(out)}")
