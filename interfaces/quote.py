"""How messages quote what somebody wrote, and what they suggest in place of an unknown name."""

from collections.abc import Iterable
from difflib import get_close_matches
from itertools import chain

MOST = 60  # letters
MAX_LISTED = 12  # known names that are listed after an unknown one


def cut(text: str, most: int = MOST) -> str:
    """The text, its middle left out where it is longer than `most` letters."""
    return text if len(text) <= most else f"{text[: most - 23]}...{text[-20:]}"


def quoted(value: object) -> str:
    """The value as Python writes it, cut."""
    return cut(repr(value))


def printable(text: str) -> str:
    """The text with control characters escaped: it may stem from a file, and could steer a terminal or break XML."""
    return "".join(c if c.isprintable() else repr(c)[1:-1] for c in text)


def closest(name: str, names: Iterable[str], compared: int | None = None) -> str | None:
    """The known name that is the same but for upper and lower case, else the one most like it; None where none is.

    Only the first `compared` of the sorted names are searched for one that is like it (None: all).
    """
    known = sorted(names)
    same = (other for other in known if other.casefold() == name.casefold())
    return next(chain(same, get_close_matches(name[:MOST], known[:compared], n=1)), None)


def nearest(name: str, names: Iterable[str], what: str = "there are", compared: int | None = None) -> str:
    """What to write in place of an unknown name, in words: the closest known name, else a list of the known ones."""
    known = sorted(names)
    if close := closest(name, known, compared):
        return f"did you mean {quoted(close)}?"
    more = f" and {len(known) - MAX_LISTED} more" if known[MAX_LISTED:] else ""
    return f"{what} {', '.join(map(cut, known[:MAX_LISTED]))}{more}" if known else "there are none"
