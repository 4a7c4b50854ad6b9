"""Plain values against a pydantic model, with pydantic's errors told as findings at file and line."""

import json
from collections import defaultdict
from collections.abc import Sequence
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from app.findings import Finding, Findings, nearest
from app.yaml_lines import Document, Path, Value

M = TypeVar("M", bound=BaseModel)
Schema = dict[str, Any]  # a node of the model's JSON schema

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
    "angle_deg": "degrees, such as 5.0",
    "detection_delay": "seconds, such as 0.5",
    "sleep": "radians, such as 0.8",
    "carried": "shares of the way from socket to clip, such as 0.5",
    "at": "seconds, such as 5.0",
    "after": "seconds, such as 1.0",
    "by": _METRES,
    "speed": "metres a second, such as 0.25",
    "impulse": "newton seconds, such as 0.1",
    "stiffness": "newtons a metre, such as 100.0",
    "angle": "radians, such as 0.3",
}


def validated(document: Document, model: type[M]) -> M:
    """The model's instance. Raises `Findings` with every error; strict: text is never taken for a number."""
    found = list(document.findings)
    try:
        made = model.model_validate_json(json.dumps(document.value), strict=True)
    except ValidationError as error:
        root = model.model_json_schema()
        errors = _best_branches(document.value, error.errors())
        found += [_finding(document, root, path, e) for path, e in errors if path not in document.unread]
    if found:
        raise Findings(found)
    return made


def unit(key: str) -> str:
    """The unit of the numbers under a key of this name, in words; '' for none."""
    return _UNITS.get(key, "").partition(",")[0]


def _child(value: Value, step: str | int) -> tuple[bool, Value]:
    """Whether `value` holds `step`, and what stands there."""
    if isinstance(value, dict) and isinstance(step, str) and step in value:
        return True, value[step]
    if isinstance(value, list) and isinstance(step, int) and step < len(value):
        return True, value[step]
    return False, value


def _split(value: Value, loc: Sequence[str | int]) -> tuple[Path, Path]:
    """Pydantic's location as the path that the file has, and the steps it has not: union branches, missing keys."""
    path: Path = ()
    beside: Path = ()
    for step in loc:
        held, value = _child(value, step)
        path, beside = ((*path, step), beside) if held else (path, (*beside, step))
    return path, beside


def _best_branches(value: Value, errors: list[ErrorDetails]) -> list[tuple[Path, ErrorDetails]]:
    """Each error with its path in the file; of a union's branches only the one with the fewest errors, at a tie the one
    that reads furthest."""
    unions: dict[Path, dict[str | int, list[tuple[Path, ErrorDetails]]]] = defaultdict(lambda: defaultdict(list))
    kept = []
    for error in errors:
        path, beside = _split(value, error["loc"])
        if len(beside) > (error["type"] == "missing"):  # what is missing stands last in `beside`
            spot = error["loc"][: error["loc"].index(beside[0])]
            unions[spot][beside[0]].append((path, error))
        else:
            kept.append((path, error))
    return kept + [e for branches in unions.values() for e in min(branches.values(), key=_badness)]


def _badness(errors: list[tuple[Path, ErrorDetails]]) -> tuple[int, int, bool]:
    """Lower for the branch that was meant; an error of our own validators comes only after the type was right."""
    kinds = {error["type"] for _, error in errors}
    return len(errors), -max(len(error["loc"]) for _, error in errors), "value_error" not in kinds


def _finding(document: Document, root: Schema, path: Path, error: ErrorDetails) -> Finding:
    kind, last = error["type"], error["loc"][-1:]
    dotted = ".".join(map(str, path))
    if kind == "missing" and isinstance(last[0], str):
        expected = _expected(document, root, (*path, last[0]))
        where = f" in {dotted}" if dotted else ""
        message = f"key {last[0]!r} is missing{where}; expected {expected}"
    elif kind in ("union_tag_invalid", "union_tag_not_found"):
        path = (*path, error["ctx"]["discriminator"].strip("'"))
        names = [str(schema["const"]) for schema in _at(root, path, document.value)]
        said = f"no {error['ctx']['tag']!r}; " if "tag" in error["ctx"] else "it is missing; "
        message = f"{'.'.join(map(str, path))}: {said}{nearest(error['ctx'].get('tag', ''), names)}"
    elif kind == "extra_forbidden":
        keys = {key for schema in _at(root, path[:-1], document.value) for key in schema.get("properties", {})}
        message = f"unknown key {str(path[-1])!r}; {nearest(str(path[-1]), keys)}"
    elif kind == "value_error":
        message = f"{dotted or 'the file'}: {error['msg'].removeprefix('Value error, ')}"
    elif kind in ("literal_error", "enum") and isinstance(error["input"], str):
        names = [
            name for schema in _at(root, path, document.value) for name in schema.get("enum", [schema.get("const")])
        ]
        message = f"{dotted}: no {error['input']!r}; {nearest(error['input'], names)}"
    else:
        message = f"{dotted or 'the file'} is {_short(document, path)}; expected {_expected(document, root, path)}"
    return Finding(*document.place(path), message)


