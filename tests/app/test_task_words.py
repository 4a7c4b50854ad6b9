"""The engine knows no task: no word of the cable stands outside its folders."""

import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
ROOMS = ("app", "trees", "sim", "behaviors")
WORD = re.compile(r"connector|socket|clip|stow|cable", re.IGNORECASE)
ALLOWED = re.compile(r"np\.clip|numpy\.clip")  # the arithmetic


def test_no_word_of_the_cable_task_is_left_in_the_engine() -> None:
    found = [
        f"{path.relative_to(ROOT)}:{number}: {line.strip()}"
        for room in ROOMS
        for path in sorted((ROOT / room).rglob("*.py"))
        if "cable" not in path.relative_to(ROOT).parts
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1)
        if WORD.search(ALLOWED.sub("", line))
    ]
    assert found == []
