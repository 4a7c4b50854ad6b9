"""What perception found in a picture, to be drawn into it."""

from dataclasses import dataclass

from regrasp.interfaces.arrays import FloatArray


@dataclass(frozen=True, eq=False)
class Outline:
    """A thing found in the picture that was exposed at `stamp` s: a polygon (n, 2) px round it, u right and v down.

    `label` says in a few words what it is taken for, and by what.
    """

    label: str
    stamp: float
    polygon: FloatArray
