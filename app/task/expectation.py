"""One expectation of a scenario, met or not."""

from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Expectation:
    """One expectation of the scenario: what came out (`value`) and what was expected (`limit`)."""

    name: str
    met: bool
    value: Any
    limit: Any
