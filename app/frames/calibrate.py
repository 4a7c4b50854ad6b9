"""`regrasp calibrate`: from a user's or rendered pictures of a checkerboard to a report and a calibration file."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import cv2
import numpy as np
import typer
from numpy.typing import NDArray

from regrasp.app.campaigns.table import print_table
from regrasp.app.files.findings import Finding, Findings, shown
from regrasp.app.files.whole_file import write_whole
from regrasp.app.frames.calibration_file import IMAGE_SUFFIXES, CalibrationFile, write_calibration
from regrasp.app.frames.image_files import read_rgb
from regrasp.interfaces.cell import CameraSpec
from regrasp.interfaces.frame import Intrinsics
from regrasp.perception.camera.calibration import Calibration, calibrate_intrinsics, find_checkerboard
from regrasp.sim.cameras.board import board_pictures, board_poses

Picture = tuple[str, Callable[[], NDArray[np.uint8]]]  # a name, and a function that returns the RGB image


@dataclass(frozen=True)
class CalibrationChecks:
    """What a set of pictures must fulfil to be used."""

    min_views: int = 5  # choice: three determine a camera, five also its uncertainty
    min_side: int = 64  # px, width and height; choice: a smaller picture shows no board
    min_view_distance: float = 0.02  # of the picture's width, mean motion of the corners; choice: nearer views are one
    max_focal_deviation: float = 0.01  # of the focal length, standard deviation; choice: more comes of similar views


_DEFAULTS = CalibrationChecks()


@dataclass(frozen=True)
class Board:
    """A checkerboard: the numbers of its inner corners, and the width `square` of a square in metres."""

    columns: int
    rows: int
    square: float


def rendered_pictures(camera: CameraSpec, board: Board, count: int, seed: int) -> list[Picture]:
    """`count` rendered pictures of a board as the camera's colour imager sees it."""
    k, shape = camera.intrinsics, (board.columns, board.rows, board.square)
    poses = board_poses(k, *shape, count, np.random.default_rng(seed))
    made = enumerate(board_pictures(k, poses, *shape), 1)
    return [(f"view_{number:03}", partial(np.asarray, rgb)) for number, rgb in made]


def pictures_in(folder: Path, checks: CalibrationChecks = _DEFAULTS) -> list[Picture]:
    """The image files of a folder in the order of their names.

    Raises:
        Findings: no folder, or too few images in it. Reading a picture raises it for what is no image, or too small.
    """
    if not folder.is_dir():
        raise Findings([Finding(shown(folder), 0, "is no folder; name one that holds pictures of a checkerboard")])
    files = sorted(path for path in folder.iterdir() if path.suffix.lower() in IMAGE_SUFFIXES)
    if len(files) < checks.min_views:
        message = (
            f"holds {len(files)} images ({', '.join(IMAGE_SUFFIXES)}); take {checks.min_views} or more of the board"
        )
        raise Findings([Finding(shown(folder), 0, message)])
    return [(path.name, partial(_read, path, checks.min_side)) for path in files]


def _read(path: Path, min_side: int) -> NDArray[np.uint8]:
    image = read_rgb(path)
    if min(image.shape[:2]) < min_side:
        message = f"is {image.shape[1]}x{image.shape[0]} pixels; give pictures of at least {min_side} each way"
        raise Findings([Finding(shown(path), 0, message)])
    return image


def run_calibration(
    pictures: Sequence[Picture],
    board: Board,
    source: str,
    out: Path,
    draw: Path | None,
    true: Intrinsics | None,
    checks: CalibrationChecks = _DEFAULTS,
) -> None:
    """Calibrate, print the report, and write the calibration to `out` and the drawn pictures to the folder `draw`.

    `true` are the intrinsics to compare with, if known.

    Raises:
        Findings: too few different views, or views that leave the focal length uncertain. They name `source`.
    """
    views, size = _find_boards(pictures, board, source)
    seen = {name: corners for name, corners in views.items() if corners is not None}
    if len(seen) < checks.min_views:
        message = (
            f"a board of {board.columns} x {board.rows} inner corners is seen in {len(seen)} of {len(views)} pictures; "
            f"take {checks.min_views} or more that show all of it, and check --columns and --rows"
        )
        raise Findings([Finding(source, 0, message)])
    if (different := _different(list(seen.values()), checks.min_view_distance * size[0])) < checks.min_views:
        message = f"only {different} of {len(seen)} views differ; hold the board in {checks.min_views} or more ways"
        raise Findings([Finding(source, 0, message)])
    found = calibrate_intrinsics(list(seen.values()), *size, board.columns, board.rows, board.square)
    deviation = max(found.deviations[0] / found.intrinsics.fx, found.deviations[1] / found.intrinsics.fy)
    if not deviation < checks.max_focal_deviation:  # nan too
        message = (
            f"the views leave the focal length open by {100 * deviation:.1f} %; tilt the board more, and come nearer"
        )
        raise Findings([Finding(source, 0, message)])
    residuals = dict(zip(seen, found.residuals, strict=True))
    _report(views, residuals, found, true)
    _write(out, found)
    if draw is not None:
        _draw(draw, pictures, seen, residuals, board)


