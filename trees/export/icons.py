"""The icon of each kind of node, drawn as lines, so that no font needs to hold it."""

from regrasp.trees.export.shapes import Lines, Point, Rect, Shape, Text
from regrasp.trees.export.text_width import text_width
from regrasp.trees.graph import Node

ICON_SIZE = 18.0  # px, square
_STAR = 7.0  # px that the star of memory adds to the width

_ARROW = (((4, 9), (14, 9)), ((10.2, 5.2), (14, 9), (10.2, 12.8)))
_STROKES = {
    "sequence": _ARROW,
    "parallel": (
        *(((4, 6.2), (14, 6.2)), ((11.4, 3.6), (14, 6.2), (11.4, 8.8))),
        *(((4, 11.8), (14, 11.8)), ((11.4, 9.2), (14, 11.8), (11.4, 14.4))),
    ),
    "control": (((4, 5), (14, 5)), ((4, 9), (14, 9)), ((4, 13), (14, 13))),
    "action": (((6.5, 4.8), (13, 9), (6.5, 13.2), (6.5, 4.8)),),
    "condition": (((9, 4), (14, 9), (9, 14), (4, 9), (9, 4)),),
    "subtree": (((5, 4.5), (5, 13), (13, 13)), ((5, 8), (13, 8))),
}
_LETTERS = {"fallback": "?", "decorator": "δ"}


def icon_width(node: Node) -> float:
    """The icon's width in px; a composite with memory has a star."""
    return ICON_SIZE + (_STAR if node.memory else 0.0)


def icon(node: Node, x: float, y: float, fill: str, ink: str) -> list[Shape]:
    """The icon with its upper left corner at x, y."""
    shapes: list[Shape] = [Rect(x, y, icon_width(node), ICON_SIZE, 4.0, fill, fill, 0.0)]
    for stroke in _STROKES.get(node.kind, ()):
        points: tuple[Point, ...] = tuple((x + px, y + py) for px, py in stroke)
        shapes.append(Lines(points, ink))
    if letter := _LETTERS.get(node.kind):
        shapes.append(Text(x + 9 - text_width("e", 13, bold=True) / 2 + 0.6, y + 13.6, letter, 13, ink, bold=True))
    if node.memory:
        shapes.append(Text(x + ICON_SIZE - 2.6, y + 14.4, "*", 14, ink, bold=True))
    return shapes
