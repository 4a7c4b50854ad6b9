"""A tree as SVG: one file, no script, no font or picture from elsewhere."""

from collections.abc import Mapping
from xml.sax.saxutils import escape, quoteattr

from regrasp.trees.export.picture import picture
from regrasp.trees.export.shapes import Curve, Drawing, Group, Lines, Rect, Shape
from regrasp.trees.export.themes import Theme
from regrasp.trees.graph import Node

_FONTS = "system-ui, -apple-system, 'Segoe UI', Roboto, 'Helvetica Neue', Arial, 'DejaVu Sans', sans-serif"


def to_svg(root: Node, theme: Theme, marks: Mapping[str, str] = {}) -> str:
    """The picture of the tree; a node's tooltip holds everything known about it.

    `marks` are words by the paths of nodes, which become `data-node` of what shows the node: for scripts and styles.
    """
    return _document(picture(root, theme), marks)


def _document(drawing: Drawing, marks: Mapping[str, str]) -> str:
    width, height = _px(drawing.width), _px(drawing.height)
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" viewBox="0 0 {width} {height}"'
        f' role="img" font-family="{_FONTS}">',
        f"<title>{escape(drawing.title)}</title>",
        f'<rect width="{width}" height="{height}" fill="{drawing.background}"/>',
        *(_group(group, marks.get(group.node, "")) for group in drawing.groups),
        "</svg>",
    ]
    return "\n".join(lines)


def _group(group: Group, mark: str) -> str:
    named = f" data-node={quoteattr(mark)}" if mark and group.node else ""
    title = f"<title>{escape(group.title)}</title>" if group.title else ""
    return f"<g{named}>{title}{''.join(map(_shape, group.shapes))}</g>"


def _shape(shape: Shape) -> str:
    if isinstance(shape, Rect):
        place = f'x="{_px(shape.x)}" y="{_px(shape.y)}" width="{_px(shape.width)}" height="{_px(shape.height)}"'
        return f'<rect {place} rx="{_px(shape.radius)}" fill="{shape.fill}"{_stroke(shape)}/>'
    if isinstance(shape, Curve):
        (x0, y0), *others = shape.points
        controls = " ".join(f"{_px(x)},{_px(y)}" for x, y in others)
        return f'<path d="M{_px(x0)},{_px(y0)} C{controls}" fill="none"{_stroke(shape)}/>'
    if isinstance(shape, Lines):
        points = " ".join(f"{_px(x)},{_px(y)}" for x, y in shape.points)
        ends = ' stroke-linecap="round" stroke-linejoin="round"'
        return f'<polyline points="{points}" fill="none"{_stroke(shape)}{ends}/>'
    weight = ' font-weight="600"' if shape.bold else ""
    place = f'x="{_px(shape.x)}" y="{_px(shape.y)}" font-size="{_px(shape.size)}"'
    return f"<text {place}{weight} fill={quoteattr(shape.colour)}>{escape(shape.text)}</text>"


def _stroke(shape: Rect | Curve | Lines) -> str:
    return f' stroke="{shape.stroke}" stroke-width="{_px(shape.stroke_width)}"' if shape.stroke_width else ""


def _px(value: float) -> str:
    return f"{value:.1f}".removesuffix(".0")
