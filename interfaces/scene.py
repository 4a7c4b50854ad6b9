"""What a scenario puts into the cell, already drawn from the seed where it varies."""

from dataclasses import dataclass
from typing import Literal, get_args

from regrasp.interfaces.cell import Box, Color

Gravity = Literal["zero", "earth"]
GRAVITIES: tuple[Gravity, ...] = get_args(Gravity)
EARTH_GRAVITY = 9.81  # m/s2


@dataclass(frozen=True)
class Obstacle:
    """A foam piece: a box turned by `yaw` rad about z, and the thin stand under one that is off the floor."""

    box: Box
    yaw: float
    stand: Box | None


@dataclass(frozen=True)
class Prop:
    """A thing that is seen and stops nothing. `size` in m: a box's edges; a ball's radius; a rod's length and radius.

    Its frame is at its middle, a rod lies along x.
    """

    kind: Literal["box", "ball", "rod"]
    size: tuple[float, ...]
    color: Color
