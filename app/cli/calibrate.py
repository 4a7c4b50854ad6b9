"""`regrasp calibrate`."""

from pathlib import Path
from typing import Annotated

import typer

from regrasp.app.files.findings import Finding, Findings, real_path, shown
from regrasp.app.files.resources import resolve
from regrasp.app.interrupts import late_imports
from regrasp.app.records import folders
from regrasp.interfaces.quote import nearest, quoted
from regrasp.interfaces.seed import MAX_SEED


def add_to(app: typer.Typer) -> None:
    """Add the command to `app`."""
    app.command("calibrate")(calibrate)


def calibrate(
    images: Annotated[
        Path | None, typer.Option(metavar="DIR", help="A folder of your pictures; without it, rendered ones.")
    ] = None,
    columns: Annotated[int, typer.Option(min=3, max=40, help="Inner corners of the board, across.")] = 9,
    rows: Annotated[int, typer.Option(min=3, max=40, help="Inner corners of the board, down.")] = 6,
    square: Annotated[float, typer.Option(min=0.001, max=1.0, help="Width of a square in metres.")] = 0.025,
    out: Annotated[Path, typer.Option("-o", "--out", metavar="FILE", help="The calibration file, a new one.")] = Path(
        "calibration.yaml"
    ),
    draw: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Draw the corners and their residuals, a PNG a view.")
    ] = None,
    cell: Annotated[str, typer.Option(help="Rendered: the cell with the camera.")] = "thesis",
    camera: Annotated[str | None, typer.Option(help="Rendered: which of its cameras; by default the first.")] = None,
    views: Annotated[int, typer.Option(min=5, max=200, help="Rendered: how many.")] = 20,
    seed: Annotated[int, typer.Option(min=0, max=MAX_SEED, help="Rendered: draws where the board is held.")] = 0,
) -> None:
    """Find a camera's intrinsics with a checkerboard.

    From your own pictures or rendered ones; says how well they are known.

    \b
    Examples:
      regrasp calibrate --draw calibration/    # rendered, against what is true
      regrasp calibrate --images photos/ --columns 9 --rows 6 --square 0.025

    Take ten or more sharp pictures, the board tilted in many ways and in every corner of the picture. The file, YAML,
    holds width, height, fx, fy, cx, cy (pixels; 0, 0 is the middle of the first), OpenCV's distortion k1, k2, p1, p2,
    k3, and the residual.
    """
    from regrasp.app.frames.calibration_file import IMAGE_SUFFIXES
    from regrasp.app.scenario.cell_file import load_cell

    wrong = folders.file_findings(out, new=True) + (folders.folder_findings(draw) if draw else [])
    if out.suffix.lower() in IMAGE_SUFFIXES:
        wrong.append(Finding(shown(out), 0, "is a picture's name, and a calibration is YAML; end it in .yaml"))
    if draw is not None and images is not None and real_path(draw) == real_path(images):
        wrong.append(Finding("--draw", 0, "is the folder of your pictures, which it would overwrite; name another"))
    if wrong:
        raise Findings(wrong)
    with late_imports():
        from regrasp.app.frames import calibrate as steps  # brings OpenCV and the physics

    board = steps.Board(columns, rows, square)
    if images is not None:
        steps.run_calibration(steps.pictures_in(images), board, shown(images), out, draw, None)
        return
    cameras = load_cell(resolve("cell", cell, Path()), laid_out=False).known.cameras
    spec = next((c for c in cameras if camera in (None, c.name)), None)
    if spec is None:
        message = f"no camera {quoted(camera or '')}; {nearest(camera or '', [c.name for c in cameras])}"
        raise Findings([Finding("--camera", 0, message)])
    steps.run_calibration(
        steps.rendered_pictures(spec, board, views, seed), board, "--views", out, draw, spec.intrinsics
    )
