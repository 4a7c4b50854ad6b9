"""`regrasp perceive --technique printer_part`: the printed part in a user's own pictures, as JSON."""

from collections.abc import Mapping
from typing import Any

import cv2
import numpy as np
import typer

from regrasp.app.files.findings import Finding, Findings, shown
from regrasp.app.files.json_text import json_text
from regrasp.app.frames.image_files import read_rgb, write_picture
from regrasp.app.run.video import write_text
from regrasp.app.task.technique import PerceiveRequest
from regrasp.app.tasks.printer.cells import printer_cell
from regrasp.interfaces.arrays import ColorImage
from regrasp.interfaces.printer.actions import CLASSES, PartClass, Sighting
from regrasp.interfaces.printer.cause import PrinterCause
from regrasp.interfaces.printer.cell import KnownPrinter
from regrasp.perception.printer.analyzer import PartFinder

USES = ("--color",)  # of the options; the rest is for a pose
PART: tuple[PartClass, ...] = ("obj", "targ")  # either of them is the part
WHAT: dict[PartClass, str] = {
    "obj": "the part",
    "targ": "the part's gripping section",
    "lgrip": "the left finger",
    "rgrip": "the right finger",
}
BOX_COLORS: dict[PartClass, tuple[int, int, int]] = {
    "obj": (255, 120, 90),
    "targ": (110, 170, 255),
    "lgrip": (255, 240, 60),
    "rgrip": (90, 255, 90),
}

Sightings = Mapping[PartClass, Sighting | None]


def perceive_part(request: PerceiveRequest) -> bool:
    """Print what each picture shows as JSON, and draw it on the first; whether any shows the part or its section.

    Raises:
        Findings: a file or an option is wrong.
    """
    wrong = [
        Finding(option, 0, f"the technique {request.technique} has no use for it; leave it out")
        for option in request.given()
        if option not in USES
    ]
    pictures, printer = list[ColorImage](), _printer(request)
    for files in request.frames:
        try:
            pictures.append(read_rgb(files.rgb))
        except Findings as error:
            wrong += error.items
    if wrong:
        raise Findings(wrong)
    finder = PartFinder(printer)
    found: list[Sightings] = [{name: finder.find(rgb, name) for name in CLASSES} for rgb in pictures]
    if request.draw is not None:
        write_picture(request.draw, drawn(pictures[0], found[0]))
    answer = {
        "technique": request.technique,
        "found": any(_shows_part(each) for each in found),
        "frames": [
            {
                "rgb": shown(files.rgb),
                "found": _shows_part(each),
                **{name: _fields(name, sighting) for name, sighting in each.items()},
            }
            for files, each in zip(request.frames, found, strict=True)
        ],
    }
    typer.echo(json_text(answer))
    return bool(answer["found"])


def drawn(rgb: ColorImage, found: Sightings, width: int = 640) -> ColorImage:
    """The picture (H, W, 3), at least `width` px wide so that text fits, with the boxes of what was found."""
    scale = max(1.0, width / rgb.shape[1])
    out = np.ascontiguousarray(cv2.resize(rgb, None, fx=scale, fy=scale), np.uint8)
    size = out.shape[1] / width
    for name, sighting in found.items():
        if sighting is None:
            continue
        left, top, right, bottom = (round(scale * (edge + 0.5)) for edge in sighting.box)
        cv2.rectangle(out, (left, top), (right, bottom), BOX_COLORS[name], round(2 * size))
        how = "by colour" if sighting.confidence is None else f"{sighting.confidence:.2f}"
        write_text(out, f"{name} {how}", (max(left, 4), max(top - 6, round(16 * size))), 0.5 * size)
    return out


def _printer(request: PerceiveRequest) -> KnownPrinter:
    """What is known of the cell's printer, with its part of the colour that the user gave."""
    printer = printer_cell(request.cell or "habitat_open").known.printer
    if request.color is None:
        return printer
    return printer.model_copy(update={"part": printer.part.model_copy(update={"color": request.color})})


def _shows_part(found: Sightings) -> bool:
    return any(found[name] is not None for name in PART)


def _fields(name: PartClass, sighting: Sighting | None) -> dict[str, Any]:
    if sighting is None:
        message = f"the picture does not show {WHAT[name]}"
        return {"found": False, "reason": str(PrinterCause.TARGET_NOT_SEEN), "message": message}
    confidence = {} if sighting.confidence is None else {"confidence": round(sighting.confidence, 3)}
    return {
        "found": True,
        "offset": [round(value, 1) for value in sighting.offset],
        "area": round(sighting.area, 1),
        "box": [round(edge, 1) for edge in sighting.box],
        "by": "color" if sighting.confidence is None else "network",
        **confidence,
    }
