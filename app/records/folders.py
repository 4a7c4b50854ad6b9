"""Folders of records: new ones, and checks that a folder or file can be written."""

import contextlib
import hashlib
import os
import re
import tempfile
from itertools import count
from pathlib import Path

from regrasp.app.files.findings import Finding, real_path, shown
from regrasp.interfaces.quote import quoted

RUNS = Path("runs")  # where records go by default
RUN_FILES = ("result.json", "events.jsonl", "ticks.jsonl")  # by which a run's folder is known
PICTURES, OUTLINES = "pictures", "outlines.jsonl"  # the folder of a run's pictures; in it, what was found in them
FILES = (*RUN_FILES, "signals.f32", "scenario.yaml", "cell.yaml", "tree.xml")  # of a run's folder


def new_folder(name: str, within: Path = RUNS) -> Path:
    """Create the first of NAME-1, NAME-2, ... that does not exist in the folder `within`.

    It is created at once, so that two runs that start together get different folders.

    Raises:
        OSError: none can be made.
    """
    within.mkdir(parents=True, exist_ok=True)
    for n in count(1):
        folder = within / f"{folder_name(name)}-{n}"
        with contextlib.suppress(FileExistsError):
            folder.mkdir()
            return folder
    raise AssertionError("unreachable")


def leave_if_empty(folder: Path) -> None:
    """Remove a folder if it is empty."""
    with contextlib.suppress(OSError):
        folder.rmdir()
        if folder.parent == RUNS:
            RUNS.rmdir()


def folder_name(case: str) -> str:
    """A case's name as a folder name: special characters become _, and a digest keeps such names distinct."""
    plain = re.sub(r"[^A-Za-z0-9_.,=+-]+", "_", case)[:100].strip(".") or "_"
    return plain if plain == case else f"{plain}-{hashlib.sha256(case.encode()).hexdigest()[:8]}"


def taken_names(out: Path) -> list[str]:
    """The files in `out` that a run would overwrite."""
    return [name for name in FILES if os.path.lexists(out / name)]


def existing_run_findings(out: Path) -> list[Finding]:
    """The finding that another run's files are in the folder; [] if there are none."""
    there = taken_names(out)
    if set(there) & set(RUN_FILES):
        return [Finding(shown(out), 0, f"holds a run already ({', '.join(there)}); name another folder")]
    if there:
        return [Finding(shown(out), 0, f"holds {', '.join(there)}, which a run would overwrite; name another folder")]
    return []


def run_folder_findings(out: Path) -> list[Finding]:
    """Why no run can be written to `out`; [] if one can. The check leaves nothing behind."""
    if there := existing_run_findings(out):
        return there
    if out == Path():
        return [Finding("--out", 0, "names this very folder; name one of its own for the run")]
    return folder_findings(out)


def file_findings(file: Path, *, new: bool = False) -> list[Finding]:
    """Why this file cannot be written; [] if it can. The check leaves nothing behind. `new`: it must not exist yet."""
    if os.path.isdir(file):
        return [Finding(shown(file), 0, "is a folder; name a file")]
    if real_path(file).is_symlink():
        return [Finding(shown(file), 0, "is a link that leads back to itself; name another file")]
    if new and os.path.exists(file):
        return [Finding(shown(file), 0, "exists already; name another file, or remove it")]
    return folder_findings(file.parent)


def folder_findings(out: Path) -> list[Finding]:
    """Why the folder `out` cannot be made or written in; [] if it can. The check leaves nothing behind."""
    spot = out.absolute()
    while not os.path.lexists(spot) and spot != spot.parent:
        spot = spot.parent
    if not os.path.isdir(spot):
        return [Finding(shown(out), 0, f"{quoted(shown(spot))} is no folder; name another place")]
    try:
        with tempfile.TemporaryFile(dir=spot):
            return []
    except OSError as error:
        return [Finding(shown(out), 0, f"cannot write in {quoted(shown(spot))} ({error.strerror}); name another place")]
