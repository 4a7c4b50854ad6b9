"""`regrasp perceive`."""

import re
from collections.abc import Sequence
from inspect import cleandoc
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, TypeVar

import typer

from regrasp.app.files.findings import Finding, Findings, real_path, shown
from regrasp.app.interrupts import late_imports
from regrasp.app.records import folders
from regrasp.app.task.find import tasks
from regrasp.interfaces.quote import nearest, quoted

if TYPE_CHECKING:
    from regrasp.app.task.technique import Technique
    from regrasp.interfaces.fields import Color

T = TypeVar("T")

TECHNIQUES_HERE = "TECHNIQUES"  # in the help: where their list stands
DRAWING_SUFFIXES = (".png", ".jpg", ".jpeg")  # of a drawing


def add_to(app: typer.Typer) -> None:
    """Add the command to `app`."""
    lines = [f"  {name:<13} {technique.about}" for name, technique in _techniques().items()]
    listed = "\b\nTechniques:\n" + "\n".join(lines)
    app.command("perceive", help=cleandoc(str(perceive.__doc__)).replace(TECHNIQUES_HERE, listed))(perceive)


def _techniques() -> "dict[str, Technique]":
    """All tasks' techniques."""
    return {name: technique for task in tasks() for name, technique in task.techniques.items()}


def perceive(
    rgb: Annotated[list[Path], typer.Option(metavar="FILE", help="A colour picture, PNG or JPEG; repeat.")],
    intrinsics: Annotated[
        list[Path] | None,
        typer.Option(metavar="FILE", help="The camera's intrinsics, YAML or JSON; once, or one a picture."),
    ] = None,
    depth: Annotated[
        list[Path] | None,
        typer.Option(metavar="FILE", help="Depth aligned to colour, 16-bit PNG or .npy; one a picture."),
    ] = None,
    technique: Annotated[str, typer.Option(help="See above.")] = "fused",
    draw: Annotated[Path | None, typer.Option(metavar="FILE", help="Draw the result on the first picture.")] = None,
    depth_unit: Annotated[
        float | None,
        typer.Option(min=1e-6, max=1.0, help="Metres that a whole number of depth counts; default 0.001."),
    ] = None,
    cell: Annotated[
        str | None, typer.Option(help="Says what the object is like: size, colour, tag; default one of its task.")
    ] = None,
    color: Annotated[
        str | None, typer.Option(metavar="R,G,B", help="Its colour, each 0 to 255; default the cell's.")
    ] = None,
    length: Annotated[
        float | None, typer.Option(min=0.001, max=1.0, help="Its length in metres; default the cell's.")
    ] = None,
    radius: Annotated[
        float | None, typer.Option(min=0.0005, max=0.5, help="Its radius in metres; default the cell's.")
    ] = None,
    camera: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME", help="The cell's camera that took the pictures; once, or one a picture."),
    ] = None,
    camera_pose: Annotated[
        list[Path] | None,
        typer.Option(metavar="FILE", help="Where the camera stood in the cell's world; once, or one a picture."),
    ] = None,
) -> None:
    """Find a task's object in your own pictures.

    Prints where it is, or the reason why it was not found, as JSON.

    TECHNIQUES

    \b
    Examples:
      regrasp snapshot no_obstacle --out frames    # pictures to try it on
      cd frames
      regrasp perceive --rgb rgb.png --depth depth.png \\
        --intrinsics intrinsics.yaml
      regrasp perceive --technique fiducial --cell thesis_tags --rgb photo.jpg \\
        --intrinsics my_camera.yaml --draw seen.png
      regrasp perceive --technique printer_part --rgb photo.jpg

    Techniques that find a pose need intrinsics. Metres, radians; quaternions x, y, z, w. The object's x axis leads
    along it to its tip; sign_seen says that the picture tells which end is which; without it the axis may as well lead
    the other way. covariance is that of position, then of a small turn; extent the length in sight; whole says that
    position is the whole object's middle, and not that of the part in sight. Several pictures of an object that lies
    still give one pose together, and each its own. Poses are in the camera's frame (x right, y down, z forward),
    unless --camera or --camera-pose say where it stands in the cell's world: then `fused` also sets the camera right
    by the floor and panels that it sees, which makes the distance ten times as sure; where it sees none, it believes
    the place. `rgbd` and `detector` believe any depth.

    `printer_part` needs the picture alone, and answers in pixels: box is left, top, right, bottom; offset that of its
    centre from the picture's, right and down; area that of the box. By colour says that the network saw nothing.

    An intrinsics file is what `regrasp calibrate` writes: width, height, fx, fy, cx, cy (pixels) and, if you like,
    distortion: [k1, k2, p1, p2, k3]. A camera pose file holds position: [x, y, z] and quaternion: [x, y, z, w] of the
    optical frame. Depth as whole numbers counts --depth-unit, as floats metres; 0 and NaN are no reading. A note in a
    picture on how to turn it (EXIF) is not obeyed: the camera's axes are those of its imager.

    \b
    Exit code: 0 found, 1 not found, 2 bad input.
    """
    from regrasp.app.task.technique import FrameFiles, PerceiveRequest

    count, wrong = len(rgb), list[Finding]()
    none = [None] * count
    depths = _each("--depth", depth or none, count, wrong, once=False)
    models = _each("--intrinsics", intrinsics or none, count, wrong)
    cameras = _each("--camera", camera or none, count, wrong)
    poses = _each("--camera-pose", camera_pose or none, count, wrong)
    if draw is not None:
        wrong += _bad_drawing(draw, [*rgb, *(depth or []), *(intrinsics or []), *(camera_pose or [])])
    tint = None if color is None else _color(color, wrong)
    known = _techniques()
    if technique not in known:
        message = f"no technique {quoted(technique)}; {nearest(technique, list(known))}"
        wrong.append(Finding("--technique", 0, message))
    if wrong:
        raise Findings(wrong)
    frames = [FrameFiles(*each) for each in zip(rgb, depths, models, cameras, poses, strict=True)]
    request = PerceiveRequest(technique, frames, cell, tint, length, radius, depth_unit, draw)
    with late_imports():
        run = known[technique].run()  # brings OpenCV, and some the compiler
    raise typer.Exit(0 if run(request) else 1)


