"""Options that several commands take."""

import re
from typing import Annotated

import typer

from app.findings import Finding, Findings
from interfaces.quote import quoted

MOST_SEED = 2**31 - 1
MOST_SEEDS = 10_000  # of one study
IMAGE_SUFFIXES = (".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff")

Sets = Annotated[
    list[str] | None,
    typer.Option(
        "--set", metavar="KEY=VALUE", help="Change a value of the scenario, or with cell. of its cell; repeat."
    ),
]


def parse_seeds(text: str) -> range:
    """The seeds of "A:B", B left out. Raises `Findings` for anything else."""
    first, after = map(int, text.split(":")) if re.fullmatch(r"\d{1,10}:\d{1,10}", text) else (0, 0)
    if not first < after <= MOST_SEED:
        right = f"write A:B with A below B and B at most {MOST_SEED}, such as 0:20"
        raise Findings([Finding("--seeds", 0, f"{quoted(text)} is no range of seeds; {right}")])
    seeds = range(first, after)
    if len(seeds) > MOST_SEEDS:
        raise Findings([Finding("--seeds", 0, f"{len(seeds)} seeds; ask for at most {MOST_SEEDS} in one study")])
    return seeds
