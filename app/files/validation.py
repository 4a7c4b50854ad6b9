"""Validates plain values against a pydantic model; the errors become findings at file and line."""

import json
from functools import cache
from typing import NamedTuple, TypeVar

from pydantic import BaseModel, TypeAdapter, ValidationError
from pydantic_core import ErrorDetails

from regrasp.app.files.findings import Finding, Findings
from regrasp.app.files.model_errors import TAG_ERRORS, misspelt, model_errors
from regrasp.app.files.schema_nodes import Schema, child, nodes_at
from regrasp.app.files.yaml_lines import Document, Path
from regrasp.interfaces.quote import cut, nearest, quoted

M = TypeVar("M", bound=BaseModel)
T = TypeVar("T")
MAX_RESPELL_ROUNDS = 6  # each finds what is misspelt one level deeper; our files have fewer levels

_METRES = "metres, such as 0.3"
_LENGTHS = "size position zero earth jitter center seat base offset anchor length radius depth capture_distance"
_UNITS = dict.fromkeys(_LENGTHS.split(), _METRES) | {  # by the name of the key that holds the number
    "camera_position": _METRES,
    "baseline": _METRES,
    "seconds": "seconds, such as 1.5",
    "sim_seconds": "seconds, such as 600.0",
    "unintended_force": "newtons, such as 5.0",
    "pull_out_force": "newtons, such as 10.0",
    "hold_force": "newtons, such as 15.0",
    "max_force": "newtons, such as 40.0",
    "yaw_deg": "degrees, such as 30.0",
    "hue_deg": "degrees, such as 280.0",
    "tilt_deg": "degrees, such as 30.0",
    "angle_deg": "degrees, such as 5.0",
    "detection_delay": "seconds, such as 0.5",
    "sleep": "radians, such as 0.8",
    "carried": "shares of the way, such as 0.5",
    "at": "seconds, such as 5.0",
    "after": "seconds, such as 1.0",
    "by": _METRES,
    "speed": "metres a second, such as 0.25",
    "impulse": "newton seconds, such as 0.1",
    "stiffness": "newtons a metre, such as 100.0",
    "stiffness.zero": "newton square metres, such as 0.05",
    "stiffness.earth": "newton square metres, such as 0.16",
    "angle": "radians, such as 0.3",
}


class Error(NamedTuple):
    """An error of the value at `path`, and its kind."""

    path: Path
    finding: Finding
    is_misspelt: bool = False  # a key, corrected in the document
    is_missing: bool = False
    is_of_several: bool = False  # of several values of a mapping together, each valid by itself


@cache
def _schema(model: type[BaseModel]) -> Schema:
    return model.model_json_schema()


def read_as(document: Document, model: type[M]) -> tuple[M | None, list[Error]]:
    """The model's instance (None if there are errors) and all errors; strict: text is not taken for a number.

    Misspelt keys are corrected in `document`, so that their values are checked, too. Values that the document could
    not read, which are among its own findings, give no errors.
    """
    try:
        return model.model_validate_json(json.dumps(document.value), strict=True), []
    except ValidationError:
        root = _schema(model)
    errors, respelt = _respell(document, model, root)
    for error in model_errors(document.value, model, root):
        if error.path not in document.unread and error.path not in respelt:
            finding, is_missing = _finding(document, root, *error), error.details["type"] == "missing"
            errors.append(Error(error.path, finding, is_missing=is_missing, is_of_several=error.is_of_several))
    return None, errors


def _respell(document: Document, model: type[M], root: Schema) -> tuple[list[Error], set[Path]]:
    """Correct misspelt keys in the document; returns an error for each, and the new paths."""
    errors: list[Error] = []
    respelt: set[Path] = set()
    renamed: set[Path] = set()  # a key may be near two that are missing
    for _ in range(MAX_RESPELL_ROUNDS):
        for path, right in list(misspelt(document.value, model, root)):
            new = (*path[:-1], right)
            if new not in respelt and path not in renamed:
                message = f"unknown key {quoted(path[-1])}; did you mean {right!r}?"
                errors.append(Error(path, Finding(*document.place(path), message), is_misspelt=True))
                document.rename(path, right)
                respelt.add(new)
                renamed.add(path)
    return errors, respelt


def validated(document: Document, model: type[M]) -> M:
    """The model's instance. Raises `Findings` with every error."""
    made, errors = read_as(document, model)
    if made is None or document.findings:
        raise Findings([*document.findings, *(error.finding for error in errors)])
    return made


