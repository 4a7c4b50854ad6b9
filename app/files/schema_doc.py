"""Writes a JSON schema as a reference in Markdown: a table for each object, a row for each field."""

import json
from collections.abc import Iterator
from typing import Any

from regrasp.app.files.schema_nodes import Schema, alternatives
from regrasp.app.files.validation import range_words, unit

_HEADER = "| field | type | unit | default | meaning | example |\n|---|---|---|---|---|---|"


def markdown(root: Schema) -> str:
    """The reference. Objects within others are headed by their dotted path, in which `[]` stands for an item's number.

    Sections that a union's members share appear once.
    """
    return "\n".join(dict.fromkeys(_object(root, root, "")))


def _object(root: Schema, node: Schema, path: str) -> Iterator[str]:
    """The section of an object, then those of the objects in it."""
    kind = node["properties"].get("type", {}).get("const")
    title = (f"`{path}`" if path else "A scenario file") + (f" of type {kind}" if kind else "")
    rows = [
        _row(root, name, field, required=name in node.get("required", [])) for name, field in node["properties"].items()
    ]
    yield "\n".join([f"## {title}\n\n{_line(node.get('description', ''))}\n\n{_HEADER}", *rows, ""])
    for name, field in node["properties"].items():
        for below, step in _objects(root, field):
            yield from _object(root, below, f"{path}.{name}{step}".removeprefix("."))


def _objects(root: Schema, field: Schema) -> Iterator[tuple[Schema, str]]:
    """The objects in a field, each with the end of its path after the field's."""
    for node in alternatives(root, field):
        if "properties" in node:
            yield node, ""
        if isinstance(node.get("items"), dict):
            yield from ((below, "[]" + step) for below, step in _objects(root, node["items"]))
        if isinstance(node.get("additionalProperties"), dict):
            yield from ((below, ".KEY" + step) for below, step in _objects(root, node["additionalProperties"]))


def _row(root: Schema, name: str, field: Schema, required: bool) -> str:
    default = "required" if required else _default(field.get("default"))
    examples = field.get("examples", [])
    example = _code(examples[0]) if examples else ""
    cells = (f"`{name}`", _types(root, field), unit(name), default, _line(field.get("description", "")), example)
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


def _default(value: Any) -> str:
    """A default for its table cell; '' for an object, which has a table of its own."""
    return "" if value is None or isinstance(value, dict) else _code(value)


def _types(root: Schema, field: Schema) -> str:
    return " or ".join(dict.fromkeys(_type(root, node) for node in alternatives(root, field)))


def _type(root: Schema, node: Schema) -> str:
    if "const" in node or "enum" in node:
        return ", ".join(f"`{word}`" for word in node.get("enum", [node.get("const")]))
    kind = str(node.get("type", "any value"))
    if kind == "array" and "prefixItems" in node:
        return f"{len(node['prefixItems'])} x {_types(root, node['prefixItems'][0])}"
    if kind == "array":
        return f"list of {_types(root, node.get('items', {}))}"
    if kind == "object" and isinstance(node.get("additionalProperties"), dict):
        return f"names with {_types(root, node['additionalProperties'])}"
    words = {"object": "mapping", "string": "text", "integer": "whole number", "boolean": "true or false"}
    return words.get(kind, kind) + range_words(node)


def _code(value: Any) -> str:
    return f"`{json.dumps(value, ensure_ascii=False)}`"


def _line(text: str) -> str:
    return " ".join(text.split())
