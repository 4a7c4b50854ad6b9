"""Checks of a cell for the printer task: its names, and how printer, door, part, desk and rail lie to one another."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from regrasp.app.files.findings import Finding
from regrasp.app.files.yaml_lines import Document
from regrasp.app.scenario.cell_layout import CellLayoutParameters, box_parts, out_of_reach, reaches
from regrasp.app.scenario.shapes import penetration_depth
from regrasp.interfaces.cell import Box, Region, WristMount
from regrasp.interfaces.printer.cell import KnownPrinter, PrinterCell, PrinterKnown
from regrasp.interfaces.quote import nearest, quoted
from regrasp.perception.camera.color import SegmentationParameters, color_mask

_HERE = ("known", "printer")


@dataclass(frozen=True)
class PrinterLayoutParameters(CellLayoutParameters):
    """How deep the parts of a cell may reach into one another, and how far they may stand apart, metres."""

    touching: float = 0.001  # of things that lie on or at one another


def cell_findings(document: Document, cell: PrinterCell, laid_out: bool) -> list[Finding]:
    """Names that refer to nothing; only if `laid_out`, how the parts lie to one another."""
    return [*(_layout(document, cell.known) if laid_out else _misnamed(document, cell.known))]


def _misnamed(document: Document, known: PrinterKnown) -> Iterator[Finding]:
    printer = known.printer
    on_rails = [arm.name for arm in known.arms if arm.robot.rail is not None]
    carried = [c.name for c in known.cameras if isinstance(c.mount, WristMount) and c.mount.arm == printer.hand]
    for role, kind, names in (("hand", "arm on a rail", on_rails), ("camera", "camera on the hand's arm", carried)):
        if (name := getattr(printer, role)) not in names:
            right = nearest(name, names) if names else "add one"
            yield Finding(*document.place((*_HERE, role)), f"{role}: no {kind} {quoted(name)}; {right}")
            return  # which cameras there are follows from the hand


def _layout(
    document: Document, known: PrinterKnown, parameters: PrinterLayoutParameters = PrinterLayoutParameters()
) -> Iterator[Finding]:
    for below, part in combinations(box_parts(("known", "boxes"), known.boxes), 2):
        depth = penetration_depth(np.vstack([part.halves, below.halves]), part.center - below.center)
        if depth > parameters.touching:
            yield reaches(document, part, depth, below.name)
    yield from _in_things(document, known, parameters.touching)
    yield from _names_of_boxes(document, known)
    yield from _colors(document, known)
    yield from _in_the_opening(document, known)
    yield from _on_the_plate(document, known, parameters.touching)
    yield from _door(document, known)
    yield from _rail(document, known)


def _own_things(printer: KnownPrinter) -> Iterator[tuple[tuple[str, ...], Box]]:
    """Each thing of the printer, the door and its handle all along their way, with the key of its place."""
    keys = {"door": ("door",), "door_handle": ("door", "handle"), "section": ("part", "section")}
    shut, opened = printer.door.parts(0.0), printer.door.parts(printer.door.travel)
    for before, after in zip(shut, opened, strict=True):
        center = tuple(0.5 * (np.array(before.center) + after.center))
        x, y, z = before.size
        yield keys[before.name], before.model_copy(update={"center": center, "size": (x, y + printer.door.travel, z)})
    for box in printer.fixtures():
        yield keys.get(box.name, (box.name.partition("_")[0],)), box


def _in_things(document: Document, known: PrinterKnown, most: float) -> Iterator[Finding]:
    """Things of the printer that reach into a box of the cell; of each thing the deepest."""
    boxes = box_parts(("known", "boxes"), known.boxes)
    for path, box in _own_things(known.printer):
        [part] = box_parts((), [box])
        depths = [(penetration_depth(np.vstack([part.halves, b.halves]), part.center - b.center), b) for b in boxes]
        depth, other = max(depths, key=lambda found: found[0])
        if depth > most:
            told = f"the {box.name} reaches {depth:.3f} m into {quoted(other.name)}; move one of them"
            yield Finding(*document.place((*_HERE, *path, "center")), told)


def _names_of_boxes(document: Document, known: PrinterKnown) -> Iterator[Finding]:
    """Boxes with the name of one of the printer's things."""
    own = {box.name for _, box in _own_things(known.printer)}
    for i, box in enumerate(known.boxes):
        if box.name in own:
            told = f"{quoted(box.name)} is the name of a thing of the printer; give the box another"
            yield Finding(*document.place(("known", "boxes", i, "name")), told)


