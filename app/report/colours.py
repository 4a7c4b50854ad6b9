"""Colours of a report's pictures, light and dark.

A picture is drawn once, in the light colours, a colour for each use; a style sheet puts the dark ones in their place.
The colours of curves are those of Okabe and Ito, which colour-blind people tell apart.
"""

from collections.abc import Iterator
from dataclasses import fields, replace

from regrasp.trees.export.themes import THEMES, Theme

INK, MUTED, GRID = "#172033", "#566176", "#d9dee8"
BLUE, RED, GREEN, PURPLE, ORANGE = "#0072b2", "#d55e00", "#009e73", "#aa4a86", "#b97a00"
SERIES = (BLUE, RED, GREEN, PURPLE)  # of curves, in their order
_DARK = {
    INK: "#e8edf6",
    MUTED: "#a3afc4",
    GRID: "#2c3649",
    BLUE: "#56b4e9",
    RED: "#ff8a4c",
    GREEN: "#2fc79a",
    PURPLE: "#e39ccb",
    ORANGE: "#f0c04a",
}
# One colour a use: what is the same in light is not in dark.
TREE = replace(
    THEMES["light"],
    surface="#fffffe",
    icon="#fffffd",
    frame_line="#7d889c",
    kinds={**THEMES["light"].kinds, "subtree": "#5b6679"},
)


def stylesheet() -> str:
    """Rules for dark pages: each light colour of a picture, and what stands for it."""
    rules = [*_rules(".chart", _DARK), *_rules(".tree", dict(_tree_pairs(TREE, THEMES["dark"])))]
    return "@media screen and (prefers-color-scheme: dark) {\n" + "\n".join(rules) + "\n}\n"


def _rules(within: str, pairs: dict[str, str]) -> Iterator[str]:
    for light, dark in pairs.items():
        for attribute in ("fill", "stroke"):
            yield f'{within} [{attribute}="{light}"] {{ {attribute}: {dark}; }}'


def _tree_pairs(light: Theme, dark: Theme) -> Iterator[tuple[str, str]]:
    for field in fields(Theme):
        if field.name != "kinds":
            yield getattr(light, field.name), getattr(dark, field.name)
    for kind, colour in light.kinds.items():
        yield colour, dark.kinds[kind]
