"""How messages quote a user's input, and what they suggest in place of an unknown name."""

from collections.abc import Iterable
from difflib import get_close_matches
from itertools import chain

MAX_QUOTE = 60  # characters; choice: a quotation then fits into one line of a terminal with words around it
MAX_LISTED = 12  # known names that are listed after an unknown one


def cut(text: str, longest: int = MAX_QUOTE) -> str:
    """The text; if it has more than `longest` characters (at least 23), dots replace its middle. 20 stay at its end."""
    return text if len(text) <= longest else f"{text[: longest - 23]}...{text[-20:]}"


def quoted(value: object) -> str:
    """The value's `repr`, cut to `MAX_QUOTE` characters."""
    return cut(repr(value))


def printable(text: str) -> str:
    """The text with control characters escaped: it may stem from a file, and could steer a terminal or break XML."""
    return "".join(c if c.isprintable() else repr(c)[1:-1] for c in text)


def arm_words(name: str) -> str:
    """An arm for a sentence: "the right arm"; "the arm" where its name says no more."""
    return "the arm" if name == "arm" else f"the {name} arm"


def near_words(distance: float, what: str) -> str:
    """How near something would come to a thing (m; below 0 it would reach into it): "would come to 3 mm from a box"."""
    near = (
        f"would come to {1e3 * distance:.0f} mm from"
        if distance >= 0.0
        else f"would reach {-1e3 * distance:.0f} mm into"
    )
    return f"{near} {what}"


def closest(name: str, names: Iterable[str], compared: int | None = None) -> str | None:
    """The known name that is the same but for upper and lower case, else the one most like it; None where none is.

    Only the first `compared` of the sorted names are searched for one that is like it (None: all).
    """
    known = sorted(names)
    same = (other for other in known if other.casefold() == name.casefold())
    return next(chain(same, get_close_matches(name[:MAX_QUOTE], known[:compared], n=1)), None)


def nearest(name: str, names: Iterable[str], what: str = "there are", compared: int | None = None) -> str:
    """What to write in place of an unknown name, in words: the closest known name, else a list of the known ones."""
    known = sorted(names)
    if close := closest(name, known, compared):
        return f"did you mean {quoted(close)}?"
    more = f" and {len(known) - MAX_LISTED} more" if known[MAX_LISTED:] else ""
    return f"{what} {', '.join(map(cut, known[:MAX_LISTED]))}{more}" if known else "there are none"
