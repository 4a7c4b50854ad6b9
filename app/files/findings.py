"""Findings: what is wrong with an input, one line each, all at once."""

import os
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import ParamSpec, TypeVar

from regrasp.interfaces.quote import printable

P = ParamSpec("P")
T = TypeVar("T")


@dataclass(frozen=True, order=True)
class Finding:
    """One error in an input: where it is, what is wrong, and what would be right.

    `source` is a file, a folder or an option. `line` counts from 1; 0: the source has no lines, or the error concerns
    all of it.
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


def catch_findings(make: Callable[P, T], *args: P.args, **kwargs: P.kwargs) -> tuple[T | None, list[Finding]]:
    """What `make` returns (None if it raises), and the findings that it raises."""
    try:
        return make(*args, **kwargs), []
    except Findings as error:
        return None, error.items


def shown(path: Path) -> str:
    """A path as the user would write it: relative when it lies under the current folder."""
    try:
        return str(real_path(path).relative_to(Path.cwd()))
    except (ValueError, OSError):
        return str(path)


def real_path(path: Path) -> Path:
    """The absolute path without links; links that lead back to themselves are followed as far as possible.

    `Path.resolve` raises RuntimeError for such links before Python 3.13.
    """
    return Path(os.path.realpath(path))


def why_no_file(path: Path) -> str:
    """Why there is no readable file at `path`, as the end of a sentence."""
    if os.path.isdir(path):
        return "is a folder"
    if os.path.exists(path):
        return "is no file"
    return "is a link that leads nowhere" if os.path.lexists(path) else "does not exist"
