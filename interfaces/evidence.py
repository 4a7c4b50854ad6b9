"""Evidence: the result of a test that the robot makes of what it senses."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Evidence:
    """The result of the test `by`: the measured `value` (m), the `limit` (m) for it, and a sentence with both."""

    detected: bool
    by: str
    value: float
    limit: float
    sentence: str