def _different(views: Sequence[NDArray[np.float64]], min_distance: float) -> int:
    """The number of views (n, 2) px whose corners are on average at least so far from those of all earlier views."""
    kept: list[NDArray[np.float64]] = []
    for view in views:
        if all(np.linalg.norm(view - other, axis=1).mean() >= min_distance for other in kept):
            kept.append(view)
    return len(kept)


def _find_boards(
    pictures: Sequence[Picture], board: Board, source: str
) -> tuple[dict[str, NDArray[np.float64] | None], tuple[int, int]]:
    """The corners (n, 2) px in each picture, None where no board is found, and the pictures' width and height."""
    wrong: list[Finding] = []
    views: dict[str, NDArray[np.float64] | None] = {}
    sizes: dict[tuple[int, int], str] = {}
    for name, picture in pictures:
        try:
            rgb = picture()
        except Findings as error:
            wrong += error.items
            continue
        sizes.setdefault((rgb.shape[1], rgb.shape[0]), name)
        if len(sizes) == 1 and not wrong:
            views[name] = find_checkerboard(rgb, board.columns, board.rows)
    if len(sizes) > 1:
        sizes_text = ", ".join(f"{name} is {width}x{height}" for (width, height), name in sizes.items())
        wrong.append(
            Finding(source, 0, f"pictures of several sizes: {sizes_text}; give those of one camera in one mode")
        )
    if wrong:
        raise Findings(wrong)
    return views, next(iter(sizes))


def _report(
    views: dict[str, NDArray[np.float64] | None],
    residuals: dict[str, NDArray[np.float64]],
    found: Calibration,
    true: Intrinsics | None,
) -> None:
    lines = []
    for name in views:
        if name in residuals:
            norms = np.linalg.norm(residuals[name], axis=1)
            lines.append((name, str(len(norms)), f"{np.sqrt(np.mean(norms**2)):.3f}", f"{norms.max():.3f}"))
        else:
            lines.append((name, "not found", "-", "-"))
    print_table(("view", "corners", "rms px", "largest px"), lines)
    k = found.intrinsics
    figures = []
    for key, deviation in zip(("fx", "fy", "cx", "cy"), found.deviations, strict=True):
        value = getattr(k, key)
        compared = () if true is None else (f"{getattr(true, key):.2f}", f"{value - getattr(true, key):+.2f}")
        figures.append((key, f"{value:.2f}", f"{deviation:.2f}", *compared))
    typer.echo("")
    print_table(("pixels", "found", "deviation", *(() if true is None else ("true", "error"))), figures)
    k1, k2 = found.distortion[:2]
    typer.echo(
        f"\ndistortion k1 {k1:+.4f}, k2 {k2:+.4f}; {len(residuals)} of {len(views)} views, rms {found.rms:.3f} px"
    )


def _write(out: Path, found: Calibration) -> None:
    k = found.intrinsics
    fx, fy, cx, cy = (round(value, 4) for value in (k.fx, k.fy, k.cx, k.cy))
    k1, k2, p1, p2, k3 = (round(value, 6) for value in found.distortion)
    out.parent.mkdir(parents=True, exist_ok=True)
    write_calibration(
        out,
        CalibrationFile(
            width=k.width,
            height=k.height,
            fx=fx,
            fy=fy,
            cx=cx,
            cy=cy,
            distortion=(k1, k2, p1, p2, k3),
            rms=round(found.rms, 4),
        ),
    )
    typer.echo(f"written to {shown(out)}")


def _draw(
    folder: Path,
    pictures: Sequence[Picture],
    seen: dict[str, NDArray[np.float64]],
    residuals: dict[str, NDArray[np.float64]],
    board: Board,
    residual_scale: float = 50.0,
) -> None:
    """A PNG of each view: the corners, joined row by row, and their residuals, enlarged."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, picture in pictures:
        if name not in seen:
            continue
        image = cv2.cvtColor(picture(), cv2.COLOR_RGB2BGR)
        cv2.drawChessboardCorners(image, (board.columns, board.rows), seen[name].astype(np.float32), True)
        for start, residual in zip(seen[name], residuals[name], strict=True):
            foot, tip = np.rint([start, start + residual_scale * residual]).astype(int).tolist()
            cv2.arrowedLine(image, foot, tip, (255, 0, 255), 1, cv2.LINE_AA, tipLength=0.3)
        write_whole(folder / f"{name.removesuffix('.png')}.png", cv2.imencode(".png", image)[1].tobytes())
    typer.echo(f"corners, and residuals {residual_scale:.0f} times enlarged, drawn in {shown(folder)}")
