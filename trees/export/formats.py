"""The export formats by name and by file suffix."""

from collections.abc import Callable

from regrasp.trees.export.dot import to_dot
from regrasp.trees.export.groot import to_groot
from regrasp.trees.export.json_text import to_json
from regrasp.trees.export.mermaid import to_mermaid
from regrasp.trees.export.svg import to_svg
from regrasp.trees.export.themes import THEMES, Theme
from regrasp.trees.graph import Node
from regrasp.trees.show import to_ascii


def _png(root: Node, theme: Theme) -> bytes:
    from regrasp.trees.export.png import to_png  # late: OpenCV takes a moment

    return to_png(root, theme)


FORMATS: dict[str, Callable[[Node, Theme], str | bytes]] = {
    "ascii": lambda root, _: to_ascii(root),
    "dot": to_dot,
    "groot": lambda root, _: to_groot(root),
    "json": lambda root, _: to_json(root),
    "mermaid": lambda root, _: to_mermaid(root),
    "png": _png,
    "svg": to_svg,
}
FORMAT_OF_SUFFIX = {
    ".txt": "ascii",
    ".dot": "dot",
    ".gv": "dot",
    ".xml": "groot",
    ".json": "json",
    ".mmd": "mermaid",
    ".mermaid": "mermaid",
    ".png": "png",
    ".svg": "svg",
}


def export_tree(root: Node, name: str, theme: str = "light") -> bytes:
    """The tree in the format of that name; text is UTF-8 and ends with a newline.

    Raises:
        KeyError: no such format or theme.
    """
    written = FORMATS[name](root, THEMES[theme])
    return written if isinstance(written, bytes) else f"{written}\n".encode()
