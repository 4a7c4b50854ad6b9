"""The shapes that a picture is made of, in px, y downward; colours are #rrggbb."""

from dataclasses import dataclass, field

Point = tuple[float, float]


@dataclass(frozen=True)
class Rect:
    """A rectangle with round corners."""

    x: float
    y: float
    width: float
    height: float
    radius: float
    fill: str
    stroke: str
    stroke_width: float = 1.2


@dataclass(frozen=True)
class Curve:
    """A cubic Bézier curve: start, two control points, end."""

    points: tuple[Point, Point, Point, Point]
    stroke: str
    stroke_width: float = 1.4


@dataclass(frozen=True)
class Lines:
    """Straight lines from point to point."""

    points: tuple[Point, ...]
    stroke: str
    stroke_width: float = 1.6


@dataclass(frozen=True)
class Text:
    """One line of text; x, y is the left end of its baseline, size the font's in px."""

    x: float
    y: float
    text: str
    size: float
    colour: str
    bold: bool = False


Shape = Rect | Curve | Lines | Text


@dataclass(frozen=True)
class Group:
    """Shapes that belong together; the title is their tooltip, `node` the path of the node that they show."""

    shapes: tuple[Shape, ...]
    title: str = ""
    node: str = ""


@dataclass
class Drawing:
    """A whole picture; later groups cover earlier ones."""

    title: str
    width: float
    height: float
    background: str
    groups: list[Group] = field(default_factory=list)