def _short(document: Document, path: Path) -> str:
    value = document.value
    for step in path:
        _, value = _child(value, step)
    text = "empty" if value is None else repr(value)
    return text if len(text) <= 60 else text[:57] + "..."


def _at(root: Schema, path: Path, value: Value) -> list[Schema]:
    """The schema nodes that describe what is at `path` in `value`; several where the model has a union."""
    nodes = alternatives(root, root)
    for step in path:
        nodes = _of_type(nodes, value)
        _, value = _child(value, step)
        below = []
        for node in nodes:
            if isinstance(step, int):
                items = node.get("prefixItems", [])
                below.append(items[step] if step < len(items) else node.get("items"))
            else:
                below.append(node.get("properties", {}).get(step, node.get("additionalProperties")))
        nodes = [opened for node in below if isinstance(node, dict) for opened in alternatives(root, node)]
    return _of_type(nodes, value)


def _of_type(nodes: list[Schema], value: Value) -> list[Schema]:
    """Of a union's nodes told apart by `type`, the one that the value names; all where it names none."""
    kind = value.get("type") if isinstance(value, dict) else None
    return [n for n in nodes if n.get("properties", {}).get("type", {}).get("const") == kind] or nodes


def alternatives(root: Schema, node: Schema) -> list[Schema]:
    """Follow references and unions to the nodes that say something."""
    if "$ref" in node:
        return alternatives(root, root["$defs"][node["$ref"].rsplit("/", 1)[1]])
    if options := node.get("anyOf", node.get("oneOf")):
        return [opened for option in options for opened in alternatives(root, option)]
    return [] if node.get("type") == "null" else [node]


def _expected(document: Document, root: Schema, path: Path) -> str:
    """What would be right at `path`, in words."""
    key = next((step for step in reversed(path) if isinstance(step, str)), "")
    nodes = _at(root, path, document.value)
    kinds = [node["properties"]["type"]["const"] for node in nodes if "type" in node.get("properties", {})]
    if kinds:
        return f"a mapping with type: one of {', '.join(kinds)}"
    return ", or ".join(dict.fromkeys(_words(node, key) for node in nodes)) or "nothing"


def _words(node: Schema, key: str) -> str:
    if "const" in node or "enum" in node:
        return "one of " + ", ".join(node.get("enum", [node.get("const")]))
    kind = node.get("type")
    if kind == "array":
        items = node.get("prefixItems", [])
        what = _words(items[0], key) if items and "$ref" not in items[0] else ""
        many = f"{len(items)} values, each {what}" if what else "a list"
        return f"{many} of at least {node['minItems']} value" if not items and "minItems" in node else many
    if kind == "object":
        keys = ", ".join(node.get("properties", {}))
        return f"a mapping of {keys}" if keys else "a mapping"
    if kind == "string" and "pattern" in node:
        return f"text such as {node['examples'][0]!r}"
    if kind in ("number", "integer"):
        unit = f" in {_UNITS[key]}" if key in _UNITS else ""
        return ("a whole number" if kind == "integer" else "a number") + unit + range_words(node)
    return {"boolean": "true or false", "string": "text"}.get(str(kind), "another value")


def range_words(node: Schema) -> str:
    """A number's bounds, as " (at least 0, at most 3)"; '' where there are none."""
    bounds = {
        "above": node.get("exclusiveMinimum"),
        "at least": node.get("minimum"),
        "below": node.get("exclusiveMaximum"),
        "at most": node.get("maximum"),
        "a multiple of": node.get("multipleOf"),
    }
    words = [f"{name} {bound:.10g}" for name, bound in bounds.items() if bound is not None]
    return f" ({', '.join(words)})" if words else ""
