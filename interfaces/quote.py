"""Shortens what messages quote from a user's input."""

MAX_QUOTE = 60  # characters; choice: a quotation then fits into one line of a terminal with words around it


def cut(text: str, longest: int = MAX_QUOTE) -> str:
    """The text; if it has more than `longest` characters (at least 23), dots replace its middle. 20 stay at its end."""
    return text if len(text) <= longest else f"{text[: longest - 23]}...{text[-20:]}"


def quoted(value: object) -> str:
    """The value's `repr`, cut to `MAX_QUOTE` characters."""
    return cut(repr(value))
