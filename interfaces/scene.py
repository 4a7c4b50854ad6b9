"""What a scenario adds to the cell. Where the scenario varies, the values are already drawn from the seed."""

from dataclasses import dataclass
from typing import Literal, get_args

from regrasp.interfaces.cell import Box
from regrasp.interfaces.fault import Fault
from regrasp.interfaces.fields import Color

Gravity = Literal["zero", "earth"]
GRAVITIES: tuple[Gravity, ...] = get_args(Gravity)
EARTH_GRAVITY = 9.81  # m/s2


@dataclass(frozen=True)
class Obstacle:
    """A piece of foam: a box turned by `yaw` rad about z. One that is off the floor has a thin stand under it."""

    box: Box
    yaw: float
    stand: Box | None


@dataclass(frozen=True)
class Prop:
    """A visible object without a collision shape. Its frame is at its centre; a rod lies along x.

    `size` in m: (x, y, z) edges of a box; (radius,) of a ball; (length, radius) of a rod.
    """

    kind: Literal["box", "ball", "rod"]
    size: tuple[float, ...]
    color: Color


@dataclass(frozen=True)
class SceneSetup:
    """What one run adds to the cell. The props are out of sight until they are placed."""

    obstacles: tuple[Obstacle, ...] = ()
    faults: tuple[Fault, ...] = ()
    props: tuple[Prop, ...] = ()
