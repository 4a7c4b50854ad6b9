"""Where the boxes of a tree picture go: root at the left, children to the right of their parent, from top to bottom.

A tidy tree after Reingold and Tilford ("Tidier Drawings of Trees", IEEE Transactions on Software Engineering 7(2),
1981): a parent stands at the middle of its children, and each child's whole tree moves up until it would touch what
stands above it. Boxes have sizes of their own and no columns, as in van der Ploeg ("Drawing Non-layered Tidy Trees in
Linear Time", Software: Practice and Experience 44(12), 2014). Outlines are compared box by box, each pair once.

Lying on its side a tree of 60 nodes has about the shape of a screen, since names are wide and low.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

from regrasp.trees.graph import Node

GAP_X = 34.0  # px between a box and its children, room for the links
GAP_Y = 6.0  # px between siblings
GAP_COUSINS = 12.0  # px between boxes of different parents
PAD = 9.0  # px between a subtree's frame and what is in it

Size = Callable[[Node], tuple[float, float]]


@dataclass(eq=False)
class Box:
    """A node's rectangle in px, y downward. Of a SubTree that is shown: the frame round its tree, with a title."""

    node: Node
    x: float
    y: float
    width: float
    height: float
    title: float = 0.0  # height of a frame's title strip
    children: list["Box"] = field(default_factory=list)

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
    def top_node(self) -> "Box":
        """The box that a link from above ends at: this one, or the top of the tree in the frame."""
        return self.children[0].top_node if self.is_frame else self

    @property
    def middle(self) -> float:
        """The height at which links arrive."""
        box = self.top_node
        return box.y + box.height / 2

    def walk(self) -> Iterator["Box"]:
        """This box and all below it, a parent before its children."""
        yield self
        for child in self.children:
            yield from child.walk()


def lay_out(root: Node, size: Size) -> Box:
    """Place every node; `size` says how wide and high a node's box is (of a shown SubTree: its frame's title)."""
    box = _place(root, 0.0, size)
    _move(box, -min(b.y for b in box.walk()))
    return box


def _place(node: Node, x: float, size: Size) -> Box:
    width, height = size(node)
    if node.kind == "subtree" and node.children:
        return _frame(node, _place(node.children[0], x + PAD, size), width, height)
    children = [_place(child, x + width + GAP_X, size) for child in node.children]
    _stack(children)
    middle = (children[0].middle + children[-1].middle) / 2 if children else 0.0
    return Box(node, x, middle - height / 2, width, height, children=children)


def _frame(node: Node, inside: Box, width: float, height: float) -> Box:
    boxes = list(inside.walk())
    x, y = inside.x - PAD, min(b.y for b in boxes) - height
    right = max(max(b.right for b in boxes) + PAD, x + width)
    return Box(node, x, y, right - x, max(b.bottom for b in boxes) + PAD - y, title=height, children=[inside])


def _stack(children: list[Box]) -> None:
    """Move each child's tree under those before it, as near as their outlines let it.

    Boxes nearer than `GAP_X` in x count as one above the other: between them go the links.
    """
    above: list[Box] = []
    for child in children:
        boxes = list(child.walk())
        shifts = (
            a.bottom + (GAP_Y if a in children and b is child else GAP_COUSINS) - b.y
            for a in above
            for b in boxes
            if a.x < b.right + GAP_X and b.x < a.right + GAP_X
        )
        _move(child, max(shifts, default=0.0))
        above += boxes


def _move(box: Box, dy: float) -> None:
    for b in box.walk():
        b.y += dy