def _each(option: str, given: Sequence[T], count: int, wrong: list[Finding], once: bool = True) -> list[T]:
    """A value for each of `count` pictures; with `once` a single one may stand for all. Errors are added to `wrong`."""
    if once and len(given) == 1:
        return [given[0]] * count
    if len(given) != count:
        right = f"give {'one for all, or ' if once else ''}one for each"
        wrong.append(Finding(option, 0, f"given {len(given)} times for {count} pictures; {right}"))
    return list(given)


def _bad_drawing(draw: Path, inputs: Sequence[Path]) -> list[Finding]:
    """Why the drawing cannot be written there; [] if it can."""
    if draw.suffix.lower() not in DRAWING_SUFFIXES:
        return [
            Finding(
                "--draw", 0, f"{quoted(draw.name)} is no name of a picture; end it in {' or '.join(DRAWING_SUFFIXES)}"
            )
        ]
    if any(
        real_path(draw) == real_path(path) or (draw.exists() and path.exists() and draw.samefile(path))
        for path in inputs
    ):
        return [
            Finding(
                "--draw", 0, f"{quoted(shown(draw))} is one of your own files, which it would overwrite; name another"
            )
        ]
    return folders.file_findings(draw)


def _color(text: str, wrong: list[Finding], min_saturation: float = 0.2) -> "Color | None":
    """The colour of "R,G,B", each then 0 to 1. What is wrong is added to `wrong`.

    Below `min_saturation` (of HSV; choice) a colour is refused as grey: every grey thing would look like the object.
    """
    parts = text.split(",")
    right = "write three numbers of 0 to 255, such as 191,13,15"
    if len(parts) != 3 or not all(re.fullmatch(r"\s*\d{1,3}\s*", part) and int(part) <= 255 for part in parts):
        wrong.append(Finding("--color", 0, f"{quoted(text)} is no colour; {right}"))
        return None
    red, green, blue = (int(part) / 255 for part in parts)
    if max(red, green, blue) - min(red, green, blue) < min_saturation * max(red, green, blue, 1e-9):
        wrong.append(
            Finding(
                "--color", 0, f"{quoted(text)} is grey, and nothing else tells it from its surroundings; name a hue"
            )
        )
        return None
    return red, green, blue
