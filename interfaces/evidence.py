"""Evidence: the result of a test that the robot makes of what it senses."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Evidence:
    """The result of the test `by`: the measured `value`, the `limit` for it, and a sentence with both.

    They are in m; those of a pull in N/m.
    """

    detected: bool
    by: str
    value: float
    limit: float
    sentence: str
