"""The task networks that a tree's DoTask nodes name."""

from pathlib import Path
from typing import Any

import yaml

from regrasp.interfaces.task_network import TaskNetwork
from regrasp.trees.element import Element, read_elements

TAG = "DoTask"
_SHIPPED = Path(__file__).parent / "networks"


def network_nodes(tree: Path) -> list[Element]:
    """The DoTask elements of a tree file. Raises as `read_elements`."""
    return [element for element in read_elements(tree).walk() if element.tag == TAG]


def networks_named_in(tree: Path) -> dict[str, TaskNetwork]:
    """The networks that a tree file, checked before, names: by these names, which are shipped ones' or paths from it.

    Raises:
        OSError: there is none.
        ValueError: one is not right.
    """
    found = {}
    for name in {element.attributes["network"] for element in network_nodes(tree)}:
        path = tree.parent / name if name.endswith(".yaml") else _SHIPPED / f"{name}.yaml"
        found[name] = TaskNetwork.model_validate(_plain(path))
    return found


def _plain(path: Path) -> Any:
    """A file's plain values; the C loader is ten times as fast, and not in every build."""
    return yaml.load(path.read_text(encoding="utf-8"), getattr(yaml, "CSafeLoader", yaml.SafeLoader))
