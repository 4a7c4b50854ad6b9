"""Reads and checks cell files."""

from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path

from regrasp.app.files.findings import Finding, Findings, catch_findings, shown
from regrasp.app.files.overrides import Assignment, apply_assignments, merge_into
from regrasp.app.files.resources import read_text, resolve
from regrasp.app.files.validation import validated
from regrasp.app.files.yaml_lines import Document, Place, parse
from regrasp.interfaces.cable.cell import CableCell
from regrasp.interfaces.quote import MAX_QUOTE, cut, nearest, quoted


def load_cell(
    path: Path, assignments: Sequence[Assignment] = (), where: Place | None = None, *, laid_out: bool = True
) -> CableCell:
    """Read and check a cell file, with the assignments applied.

    A cell may name another as its `base` and give only what differs; the base itself has no base. Raises `Findings`;
    if there is no such file, the finding stands at `where`, the place that names the cell. Without `laid_out` it is not
    checked whether the parts leave one another room and the robot can reach them, for those who only look at pictures.
    """
    document = parse(read_text(path, where), shown(path))
    if isinstance(document.value, dict) and "base" in document.value:
        document = _on_base(document, path.parent)
    fits = isinstance(document.value, dict)  # else only that is reported, not the assignments
    _, found = catch_findings(apply_assignments, document, assignments if fits else ())
    cell, wrong = catch_findings(validated, document, CableCell)
    found += wrong
    if cell:
        misnamed = [*_misnamed(document, cell)]
        found += misnamed
        if laid_out and not misnamed:
            from regrasp.app.scenario.cell_layout import layout_findings  # late: it brings the optimiser

            found += layout_findings(document, cell)
    if found or not cell:
        raise Findings(found)
    return cell


def _on_base(top: Document, folder: Path) -> Document:
    assert isinstance(top.value, dict)
    name, place = top.value.pop("base"), top.place(("base",))
    if not isinstance(name, str):
        raise Findings([Finding(*place, f"base is {quoted(name)}; expected the name of a cell or a path to its file")])
    path = resolve("cell", name, folder, place)
    document = parse(read_text(path, place), shown(path))
    if isinstance(document.value, dict) and "base" in document.value:
        raise Findings(
            [Finding(*place, f"{quoted(shown(path))} has a base itself; name that one, and give here what it adds")]
        )
    merge_into(document, top)
    return document


def _misnamed(document: Document, cell: CableCell) -> Iterator[Finding]:
    """Names in a cell that are missing, taken twice, or refer to nothing."""
    known = cell.known
    boxes = [*known.boxes, *known.cable.clip.bracket]
    for name, count in Counter(box.name for box in boxes).items():
        if count > 1:
            yield Finding(*document.place(("known", "boxes")), f"{count} boxes are named {quoted(name)}; rename them")
    sockets = [s.name for s in known.cable.sockets]
    if known.cable.plugged_into not in sockets:
        message = f"no socket {quoted(known.cable.plugged_into)}; {nearest(known.cable.plugged_into, sockets)}"
        yield Finding(*document.place(("known", "cable", "plugged_into")), message)
    arms: list[str] = [a.name for a in known.arms]
    cameras: list[str] = [c.name for c in known.cameras]
    groups = {"sockets": (sockets, sockets), "arms": (arms, ["left", "right"]), "cameras": (cameras, ["rear", "wrist"])}
    for key, (names, needed) in groups.items():
        if sorted(names) != sorted(set(needed)):
            given, right = (cut(", ".join(group), 3 * MAX_QUOTE) for group in (names, sorted(set(needed))))
            yield Finding(*document.place(("known", key)), f"{key} are {given}; give one each of {right}")
