"""`--set key.path=value`: values from the command line laid over a parsed file."""

from collections.abc import Sequence

from app.findings import Finding, Findings
from app.yaml_lines import Document, Path, Value, parse

SOURCE = "--set"  # the file name of a finding in an override; its line is the override's number, from 1


def apply(document: Document, overrides: Sequence[tuple[int, str]]) -> None:
    """Lay (number, "key.path=value") pairs over `document` in place; list items go by index, values are YAML.

    Raises `Findings` for an override that cannot be read or placed. A key that the file does not know yet is added, so
    that the check of the whole file judges it.
    """
    findings: list[Finding] = []
    for number, text in overrides:
        try:
            _apply_one(document, number, text)
        except Findings as error:
            findings += error.items
        except LookupError as error:
            findings.append(Finding(SOURCE, number, f"{text!r}: {error.args[0]}"))
    if findings:
        raise Findings(findings)


def _apply_one(document: Document, number: int, text: str) -> None:
    key, equals, value = text.partition("=")
    keys = key.strip().split(".")
    if not equals or not all(keys):
        raise LookupError("expected key.path=value, such as limits.tries=2")
    new = parse(value, SOURCE, number)
    path = _put(document, keys, new.value)
    for old in [p for p in document.places if p[: len(path)] == path]:
        del document.places[old]
    document.places.update({path + below: place for below, place in new.places.items()})


def _put(document: Document, keys: list[str], value: Value) -> Path:
    """Store `value` and return its path; mappings on the way are made where the file has none."""
    path: Path = ()
    spot = document.value
    for i, key in enumerate(keys):
        last = i == len(keys) - 1
        if isinstance(spot, list):
            if not key.isdecimal() or int(key) >= len(spot):
                raise LookupError(f"{_dotted(path)} has {len(spot)} items, numbered from 0; there is no {key!r}")
            index = int(key)
            path = (*path, index)
            if last:
                spot[index] = value
            spot = spot[index]
        elif isinstance(spot, dict):
            path = (*path, key)
            if last:
                spot[key] = value
            elif spot.get(key) is None:
                spot[key] = {}
            spot = spot[key]
        else:
            raise LookupError(f"{_dotted(path)} is a single value, it has no {key!r}")
    return path


def _dotted(path: Path) -> str:
    return ".".join(map(str, path)) or "the file"
