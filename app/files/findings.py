"""What is wrong with an input: one line a finding, all findings at once."""

import difflib
import os
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import ParamSpec, TypeVar

from regrasp.interfaces.quote import MAX_QUOTE, cut, quoted

P = ParamSpec("P")
T = TypeVar("T")
MOST_LISTED = 12  # known names after an unknown one


@dataclass(frozen=True, order=True)
class Finding:
    """One thing that is wrong: where, what, and what would be right.

    `source` is a file, a folder or an option. `line` counts from 1; 0 means that the source has no lines, or that all
    of it is wrong.
    """

    source: str
    line: int
    message: str

    def __str__(self) -> str:
        where = f"{self.source}:{self.line}" if self.line else self.source
        return printable(f"{where}: {self.message}")


class Findings(Exception):  # noqa: N818 - it is the list of findings that travels
    """Raised for bad input. `items` holds every finding once, in the order of file and line."""

    def __init__(self, items: Iterable[Finding]) -> None:
        self.items = sorted(set(items))
        super().__init__("\n".join(str(f) for f in self.items))


def attempt(make: Callable[P, T], *args: P.args, **kwargs: P.kwargs) -> tuple[T | None, list[Finding]]:
    """What `make` returns, or the findings that it raises."""
    try:
        return make(*args, **kwargs), []
    except Findings as error:
        return None, error.items


def printable(text: str) -> str:
    """The text with all that could steer a terminal or break XML escaped: it may stem from a file."""
    return "".join(c if c.isprintable() else repr(c)[1:-1] for c in text)


def nearest(name: str, names: Iterable[str], what: str = "there are") -> str:
    """The words that help after an unknown name: the nearest known one, else all that exist."""
    known = sorted(names)
    if close := closest(name, known):
        return f"did you mean {quoted(close)}?"
    more = f" and {len(known) - MOST_LISTED} more" if known[MOST_LISTED:] else ""
    return f"{what} {', '.join(map(cut, known[:MOST_LISTED]))}{more}" if known else "there are none"


def closest(name: str, names: Iterable[str]) -> str | None:
    """The name that this one seems to mean."""
    return next(iter(difflib.get_close_matches(name[:MAX_QUOTE], sorted(names), n=1)), None)


def shown(path: Path) -> str:
    """A path as the user would write it: relative when it lies under the current folder."""
    try:
        return str(real(path).relative_to(Path.cwd()))
    except (ValueError, OSError):
        return str(path)


def real(path: Path) -> Path:
    """The path without links, from the root; of links that lead back to themselves as far as they can be followed.

    `Path.resolve` raises RuntimeError for such links before Python 3.13.
    """
    return Path(os.path.realpath(path))


def why_no_file(path: Path) -> str:
    """What stands at `path` in place of a file that can be read, as the end of a sentence."""
    if os.path.isdir(path):
        return "is a folder"
    if os.path.exists(path):
        return "is no file"
    return "is a link that leads nowhere" if os.path.lexists(path) else "does not exist"
