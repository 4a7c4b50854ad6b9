"""Seeds of runs, scenes and studies."""

import re

MAX_SEED = 2**31 - 1  # whole numbers from 0 to this
MAX_SEEDS = 10_000  # of one range


def seed_range(text: str) -> range:
    """The seeds of "A:B", without B. Raises ValueError for anything else."""
    from regrasp.interfaces.quote import quoted

    first, after = map(int, text.split(":")) if re.fullmatch(r"\d{1,10}:\d{1,10}", text) else (0, 0)
    if not first < after <= MAX_SEED:
        right = f"write A:B with A below B and B at most {MAX_SEED}, such as 0:20"
        raise ValueError(f"{quoted(text)} is no range of seeds; {right}")
    if after - first > MAX_SEEDS:
        raise ValueError(f"{after - first} seeds; ask for at most {MAX_SEEDS} at once")
    return range(first, after)
