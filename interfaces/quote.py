"""How messages quote what somebody wrote: short, whatever its length."""

MOST = 60  # letters


def cut(text: str, most: int = MOST) -> str:
    """The text, its middle left out where it is longer than `most` letters."""
    return text if len(text) <= most else f"{text[: most - 23]}...{text[-20:]}"


def quoted(value: object) -> str:
    """The value as Python writes it, cut."""
    return cut(repr(value))