def _colors(document: Document, known: PrinterKnown) -> Iterator[Finding]:
    """Handle, part and section that are found by their colours, which another thing has, too."""
    things = {box.name: box for _, box in _own_things(known.printer)}
    for name, path in {"door_handle": ("door", "handle"), "part": ("part",), "section": ("part", "section")}.items():
        wanted = SegmentationParameters.for_color(things[name].color)
        for other in (*(box for box in things.values() if box.name != name), *known.boxes):
            pixel = np.rint(255 * np.array(other.color)).astype(np.uint8).reshape(1, 1, 3)
            if color_mask(pixel, wanted).any():
                told = f"{quoted(other.name)} has the colour of the {name}, which is found by that; change one of them"
                yield Finding(*document.place((*_HERE, *path, "color")), told)
                break


def _in_the_opening(document: Document, known: PrinterKnown) -> Iterator[Finding]:
    """What does not fit into the printer's opening."""
    plate = known.printer.plate
    part, section = known.printer.part.blocks()
    inside: dict[tuple[str, ...], Box] = {
        ("plate",): Box(name="plate", center=plate.center, size=plate.size),
        ("part",): part,
        ("part", "section"): section,
    }
    for path, box in inside.items():
        for axis, low, high in _sticks_out(box, known.printer.opening):
            span = f"{known.printer.opening.lower[axis]:g} to {known.printer.opening.upper[axis]:g}"
            told = (
                f"the {box.name} is outside the printer's opening: {'xyz'[axis]} {low:.3f} to {high:.3f}, the opening"
            )
            yield Finding(*document.place((*_HERE, *path, "center")), f"{told} {span}; move it in")
            break


def _sticks_out(box: Box, region: Region) -> Iterator[tuple[int, float, float]]:
    """The axes along which a box leaves a region, each with the box's ends."""
    for axis in range(3):
        low, high = (box.center[axis] + side * box.size[axis] for side in (-0.5, 0.5))
        if low < region.lower[axis] or high > region.upper[axis]:
            yield axis, low, high


def _on_the_plate(document: Document, known: PrinterKnown, most: float) -> Iterator[Finding]:
    """A part that does not stand on the plate, and a section that is not at the part's front."""
    plate, part = known.printer.plate, known.printer.part
    gap = part.center[2] - 0.5 * part.size[2] - plate.center[2] - 0.5 * plate.size[2]
    if abs(gap) > most:
        told = f"the part's foot is {abs(gap):.3f} m {'above' if gap > 0 else 'below'} the plate's top"
        yield Finding(*document.place((*_HERE, "part", "center")), f"{told}; let it stand on the plate")
    gap = part.section.center[0] - 0.5 * part.section.size[0] - part.center[0] - 0.5 * part.size[0]
    if abs(gap) > most:
        told = f"the gripping section's back is {abs(gap):.3f} m {'before' if gap > 0 else 'behind'} the part's front"
        yield Finding(*document.place((*_HERE, "part", "section", "center")), f"{told}; let them meet")


def _door(document: Document, known: PrinterKnown) -> Iterator[Finding]:
    """A door that, open, covers a part of the opening."""
    door, opening = known.printer.door, known.printer.opening
    covers = opening.upper[1] - (door.center[1] - 0.5 * door.size[1] + door.travel)
    if covers > 1e-6:
        told = f"a door that goes {door.travel:g} m still covers {covers:.3f} m of the opening; give it more travel"
        yield Finding(*document.place((*_HERE, "door", "travel")), told)


def _rail(document: Document, known: PrinterKnown) -> Iterator[Finding]:
    """A rail that is too short to open the door, or from which the arm cannot reach what it works with."""
    printer = known.printer
    arm = known.arm(printer.hand)
    where = document.place(("known", "arms", known.arms.index(arm), "robot"))
    rail = arm.robot.rail
    assert rail is not None  # by _misnamed
    if rail.upper - rail.lower < printer.door.travel:
        told = f"the {arm.name} arm's rail is {rail.upper - rail.lower:g} m long, and shall draw the door"
        yield Finding(*where, f"{told} {printer.door.travel:g} m along; take one with a longer rail")
        return
    closed, opened = (printer.door.parts(opening)[1].center for opening in (0.0, printer.door.travel))
    places = {
        "the handle of the closed door": closed,
        "the handle of the open door": opened,
        "the gripping section": printer.part.section.center,
        "the clamp": printer.clamp.center,
    }
    for name, place in places.items():
        if (trouble := out_of_reach(arm, np.asarray(place))) is not None:
            yield Finding(*where, f"{name} is {trouble}; move it nearer, or take one with a longer rail")
