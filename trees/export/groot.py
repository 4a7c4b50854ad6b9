"""A tree as BehaviorTree.CPP v4 XML with its TreeNodesModel, which Groot2 opens.

Elements with a counterpart there become it: with memory Sequence and Fallback, without memory ReactiveSequence and
ReactiveFallback. Decorators without a counterpart, and all leaves, are declared in the model. The default keys of a
tree become ports of its model; those of the main tree, which no SubTree includes, are replaced by their values.
"""

from xml.etree import ElementTree as ET

from regrasp.trees.graph import Node, NodePort

_BUILT_IN = {"ForceFailure", "ForceSuccess", "Inverter", "Repeat", "RetryUntilSuccessful", "RunOnce"}
_RENAMED = {
    "Retry": ("RetryUntilSuccessful", {"num_failures": "num_attempts"}),
    "Repeat": ("Repeat", {"num_success": "num_cycles"}),
    "Inverter": ("Inverter", {}),
    "FailureIsSuccess": ("ForceSuccess", {}),
    "SuccessIsFailure": ("ForceFailure", {}),
    "Condition": ("StatusCondition", {}),  # "Condition" there means a leaf that returns at once
}
_TYPES = {"str": "std::string", "float": "double", "int": "int", "bool": "bool"}


def to_groot(root: Node) -> str:
    """The document. A run's stats become descriptions. Takes a whole tree, not a collapsed one."""
    document = ET.Element("root", {"BTCPP_format": "4", "main_tree_to_execute": root.tree})
    for identifier, tops in _trees(root).items():
        tree = ET.SubElement(document, "BehaviorTree", {"ID": identifier})
        tree.append(_element(tops, is_main=identifier == root.tree))
    document.append(_model(root))
    ET.indent(document)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + ET.tostring(document, encoding="unicode")


def _trees(root: Node) -> dict[str, list[Node]]:
    """Each tree's ID and the top nodes of all its instances."""
    tops = {root.tree: [root]}
    for node in root.walk():
        if node.kind == "subtree" and node.children:
            tops.setdefault(node.subtree, []).append(node.children[0])
    return tops


def _element(instances: list[Node], is_main: bool) -> ET.Element:
    """The element for all `instances` of a node: its tree is written once, however often it is included."""
    node = instances[0]
    tag, ports = _tag_and_attributes(node, is_main)
    subtree = {"ID": node.subtree} if node.kind == "subtree" else {}
    element = ET.Element(tag, subtree | {"name": node.name} | ports)
    descriptions = [f"{n.path}: {n.stats.text}{' (failed here)' if n.failed else ''}" for n in instances if n.stats]
    if descriptions:
        element.set("_description", "; ".join(descriptions))
    if node.kind != "subtree":
        element.extend(_element(list(same), is_main) for same in zip(*(n.children for n in instances), strict=False))
    return element


def _tag_and_attributes(node: Node, is_main: bool) -> tuple[str, dict[str, str]]:
    """The element's name there, and its attributes."""
    ports = {port.name: _value(port, is_main) for port in node.given}
    if node.kind in ("sequence", "fallback"):
        name = node.kind.capitalize()
        return (name if node.memory else f"Reactive{name}"), ports
    if node.kind == "parallel":  # one failure ends it, as in py_trees
        successes = "1" if node.policy == "success_on_one" else "-1"
        return "Parallel", {"success_count": successes, "failure_count": "1"}
    if node.type == "OneShot" and node.policy == "on_completion":
        return "RunOnce", {"then_skip": "false"}
    tag, names = _RENAMED.get(node.type, (node.type, {}))
    policy = {"policy": node.policy} if node.policy else {}
    return tag, {names.get(name, name): value for name, value in ports.items()} | policy


def _value(port: NodePort, is_main: bool) -> str:
    return port.constant if is_main and port.constant is not None else str(port.value)


def _model(root: Node) -> ET.Element:
    """The TreeNodesModel: leaves, composites and decorators that Groot2 does not know, and the keys of subtrees."""
    entries: dict[tuple[str, str], Node] = {}
    for node in root.walk():
        word = node.subtree or _tag_and_attributes(node, False)[0]
        if node.kind in ("action", "condition", "control", "subtree") or (
            node.kind == "decorator" and word not in _BUILT_IN
        ):
            kind = "SubTree" if node.kind == "subtree" else node.kind.capitalize()
            entries.setdefault((kind, word), node)
    model = ET.Element("TreeNodesModel")
    for (kind, word), node in sorted(entries.items(), key=lambda entry: entry[0]):
        entry = ET.SubElement(model, kind, {"ID": word})
        entry.extend(_port(port) for port in sorted(node.ports, key=lambda port: port.name))
        if node.policy:
            entry.append(_port(NodePort("policy")))
    return model


def _port(port: NodePort) -> ET.Element:
    attributes = {"name": port.name, "type": _TYPES.get(port.type, "BT::AnyTypeAllowed")}
    if port.default is not None:
        attributes["default"] = port.default
    return ET.Element(f"{port.direction}_port", attributes)
