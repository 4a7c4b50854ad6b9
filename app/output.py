"""Where a run's record goes, and whether it can."""

import hashlib
import os
import re
import tempfile
from itertools import count
from pathlib import Path

from app.findings import Finding, shown
from interfaces.quote import quoted

FILES = ("result.json", "events.jsonl", "ticks.jsonl", "scenario.yaml", "cell.yaml", "tree.xml")  # of a run's folder


def free_folder(scenario: str, which: int | str) -> Path:
    """The first of runs/SCENARIO-WHICH-1, -2, ... that does not exist; WHICH is a seed, or "all"."""
    return next(p for n in count(1) if not (p := Path("runs", f"{scenario}-{which}-{n}")).exists())


def folder_name(case: str) -> str:
    """A case's name as that of a folder: what is no plain letter gives way to _ and a digest that keeps names apart."""
    plain = re.sub(r"[^A-Za-z0-9_.,=+-]+", "_", case)[:100].strip(".") or "_"
    return plain if plain == case else f"{plain}-{hashlib.sha256(case.encode()).hexdigest()[:8]}"


def taken(out: Path) -> list[str]:
    """The files in `out` that a run would overwrite."""
    return [name for name in FILES if os.path.lexists(out / name)]


def findings(out: Path) -> list[Finding]:
    """Why no run can be written to `out`; nothing is left behind by the look."""
    if there := taken(out):
        return [Finding(shown(out), 0, f"already holds {', '.join(there)}; name another folder for the run")]
    if out == Path():
        return [Finding("--out", 0, "names this very folder; name one of its own for the run")]
    return unwritable(out)


def unwritable(out: Path) -> list[Finding]:
    """Why no folder `out` can be made or written in; nothing is left behind by the look."""
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
