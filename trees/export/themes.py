"""Colours of pictures. Contrast to the background is at least 4.5 for text and 3 for lines (WCAG 2.2 AA)."""

from collections.abc import Mapping
from dataclasses import dataclass

from regrasp.trees.graph import Node, NodeKind


@dataclass(frozen=True)
class Theme:
    """Colours as #rrggbb."""

    background: str
    surface: str  # of a node
    frame: str  # the background of a subtree
    frame_line: str
    text: str
    muted: str  # small text
    line: str  # links
    failed: str
    failed_surface: str
    icon: str  # drawn on the colour of its kind
    kinds: Mapping[NodeKind, str]


THEMES = {
    "light": Theme(
        background="#ffffff",
        surface="#ffffff",
        frame="#f3f5f9",
        frame_line="#7d889b",
        text="#172033",
        muted="#566176",
        line="#7d889b",
        failed="#c8102e",
        failed_surface="#fdecee",
        icon="#ffffff",
        kinds={
            "sequence": "#1f5fbf",
            "fallback": "#a1530a",
            "parallel": "#7a3fb5",
            "control": "#a3285f",
            "decorator": "#5b6678",
            "action": "#1a7446",
            "condition": "#0f7080",
            "subtree": "#5b6678",
        },
    ),
    "dark": Theme(
        background="#0f141d",
        surface="#1a2130",
        frame="#141a26",
        frame_line="#6b7890",
        text="#e8edf6",
        muted="#a3afc4",
        line="#7d8aa3",
        failed="#ff6b78",
        failed_surface="#3a1a22",
        icon="#0f141d",
        kinds={
            "sequence": "#76acff",
            "fallback": "#f2a65a",
            "parallel": "#c79bff",
            "control": "#ff8fc0",
            "decorator": "#a9b4c8",
            "action": "#62cf95",
            "condition": "#5ccbdc",
            "subtree": "#a9b4c8",
        },
    ),
}


def colour_of(node: Node, theme: Theme) -> str:
    """A node's colour: by kind, or red on the path that failed, grey for a node that was not visited."""
    if node.failed:
        return theme.failed
    return theme.line if node.unvisited else theme.kinds[node.kind]
