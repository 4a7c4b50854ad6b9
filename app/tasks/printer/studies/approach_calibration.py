"""`regrasp calibrate-approach`: the tables of the source's approaches (sections 4.3.8, 4.3.9), by rendered pictures."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import RigidTransform

from regrasp.app.files.whole_file import write_whole
from regrasp.app.tasks.printer.studies.hand_placed import HandPlaced
from regrasp.interfaces.printer.actions import Sighting
from regrasp.interfaces.printer.cell import PrinterCell
from regrasp.perception.printer.analyzer import PartAnalyzer
from regrasp.perception.printer.approach_tables import ApproachTables


@dataclass(frozen=True)
class CalibrationParameters:
    """Where the pictures are taken. Lengths in m."""

    nearest: float = 0.15  # from the tool to its goal; nearer the palm hides the part's foot
    farthest: float = 0.55
    step: float = 0.05  # between two knots; the spec's
    aside: float = 0.02  # to each side, for the scale; choice


def calibrated(cell: PrinterCell, parameters: CalibrationParameters = CalibrationParameters()) -> ApproachTables:
    """The tables, with a hand and a camera that are not off.

    Raises:
        ValueError: a picture does not show the part, or the tables do not rise and fall as they must.
    """
    with HandPlaced(without_errors(cell), 0) as hand:
        perception: Any = hand.services.perception
        analyzer = PartAnalyzer(perception, cell.known.printer, hand.world)
        count = round((parameters.farthest - parameters.nearest) / parameters.step) + 1
        distances = np.linspace(parameters.nearest, parameters.farthest, count)
        rows = [_knot(hand, analyzer, float(distance), parameters.aside) for distance in distances]
    areas, scales, lefts, ups = np.array(rows).T
    return ApproachTables(
        area=tuple(areas.tolist()),
        distance=tuple(distances.round(6).tolist()),
        scale=tuple(scales.round(9).tolist()),
        aim=(round(float(lefts.mean()), 5), round(float(ups.mean()), 5)),
    )


def write_tables(tables: ApproachTables, path: Path) -> None:
    """Write the tables to a file.

    Raises:
        OSError: it cannot be written.
    """
    write_whole(path, tables.model_dump_json(indent=2) + "\n")


def without_errors(cell: PrinterCell) -> PrinterCell:
    """The cell with devices that are not off and have no noise."""
    errors: dict[str, Any] = dict.fromkeys(("camera_position", "camera_angle_deg", "depth_scale", "arm_tool"), 0.0)
    errors |= dict.fromkeys(("finger_noise", "finger_backlash"), 0.0)
    hidden = cell.hidden.model_copy(update={"errors": cell.hidden.errors.model_copy(update=errors)})
    return cell.model_copy(update={"hidden": hidden})


def _knot(hand: HandPlaced, analyzer: PartAnalyzer, distance: float, aside: float) -> tuple[float, float, float, float]:
    """The box's area, the scale, and how far left and up its middle lies (m), with the hand so far from its goal."""
    seen = [_seen(hand, analyzer, distance, y) for y in (-aside, 0.0, aside)]
    scale = 2 * aside / abs(seen[2].offset[0] - seen[0].offset[0])
    return seen[1].area, scale, -scale * seen[1].offset[0], -scale * seen[1].offset[1]


def _seen(hand: HandPlaced, analyzer: PartAnalyzer, distance: float, y: float) -> Sighting:
    hand.place(RigidTransform.from_translation([distance, y, 0.0]) * hand.goal)
    found = analyzer.find(hand.picture(), "obj")
    if found is None:
        raise ValueError(f"the picture from {distance:g} m does not show the part")
    return found
