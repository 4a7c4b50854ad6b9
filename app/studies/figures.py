"""The file of a study's figures."""

import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from regrasp.app.files.whole_file import write_whole
from regrasp.app.records.result import plain, versions


def write_figures(path: Path, seeds: Iterable[int], figures: dict[str, Any], **others: str) -> None:
    """Write the figures of the seeds as JSON, with the versions of what they hang on, and of `others`.

    Raises:
        OSError: it cannot be written.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    whole = {"schema": 1, "seeds": list(seeds), "versions": versions() | others, **figures}
    write_whole(path, json.dumps(plain(whole), indent=2, allow_nan=False) + "\n")
