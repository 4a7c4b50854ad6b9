"""Assignments to keys of a parsed file: by `--set key.path=value`, by a case of `vary`, by a cell to its base."""

from collections.abc import Iterator, Sequence
from copy import deepcopy
from dataclasses import dataclass

from regrasp.app.files.findings import Finding, Findings
from regrasp.app.files.yaml_lines import Document, Path, Place, Value, parse
from regrasp.interfaces.quote import cut, quoted

OPTION = "--set"


@dataclass(frozen=True)
class Assignment:
    """A value for a key of a file. `place` is where it was written; findings about it begin with `told`."""

    key: str  # dotted; list items go by index
    new: Document
    place: Place
    told: str = ""

    @property
    def path(self) -> Path:
        """The path in the file of the value."""
        return path_of(self.key)


def was_typed(place: Place) -> bool:
    """Whether a value with this place was written on the command line, not in a file."""
    return place[0].startswith(f"{OPTION} ") and place[1] == 0


def path_of(key: str) -> Path:
    """The path that a dotted key means."""
    return tuple(int(step) if _is_index(step) else step for step in key.split("."))


def _is_index(step: str) -> bool:
    return step.isdecimal() and len(step) < 10


def parse_overrides(overrides: Sequence[str]) -> tuple[list[Assignment], list[Finding]]:
    """The assignments of "key.path=value" texts, with values in YAML, and the findings of invalid ones."""
    assignments, findings = [], []
    for text in overrides:
        source = f"{OPTION} {cut(text)}"
        key, equals, value = text.partition("=")
        if not equals or not all(key.strip().split(".")):
            message = "no key with a value; write key.path=value, such as gravity=earth"
            findings.append(Finding(source, 0, message))
            continue
        try:
            new = parse(value, source, 0)
        except Findings as error:
            findings += error.items
            continue
        findings += new.findings
        if not new.findings:
            assignments.append(Assignment(key.strip(), new, (source, 0)))
    return assignments, findings


def apply_assignments(document: Document, assignments: Sequence[Assignment]) -> None:
    """Apply the assignments to `document` in place; an unknown key is added, and left to the check of the document.

    Raises `Findings` for all assignments that have no place in it.
    """
    findings = []
    for assignment in assignments:
        try:
            _apply_one(document, assignment)
        except LookupError as error:
            findings.append(Finding(*assignment.place, f"{assignment.told}{error.args[0]}"))
    if findings:
        raise Findings(findings)


def merge_into(document: Document, top: Document) -> None:
    """Merge another file into `document` in place: mappings are joined, all other values replaced.

    Raises `Findings` for all values that have no place in it.
    """
    parts = []
    for path, value in _leaves(top.value):
        places = {p[len(path) :]: place for p, place in top.places.items() if p[: len(path)] == path}
        key = _dotted(path)
        parts.append(Assignment(key, Document(value, places), top.place(path), f"{key}: "))
    apply_assignments(document, parts)
    document.findings += top.findings
    document.unread |= top.unread


def _leaves(value: Value, path: Path = ()) -> Iterator[tuple[Path, Value]]:
    """Every value in `value` that is no mapping, with its path."""
    if isinstance(value, dict):
        for key, below in value.items():
            yield from _leaves(below, (*path, key))
    else:
        yield path, value


def _apply_one(document: Document, assignment: Assignment) -> None:
    path = _put(document, _steps(assignment.key), deepcopy(assignment.new.value))
    for old in [p for p in document.places if p[: len(path)] == path]:
        del document.places[old]
    document.unread -= {p for p in document.unread if p[: len(path)] == path}
    for length in range(1, len(path)):
        document.places.setdefault(path[:length], assignment.place)  # mappings that were added
    document.places.update({path + below: place for below, place in assignment.new.places.items()})
    document.unread |= {path + below for below in assignment.new.unread}


def _steps(key: str) -> list[str]:
    """The names in a dotted key; after `vary` the rest is a single name, with its dots."""
    first, *rest = key.split(".")
    return [first, ".".join(rest)] if first == "vary" and rest else [first, *rest]


def _put(document: Document, keys: list[str], value: Value) -> Path:
    """Store `value` and return its path; missing mappings on the way are added."""
    path: Path = ()
    spot = document.value
    for i, key in enumerate(keys):
        last = i == len(keys) - 1
        if isinstance(spot, list):
            index = _index(spot, key, path)
            path = (*path, index)
            if last:
                spot[index] = value
            spot = spot[index]
        elif isinstance(spot, dict):
            path = (*path, key)
            if last:
                spot[key] = value
            elif spot.get(key) is None:
                if _is_index(keys[i + 1]):
                    raise LookupError(_no_items(path))
                spot[key] = {}
            spot = spot[key]
        else:
            raise LookupError(f"{_dotted(path)} is a single value; it has no {quoted(key)}")
    return path


def _index(items: list[Value], key: str, path: Path) -> int:
    if not items:
        raise LookupError(_no_items(path))
    if not _is_index(key) or int(key) >= len(items):
        raise LookupError(f"no item {quoted(key)} in {_dotted(path)}; give a number from 0 to {len(items) - 1}")
    return int(key)


def _no_items(path: Path) -> str:
    return f"{_dotted(path)} is empty, so it has no item to change; set the whole list, {_dotted(path)}=[...]"


def _dotted(path: Path) -> str:
    return cut(".".join(map(str, path))) or "the file"
