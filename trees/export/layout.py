"""Lays out the boxes of a tree picture: the root at the left, children to the right of their parent, top to bottom.

A tidy tree after Reingold and Tilford ("Tidier Drawings of Trees", IEEE Transactions on Software Engineering 7(2),
1981): a parent stands at the middle of its children, and each child's whole tree moves up until it would touch what
stands above it. Boxes have sizes of their own and no columns, as in van der Ploeg ("Drawing Non-layered Tidy Trees in
Linear Time", Software: Practice and Experience 44(12), 2014). Contours are compared box by box, each pair once.

Lying on its side a tree of 60 nodes has about the shape of a screen, since names are wide and low.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

from regrasp.trees.graph import Node

BoxSize = Callable[[Node], tuple[float, float]]


@dataclass(frozen=True)
class Spacing:
    """Distances between boxes, px."""

    gap_x: float = 34.0  # between a box and its children, room for the links
    gap_y: float = 6.0  # between siblings
    gap_cousins: float = 12.0  # between boxes of different parents
    pad: float = 9.0  # between a subtree's frame and the boxes inside


_DEFAULTS = Spacing()


@dataclass(eq=False)
class NodeBox:
    """A node's rectangle in px, y downward. Of a SubTree that is shown: the frame round its tree, with a title."""

    node: Node
    x: float
    y: float
    width: float
    height: float
    title: float = 0.0  # height of a frame's title strip
    children: list["NodeBox"] = field(default_factory=list)

    @property
    def is_frame(self) -> bool:
        """Whether the children stand inside."""
        return self.node.kind == "subtree" and bool(self.children)

    @property
    def right(self) -> float:
        """The right edge."""
        return self.x + self.width

    @property
    def bottom(self) -> float:
        """The lower edge."""
        return self.y + self.height

    @property
    def top_node(self) -> "NodeBox":
        """The box that a link from above ends at: this one, or the top of the tree in the frame."""
        return self.children[0].top_node if self.is_frame else self

    @property
    def middle(self) -> float:
        """The height at which links arrive."""
        box = self.top_node
        return box.y + box.height / 2

    def walk(self) -> Iterator["NodeBox"]:
        """This box and all below it, a parent before its children."""
        yield self
        for child in self.children:
            yield from child.walk()


def lay_out(root: Node, size: BoxSize, spacing: Spacing = _DEFAULTS) -> NodeBox:
    """Place every node; `size` gives width and height of a node's box, px (of a shown SubTree: its frame's title)."""
    box = _place(root, 0.0, size, spacing)
    _move(box, -min(b.y for b in box.walk()))
    return box


def _place(node: Node, x: float, size: BoxSize, spacing: Spacing) -> NodeBox:
    width, height = size(node)
    if node.kind == "subtree" and node.children:
        return _frame(node, _place(node.children[0], x + spacing.pad, size, spacing), width, height, spacing.pad)
    children = [_place(child, x + width + spacing.gap_x, size, spacing) for child in node.children]
    _stack(children, spacing)
    middle = (children[0].middle + children[-1].middle) / 2 if children else 0.0
    return NodeBox(node, x, middle - height / 2, width, height, children=children)


def _frame(node: Node, inside: NodeBox, width: float, height: float, pad: float) -> NodeBox:
    boxes = list(inside.walk())
    x, y = inside.x - pad, min(b.y for b in boxes) - height
    right = max(max(b.right for b in boxes) + pad, x + width)
    return NodeBox(node, x, y, right - x, max(b.bottom for b in boxes) + pad - y, title=height, children=[inside])


def _stack(children: list[NodeBox], spacing: Spacing) -> None:
    """Move each child's tree under those before it, as near as their contours allow.

    Boxes nearer than `gap_x` in x count as one above the other: the links go between them.
    """
    above: list[NodeBox] = []
    for child in children:
        boxes = list(child.walk())
        shifts = (
            a.bottom + (spacing.gap_y if a in children and b is child else spacing.gap_cousins) - b.y
            for a in above
            for b in boxes
            if a.x < b.right + spacing.gap_x and b.x < a.right + spacing.gap_x
        )
        _move(child, max(shifts, default=0.0))
        above += boxes


def _move(box: NodeBox, dy: float) -> None:
    for b in box.walk():
        b.y += dy
