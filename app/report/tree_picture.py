"""The tree of a run as a picture whose nodes a script can find, and each node's changes."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from markupsafe import Markup

from regrasp.app.files.findings import Findings
from regrasp.app.files.resources import read_text
from regrasp.app.records.reader import RunRecord, Tick
from regrasp.app.report.colours import TREE
from regrasp.trees import Node, TreeSyntaxError, read_graph
from regrasp.trees.export.svg import to_svg

PAGE_WIDTH, LEAST_SCALE = 1060.0, 0.72  # px, and how much smaller than drawn a picture may become
MAX_DRAWN = 400  # nodes; choice: a larger picture shows nothing
LETTERS = {"RUNNING": "r", "SUCCESS": "s", "FAILURE": "f", "INVALID": "i"}


@dataclass(frozen=True)
class TreePicture:
    """The picture ('' if there is none), the paths of its nodes in their order, and remarks on what is missing.

    `damage` is a remark where the record's tree cannot be read.
    """

    svg: Markup
    paths: tuple[str, ...]
    phases: Mapping[str, str]  # of a leaf's path the outermost SubTree that it is in, by its own name
    damage: tuple[str, ...] = ()
    remarks: tuple[str, ...] = ()


def tree_picture(record: RunRecord) -> TreePicture:
    """The tree that ran, by the record's copy, or, where that cannot be read, by the paths in its ticks."""
    node, damage = _graph(record)
    if node is None:
        return TreePicture(Markup(), (), {}, damage)
    nodes = [one for one in node.walk() if one.kind != "subtree" or not one.children]
    if len(nodes) > MAX_DRAWN:
        remark = f"the tree has {len(nodes)} nodes, which is too many for a picture here; regrasp trees export draws it"
        return TreePicture(Markup(), (), _phases(node), damage, (remark,))
    paths = tuple(one.path for one in nodes)
    svg = to_svg(node, TREE, {path: str(number) for number, path in enumerate(paths)})
    return TreePicture(Markup(_fitted(svg)), paths, _phases(node), damage)  # the export escapes texts of the file


def _fitted(svg: str) -> str:
    """The picture as wide as the page, but not so small that its letters cannot be read."""
    size = re.search(r' width="([\d.]+)" height="([\d.]+)"', svg)
    assert size is not None
    width, height = float(size[1]), float(size[2])
    scale = min(1.0, max(LEAST_SCALE, PAGE_WIDTH / width))
    return svg.replace(size[0], f' width="{width * scale:.0f}" height="{height * scale:.0f}"', 1)


def _graph(record: RunRecord) -> tuple[Node | None, tuple[str, ...]]:
    path = record.folder / "tree.xml"
    inputs = record.begin.get("inputs")
    try:
        read_text(path)  # its findings are ours
        return read_graph(path, inputs=_texts(inputs) if isinstance(inputs, dict) else {}), ()
    except (Findings, TreeSyntaxError, OSError, ValueError) as error:
        why = str(error).splitlines()[0]
        of_ticks = _of_paths(record.ticks)
        instead = "drawn by the nodes in its ticks" if of_ticks else "not drawn"
        return of_ticks, (f"tree.xml cannot be read ({why}); the tree is {instead}",)


def _texts(inputs: dict[str, Any]) -> dict[str, str]:
    """The inputs as a tree file has them."""
    if not inputs:
        return {}
    from regrasp.app.scenario.references import tree_text  # late: it brings all of scenarios

    return {key: tree_text(value) for key, value in inputs.items()}


def _of_paths(ticks: Sequence[Tick]) -> Node | None:
    """A tree of plain nodes by their paths; None without ticks, or where there is no single root."""
    paths = sorted({tick.path for tick in ticks}, key=lambda path: path.split("/"))
    if not paths or len(paths) > MAX_DRAWN or any(not path.startswith(f"{paths[0]}/") for path in paths[1:]):
        return None
    above: dict[str, list[str]] = {path: [] for path in paths}
    for path in paths[1:]:
        parent = path.rpartition("/")[0]
        while parent not in above:  # a subtree's name is no node of a run
            parent = parent.rpartition("/")[0]
        above[parent].append(path)
    return _plain_node(paths[0], above)


def _plain_node(path: str, below: Mapping[str, Sequence[str]]) -> Node:
    children = tuple(_plain_node(child, below) for child in below[path])
    made = Node(path, path.rpartition("/")[2], "", "sequence" if children else "action")
    return replace(made, type=made.name, children=children)


def _phases(node: Node, phase: str = "") -> dict[str, str]:
    """Of each leaf the outermost SubTree that it is in, or its own name."""
    if not node.children:
        return {node.path: phase or node.name}
    inside = phase or (node.name if node.kind == "subtree" else "")
    return {path: name for child in node.children for path, name in _phases(child, inside).items()}


def changes(ticks: Sequence[Tick], paths: Sequence[str]) -> list[list[Any]]:
    """Of each node, in the order of `paths`, its changes of status: second, letter, second, letter, ..."""
    found: dict[str, list[Any]] = {path: [] for path in paths}
    for tick in ticks:
        own, letter = found.get(tick.path), LETTERS[tick.status]
        if own is None or (own and own[-1] == letter):
            continue
        if own and own[-2] == round(tick.t, 3):
            own[-1] = letter
        else:
            own += [round(tick.t, 3), letter]
    return [*found.values()]
