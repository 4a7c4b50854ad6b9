"""Draws a tree: boxes with an icon, a name and details, links, frames around subtrees, and a legend."""

from dataclasses import replace
from typing import get_args

from regrasp.trees.export.icons import ICON_SIZE, icon, icon_width
from regrasp.trees.export.labels import details, tooltip
from regrasp.trees.export.layout import NodeBox, lay_out
from regrasp.trees.export.shapes import Curve, Drawing, Group, Rect, Shape, Text
from regrasp.trees.export.text_width import shortened, text_width
from regrasp.trees.export.themes import Theme, colour_of
from regrasp.trees.graph import Node, NodeKind
from regrasp.trees.run_stats import NodeStats

# Sizes in px. They fit one another: a change of one font size moves baselines and box heights.
_NAME_FONT, _DETAIL_FONT = 13.0, 10.5
_MAX_TEXT = 250.0  # a longer text is cut; the tooltip has it in full
_MARGIN = 18.0
_INSET = 4.0  # from the box to the icon
_LINE_STEP = 13.5  # from one line of details to the next
_BASELINE = 17.6  # of the name, below the box's top
_BARE_HEIGHT = ICON_SIZE + 2 * _INSET  # of a box with a name only


def picture(root: Node, theme: Theme) -> Drawing:
    """Draw the tree."""
    top = lay_out(root, _size)
    boxes = list(top.walk())
    for box in boxes:
        box.x += _MARGIN
        box.y += _MARGIN
    groups = [_frame(box, theme) for box in boxes if box.is_frame]
    groups += [_link(box, child, theme) for box in boxes if not box.is_frame for child in box.children]
    groups += [_node(box, theme) for box in boxes if not box.is_frame]
    width = max(box.right for box in boxes) + _MARGIN
    legend, width, height = _legend(root, width, max(box.bottom for box in boxes) + _MARGIN, theme)
    return Drawing(f"Behaviour tree {root.name}", width, height, theme.background, groups + legend)


def _texts(node: Node) -> list[tuple[str, float, bool, float, float]]:
    """Name and details as they fit: text, font size, bold, x from the text's left end, y from the box's top.

    Details stand below the name, which keeps inner nodes narrow. In frames, and in leaves with room for them, they
    stand beside it, which keeps the picture low.
    """
    is_frame = node.kind == "subtree" and bool(node.children)
    name = shortened(node.name, _NAME_FONT, _MAX_TEXT, bold=True)
    small = [shortened(line, _DETAIL_FONT, _MAX_TEXT * (2 if is_frame else 1)) for line in details(node)]
    x, y = text_width(name, _NAME_FONT, bold=True) + 7.0, _BASELINE
    lines = [(name, _NAME_FONT, True, 0.0, y)]
    fits = not node.children and len(small) == 1 and x + text_width(small[0], _DETAIL_FONT) <= _MAX_TEXT
    for line in small:
        if not (is_frame or fits):
            x, y = 0.0, y + _LINE_STEP
        lines.append((line, _DETAIL_FONT, False, x, y))
        x += text_width(line, _DETAIL_FONT) + 7.0
    return lines


def _size(node: Node) -> tuple[float, float]:
    lines = _texts(node)
    widest = max(x + text_width(text, size, bold) for text, size, bold, x, _ in lines)
    return _left(node) + widest + 9.0, lines[-1][-1] + _BARE_HEIGHT - _BASELINE


def _left(node: Node) -> float:
    """From the box's left edge to its text."""
    return _INSET + icon_width(node) + 6.0


def _node(box: NodeBox, theme: Theme) -> Group:
    node, colour = box.node, colour_of(box.node, theme)
    fill = theme.failed_surface if node.failed else theme.surface
    radius = _BARE_HEIGHT / 2 if node.kind == "condition" else 5.0
    body = Rect(box.x, box.y, box.width, box.height, radius, fill, colour, 2.2 if node.failed else 1.2)
    # A second box behind it shows that nodes are hidden.
    sheets = [replace(body, x=box.x + 3, y=box.y + 3), body] if node.hidden else [body]
    return Group((*sheets, *_content(box, theme)), tooltip(node), node.path)


def _frame(box: NodeBox, theme: Theme) -> Group:
    line = theme.failed if box.node.failed else theme.frame_line
    body = Rect(box.x, box.y, box.width, box.height, 8.0, theme.frame, line)
    return Group((body, *_content(box, theme)), tooltip(box.node))


def _content(box: NodeBox, theme: Theme) -> list[Shape]:
    """Icon and texts."""
    node = box.node
    ink = theme.muted if node.unvisited else theme.text
    shapes = icon(node, box.x + _INSET, box.y + _INSET, colour_of(node, theme), theme.icon)
    for text, size, bold, x, y in _texts(node):
        shapes.append(Text(box.x + _left(node) + x, box.y + y, text, size, ink if bold else theme.muted, bold))
    return shapes


def _link(parent: NodeBox, child: NodeBox, theme: Theme) -> Group:
    start, end = (parent.right, parent.y + parent.height / 2), (child.top_node.x, child.middle)
    failed = parent.node.failed and child.node.failed
    bend = child.x - parent.right
    controls = (start[0] + bend / 2, start[1]), (start[0] + bend / 2, end[1])
    colour = theme.failed if failed else theme.line
    return Group((Curve((start, *controls, end), colour, 2.2 if failed else 1.4),))


def _legend(root: Node, width: float, y: float, theme: Theme) -> tuple[list[Group], float, float]:
    """The icons that the picture uses, in lines from `y` on, and the picture's width and height with them."""
    nodes = list(root.walk())
    entries: list[tuple[Node, str]] = []
    for kind in get_args(NodeKind):
        for memory in (None, False, True):
            if any(n.kind == kind and n.memory is memory for n in nodes):
                words = {True: " with memory", False: " without memory", None: ""}[memory]
                entries.append((Node("", "", "", kind, memory), kind + words))
    if any(n.failed for n in nodes):
        entries.append((Node("", "", "", "action", failed=True), "path that failed"))
    if any(n.unvisited for n in nodes):
        entries.append((Node("", "", "", "action", stats=NodeStats()), "not visited"))
    groups, x = [], _MARGIN
    for sign, words in entries:
        wide = icon_width(sign) + 5 + text_width(words, _DETAIL_FONT) + 14
        if x > _MARGIN and x + wide > max(width, 480.0):
            x, y = _MARGIN, y + ICON_SIZE + 7
        shapes = icon(sign, x, y, colour_of(sign, theme), theme.icon)
        shapes.append(Text(x + icon_width(sign) + 5, y + 12.7, words, _DETAIL_FONT, theme.muted))
        groups.append(Group(tuple(shapes)))
        x += wide
        width = max(width, x)
    return groups, width, y + ICON_SIZE + _MARGIN