def validated_part(document: Document, path: Path, kind: TypeAdapter[T], default: T | None = None) -> T | None:
    """The value at `path`; `default` if there is none, None if it is not of this type."""
    value = document.value
    for step in path:
        held, value = child(value, step)
        if not held:
            return default
    try:
        return kind.validate_json(json.dumps(value), strict=True)
    except ValidationError:
        return None


def unit(key: str) -> str:
    """The unit of the numbers under a key of this name, in words; '' for none."""
    return _UNITS.get(key, "").partition(",")[0]


def _finding(document: Document, root: Schema, path: Path, error: ErrorDetails) -> Finding:
    kind, dotted = error["type"], _dotted(path)
    if kind == "missing" and path[-1:] == error["loc"][-1:]:
        where = f" in {_dotted(path[:-1])}" if path[1:] else ""
        message = f"key {path[-1]!r} is missing{where}; expected {_expected(document, root, path)}"
    elif kind in TAG_ERRORS:
        names = [str(schema["const"]) for schema in nodes_at(root, path, document.value)]
        said = f"no {quoted(error['ctx']['tag'])}; " if "tag" in error["ctx"] else "it is missing; "
        message = f"{dotted}: {said}{nearest(error['ctx'].get('tag', ''), names)}"
    elif kind == "extra_forbidden":
        keys = {key for schema in nodes_at(root, path[:-1], document.value) for key in schema.get("properties", {})}
        message = f"unknown key {quoted(path[-1])}; {nearest(str(path[-1]), keys)}"
    elif kind == "value_error":
        message = f"{dotted}: {error['msg'].removeprefix('Value error, ')}"
        return Finding(*document.place_of_whole(path), message)
    elif kind in ("literal_error", "enum") and isinstance(error["input"], str):
        nodes = nodes_at(root, path, document.value)
        names = [name for schema in nodes for name in schema.get("enum", [schema.get("const")])]
        message = f"{dotted}: no {quoted(error['input'])}; {nearest(error['input'], names)}"
    else:
        message = f"{dotted} is {_short(document, path)}; expected {_expected(document, root, path)}"
    return Finding(*document.place(path), message)


def _dotted(path: Path) -> str:
    return cut(".".join(map(str, path))) or "the file"


def _short(document: Document, path: Path) -> str:
    value = document.value
    for step in path:
        _, value = child(value, step)
    return "empty" if value is None else quoted(value)


def _expected(document: Document, root: Schema, path: Path) -> str:
    """What is expected at `path`, in words."""
    keys = [step for step in path if isinstance(step, str)]
    key = "" if not keys else ".".join(keys[-2:]) if ".".join(keys[-2:]) in _UNITS else keys[-1]
    nodes = nodes_at(root, path, document.value)
    kinds = [node["properties"]["type"]["const"] for node in nodes if "type" in node.get("properties", {})]
    if kinds:
        return f"a mapping with type: one of {', '.join(kinds)}"
    return ", or ".join(dict.fromkeys(_words(node, key) for node in nodes)) or "nothing"


def _words(node: Schema, key: str) -> str:
    if "const" in node or "enum" in node:
        return "one of " + ", ".join(map(str, node.get("enum", [node.get("const")])))
    kind = node.get("type")
    if kind == "array":
        items = node.get("prefixItems", [])
        what = _words(items[0], key) if items and "$ref" not in items[0] else ""
        many = f"{len(items)} values, each {what}" if what else _list_of(node.get("items", {}), key)
        return f"{many} of at least {node['minItems']} value" if not items and "minItems" in node else many
    if kind == "object":
        keys = ", ".join(node.get("properties", {}))
        return f"a mapping of {keys}" if keys else "a mapping"
    if kind == "string" and "pattern" in node:
        return f"text such as {node['examples'][0]!r}" if "examples" in node else f"text like {node['pattern']}"
    if kind in ("number", "integer"):
        unit = f" in {_UNITS[key]}" if key in _UNITS else ""
        return ("a whole number" if kind == "integer" else "a number") + unit + range_words(node)
    return {"boolean": "true or false", "string": "text"}.get(str(kind), "another value")


def _list_of(item: Schema, key: str) -> str:
    return f"a list, each item {_words(item, key)}" if item.get("type") == "number" else "a list"


def range_words(node: Schema) -> str:
    """A number's bounds, as " (at least 0, at most 3)"; '' if it has none."""
    bounds = {
        "above": node.get("exclusiveMinimum"),
        "at least": node.get("minimum"),
        "below": node.get("exclusiveMaximum"),
        "at most": node.get("maximum"),
        "a multiple of": node.get("multipleOf"),
    }
    words = [f"{name} {bound:.10g}" for name, bound in bounds.items() if bound is not None]
    return f" ({', '.join(words)})" if words else ""
