"""Where a path of a file leads in the JSON schema of its model."""

from typing import Any

from regrasp.app.files.yaml_lines import Path, Value

Schema = dict[str, Any]  # a node of the schema


def child(value: Value, step: str | int) -> tuple[bool, Value]:
    """Whether `value` holds `step`, and what stands there; `value` itself where nothing does."""
    if isinstance(value, dict) and isinstance(step, str) and step in value:
        return True, value[step]
    if isinstance(value, list) and isinstance(step, int) and step < len(value):
        return True, value[step]
    return False, value


def value_at(value: Value, path: Path) -> Value:
    """What stands at `path`; None where nothing does."""
    for step in path:
        held, value = child(value, step)
        if not held:
            return None
    return value


def nodes_at(root: Schema, path: Path, value: Value) -> list[Schema]:
    """The schema nodes that describe what is at `path` in `value`; several where the model has a union."""
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
