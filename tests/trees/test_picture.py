from xml.etree import ElementTree as ET

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from random_nodes import TEXTS, nodes
from test_golden import features, features_with_run

from regrasp.trees import Node, collapsed
from regrasp.trees.export import THEMES, export_tree
from regrasp.trees.export.picture import picture
from regrasp.trees.export.shapes import Rect, Text
from regrasp.trees.export.text_width import shortened, text_width

LIGHT, SVG = THEMES["light"], "{http://www.w3.org/2000/svg}"
ASCII = "".join(map(chr, range(32, 127)))


@given(nodes)
@settings(max_examples=50)
def test_texts_stay_within_their_boxes_and_all_within_the_picture(node: Node) -> None:
    drawing = picture(node, LIGHT)
    for group in drawing.groups:
        body = next((s for s in group.shapes if isinstance(s, Rect)), None)
        for text in (s for s in group.shapes if isinstance(s, Text)):
            right = text.x + text_width(text.text, text.size, text.bold)
            assert right <= drawing.width
            assert text.y <= drawing.height
            if body and group.title:
                assert body.x < text.x
                assert right <= body.x + body.width
                assert body.y < text.y - 0.7 * text.size
                assert text.y + 0.2 * text.size < body.y + body.height


@pytest.mark.parametrize("bold", [False, True])
def test_the_estimate_of_a_width_is_an_upper_bound_for_a_real_font(bold: bool) -> None:
    font = cv2.FontFace("sans")
    for text in [c * 20 for c in ASCII] + [ASCII, "δ" * 20, "…" * 20, "漢" * 20]:
        x, _, width, _ = cv2.getTextSize((0, 0), text, (0, 0), font, 40, 600 if bold else 400)
        assert x + width <= text_width(text, 40, bold), text


@given(TEXTS)
def test_a_text_is_cut_only_where_it_is_too_wide(text: str) -> None:
    cut = shortened(text, 10, 150)
    assert text_width(cut, 10) <= 150
    assert cut == text or (cut.endswith("…") and text.startswith(cut[:-1]))


@given(nodes)
@settings(max_examples=50)
def test_svg_is_xml_with_a_tooltip_for_each_node_and_nothing_from_elsewhere(node: Node) -> None:
    text = export_tree(node, "svg", "dark").decode()
    root = ET.fromstring(text)
    titles = [title for group in root.iter(f"{SVG}g") for title in group.iter(f"{SVG}title")]
    assert len(titles) == sum(1 for _ in node.walk())
    assert not {e.tag for e in root.iter()} & {f"{SVG}script", f"{SVG}image", f"{SVG}style", f"{SVG}a"}
    assert not any(name.endswith(("href", "style")) for e in root.iter() for name in e.attrib)


@pytest.mark.parametrize("theme", THEMES)
@pytest.mark.parametrize(
    "node", [features(), features_with_run(), collapsed(features(), 0)], ids=["plain", "run", "cut"]
)
def test_png_shows_the_picture(node: Node, theme: str) -> None:
    image = cv2.imdecode(np.frombuffer(export_tree(node, "png", theme), np.uint8), cv2.IMREAD_COLOR)
    drawing = picture(node, THEMES[theme])
    assert image is not None
    assert abs(image.shape[1] - 2 * drawing.width) <= 2
    assert abs(image.shape[0] - 2 * drawing.height) <= 2
    assert len(np.unique(image[:, :, 0])) > 50  # smooth edges
    for group in drawing.groups:
        if group.title:
            body = next(s for s in reversed(group.shapes) if isinstance(s, Rect) and s.width > 30)
            # Just inside the right edge there is no text.
            x, y = int(2 * (body.x + body.width - 4)), int(2 * (body.y + body.height / 2))
            assert tuple(image[y, x]) == tuple(bytes.fromhex(body.fill[1:]))[::-1], group.title


def test_a_huge_picture_gets_coarser_not_larger() -> None:
    leaf = Node("leaf", "leaf", "Leaf", "action")
    tall = Node("root", "root", "Sequence", "sequence", children=(leaf,) * 1000)
    for _ in range(30):
        tall = Node("root", "root", "Inverter", "decorator", children=(tall,))
    image = cv2.imdecode(np.frombuffer(export_tree(tall, "png"), np.uint8), cv2.IMREAD_COLOR)
    assert image is not None
    assert image.shape[0] * image.shape[1] < 61e6


def _contrast(a: str, b: str) -> float:
    """Of two colours, by WCAG 2.2."""

    def luminance(colour: str) -> float:
        parts = [int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5)]
        linear = [p / 12.92 if p <= 0.04045 else ((p + 0.055) / 1.055) ** 2.4 for p in parts]
        return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]

    low, high = sorted((luminance(a), luminance(b)))
    return (high + 0.05) / (low + 0.05)


@pytest.mark.parametrize("name", THEMES)
def test_colours_can_be_told_from_what_they_stand_on(name: str) -> None:
    theme = THEMES[name]
    for ground in (theme.background, theme.surface, theme.frame, theme.failed_surface):
        assert _contrast(theme.text, ground) >= 4.5
        assert _contrast(theme.muted, ground) >= 4.5
        assert _contrast(theme.failed, ground) >= 3
    for ground in (theme.background, theme.surface, theme.frame):
        assert _contrast(theme.line, ground) >= 3
        assert _contrast(theme.frame_line, ground) >= 3
    for colour in (*theme.kinds.values(), theme.failed):
        assert _contrast(colour, theme.icon) >= 4.5
        assert _contrast(colour, theme.surface) >= 3
    assert _contrast(theme.line, theme.icon) >= 3
