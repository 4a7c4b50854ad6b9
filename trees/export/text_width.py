"""Upper bounds of a text's width, for whatever font a viewer will use."""

# In ems, rounded up from the wider of DejaVu Sans Bold, the widest font that browsers take for sans-serif, and the one
# that comes with OpenCV.
_CLASSES = {
    0.35: " ijl'",
    0.41: ",.:;I|",
    0.47: "![]f",
    0.56: '"*`rt-/\\',
    0.62: "?csz",
    0.72: "0123456789abdeghknopquvxy${}()J",
    0.86: "ABCDEFGHKLNOPQRSTUVXYZ_",
    0.93: "#+<=>^~&w",
}
_WIDTHS = {char: width for width, chars in _CLASSES.items() for char in chars}
_WIDEST = 1.13
_REGULAR = 0.94  # of the bold width, at most


def text_width(text: str, size: float, bold: bool = False) -> float:
    """Upper bound in pixels at a font of `size` pixels."""
    return sum(_WIDTHS.get(char, _WIDEST) for char in text) * size * (1.0 if bold else _REGULAR)


def shortened(text: str, size: float, width: float, bold: bool = False) -> str:
    """The text, cut with … where it would be wider than `width` pixels."""
    if text_width(text, size, bold) <= width:
        return text
    text = text[: int(width / (size * _REGULAR * min(_CLASSES))) + 1]  # no more fits, of whatever letters
    while text and text_width(text + "…", size, bold) > width:
        text = text[:-1]
    return text + "…"
