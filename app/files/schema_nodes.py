"""Finds values, and their nodes in the JSON schema of a model, by path."""

from typing import Any

from regrasp.app.files.yaml_lines import Path, Value

Schema = dict[str, Any]  # a node of the schema


def child(value: Value, step: str | int) -> tuple[bool, Value]:
    """Whether `value` has the key or index `step`, and the value there; `value` itself if it has not."""
    if isinstance(value, dict) and isinstance(step, str) and step in value:
        return True, value[step]
    if isinstance(value, list) and isinstance(step, int) and step < len(value):
        return True, value[step]
    return False, value


def value_at(value: Value, path: Path) -> Value:
    """The value at `path`; None if there is none."""
    for step in path:
        held, value = child(value, step)
        if not held:
            return None
    return value


def nodes_at(root: Schema, path: Path, value: Value) -> list[Schema]:
    """The schema nodes of what is at `path` in `value`; several if the model has a union there."""
    nodes = alternatives(root, root)
    for step in path:
        nodes = _of_type(nodes, value)
        _, value = child(value, step)
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
    """The node of a tagged union that the value's `type` names; all nodes if it names none."""
    kind = value.get("type") if isinstance(value, dict) else None
    return [n for n in nodes if n.get("properties", {}).get("type", {}).get("const") == kind] or nodes


def alternatives(root: Schema, node: Schema) -> list[Schema]:
    """Resolve references and unions to plain nodes."""
    if "$ref" in node:
        return alternatives(root, root["$defs"][node["$ref"].rsplit("/", 1)[1]])
    if options := node.get("anyOf", node.get("oneOf")):
        return [opened for option in options for opened in alternatives(root, option)]
    return [] if node.get("type") == "null" else [node]
