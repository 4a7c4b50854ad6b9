"""A plan of a task network as a tree: as a graph to be drawn, and as a tree file to be run."""

import xml.etree.ElementTree as ET
from copy import deepcopy
from pathlib import Path

from regrasp.behaviors.network.planner import Step
from regrasp.trees.graph import Node
from regrasp.trees.task_networks import TAG


def plan_graph(step: Step, parent: str = "", name: str = "") -> Node:
    """The network as it was broken down: a task is a sequence of what it was broken down into."""
    path = f"{parent}/{name or step.name}".lstrip("/")
    if step.method is None:
        return Node(path, step.name, "action", "action")
    children = [plan_graph(child, path, one) for child, one in zip(step.steps, _distinct(step.steps), strict=True)]
    return Node(path, f"{step.name}: {step.method}", "Sequence", "sequence", memory=True, children=tuple(children))


def plan_tree(tree: Path, step: Step, note: str) -> str:
    """A tree file, checked before, whose DoTask is replaced by sequences of its children, in the plan's order.

    What the plan does not need is left out; `note` is a comment at its head.

    Raises:
        ValueError: the tree has no DoTask, or several.
    """
    root = ET.parse(tree).getroot()
    nodes = [(parent, node) for parent in root.iter() for node in parent if node.tag == TAG]
    if len(nodes) != 1:
        raise ValueError(f"the tree has {len(nodes)} nodes {TAG}; a plan takes the place of one")
    ((parent, node),) = nodes
    written = _written(step, {child.get("name", ""): child for child in node}, node.get("name", step.name))
    parent[list(parent).index(node)] = written
    _drop_unused(root)
    ET.indent(root)
    return f"<!-- {note} -->\n{ET.tostring(root, encoding='unicode')}\n"


def _written(step: Step, actions: dict[str, ET.Element], name: str) -> ET.Element:
    if step.method is None:
        element = deepcopy(actions[step.name])
        element.set("name", name)
        return element
    element = ET.Element("Sequence", name=name, memory="true")
    steps = [child for child in step.steps if any(child.actions())]  # a sequence needs a child
    element.extend(_written(child, actions, one) for child, one in zip(steps, _distinct(steps), strict=True))
    return element


def _distinct(steps: list[Step]) -> list[str]:
    """A name for each of the steps that none of the others has."""
    names: list[str] = []
    for step in steps:
        count = sum(other.name == step.name for other in steps[: len(names)])
        names.append(step.name if not count else f"{step.name}_{count + 1}")
    return names


def _drop_unused(root: ET.Element) -> None:
    """Remove the BehaviorTrees that nothing includes any more, and defaults of keys that they no longer have."""
    trees = {tree.get("ID"): tree for tree in root}
    used, todo = set(), [root.get("main_tree_to_execute")]
    while todo:
        if (name := todo.pop()) in trees and name not in used:
            used.add(name)
            todo += [element.get("ID") for element in trees[name].iter("SubTree")]
    for name, tree in trees.items():
        if name not in used:
            root.remove(tree)
            continue
        keys = {value for element in tree.iter() if element is not tree for value in element.attrib.values()}
        for key in [key for key in tree.attrib if key != "ID" and f"{{{key}}}" not in keys]:
            del tree.attrib[key]
