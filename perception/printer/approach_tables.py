"""The source's two tables: how far the printed part is by its box's area, and m a pixel by how far it is."""

from importlib.resources import files
from itertools import pairwise
from pathlib import Path

import numpy as np
from pydantic import Field, ValidationError, model_validator

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.fields import Model
from regrasp.interfaces.printer.actions import Sighting

SHIPPED = "approach_tables.json"


class ApproachTables(Model):
    """Knots, nearest first: `regrasp calibrate-approach` makes them.

    `distance` (m) is the tool's, to its goal before the part, where the hand is aligned with it. `area` (px2) is that
    of the part's box there, `scale` (m/px) of what lies in the plane of the part's front, and `aim` (m) by how much the
    middle of the box lies left of and above the picture's.
    """

    area: tuple[float, ...] = Field(min_length=2)
    distance: tuple[float, ...] = Field(min_length=2)
    scale: tuple[float, ...] = Field(min_length=2)
    aim: tuple[float, float]

    @model_validator(mode="after")
    def _in_order(self) -> "ApproachTables":
        if not len(self.area) == len(self.distance) == len(self.scale):
            counts = f"{len(self.area)}, {len(self.distance)} and {len(self.scale)}"
            raise ValueError(f"area, distance and scale have {counts} knots; give each as many")
        if any(b >= a for a, b in pairwise(self.area)):
            raise ValueError("the areas do not fall from knot to knot; give them from the nearest to the farthest")
        for name in ("distance", "scale"):
            if any(b <= a for a, b in pairwise(getattr(self, name))):
                raise ValueError(f"the values of {name} do not rise from knot to knot; give them from the nearest on")
        if min(*self.area, *self.scale) <= 0:
            raise ValueError("an area or a scale is not above 0")
        return self

    def offset(self, seen: Sighting) -> FloatArray:
        """Offset (3,) m in the world from the tool to its goal, by where the part's box is in a picture.

        Camera and part are taken as aligned with the world, as the source does (sections 4.3.8 and 4.3.9).
        """
        distance = linear(self.area[::-1], self.distance[::-1], seen.area)
        scale = linear(self.distance, self.scale, distance)
        left, up = -scale * seen.offset[0], -scale * seen.offset[1]
        return np.array([-distance, -(left - self.aim[0]), up - self.aim[1]])


def linear(knots: tuple[float, ...], values: tuple[float, ...], at: float) -> float:
    """Piecewise linear interpolation between rising knots; beyond them the first or last piece goes on."""
    i = int(np.clip(np.searchsorted(knots, at) - 1, 0, len(knots) - 2))
    share = (at - knots[i]) / (knots[i + 1] - knots[i])
    return values[i] + share * (values[i + 1] - values[i])


def load_tables(path: Path | None = None) -> ApproachTables:
    """The tables of a file, by default the shipped ones.

    Raises:
        OSError: it cannot be read.
        ValueError: it holds no such tables; the message names the file.
    """
    source = files("regrasp.perception.printer").joinpath(SHIPPED) if path is None else path
    try:
        return ApproachTables.model_validate_json(source.read_text(encoding="utf-8"))
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(map(str, first["loc"]))
        raise ValueError(f"{path or SHIPPED}: {where + ': ' if where else ''}{first['msg']}") from None
