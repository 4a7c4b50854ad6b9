"""What the seed draws in a scenario of any task, as a pydantic model: obstacles and light, each number from a range."""

import colorsys
from typing import Annotated

import numpy as np
from pydantic import AfterValidator, Field, field_validator

from regrasp.interfaces.cell import Cell, Name
from regrasp.interfaces.fields import Color, Direction, Fraction, Model, in_order

_Count = Annotated[int, Field(ge=0, le=20)]
_Edge = Annotated[float, Field(ge=1e-3, le=3)]
_Place = Annotated[float, Field(ge=-5, le=5)]
_Height = Annotated[float, Field(ge=0, le=5)]
_Angle = Annotated[float, Field(ge=-360, le=360)]
_Tilt = Annotated[float, Field(ge=0, le=90)]
_Brightness = Annotated[float, Field(ge=0, le=3)]
Counts = Annotated[tuple[_Count, _Count], AfterValidator(in_order)]
Edges = Annotated[tuple[_Edge, _Edge], AfterValidator(in_order)]
Places = Annotated[tuple[_Place, _Place], AfterValidator(in_order)]
Heights = Annotated[tuple[_Height, _Height], AfterValidator(in_order)]
Angles = Annotated[tuple[_Angle, _Angle], AfterValidator(in_order)]
Tilts = Annotated[tuple[_Tilt, _Tilt], AfterValidator(in_order)]
Brightnesses = Annotated[tuple[_Brightness, _Brightness], AfterValidator(in_order)]


class Edge3(Model):
    """The edges of a block before it is turned."""

    x: Annotated[Edges, Field(description="Along x, metres.", examples=[[0.05, 0.15]])]
    y: Annotated[Edges, Field(description="Along y, metres.", examples=[[0.05, 0.15]])]
    z: Annotated[Edges, Field(description="Its height, metres.", examples=[[0.06, 0.36]])]


class Ground(Model):
    """Where blocks stand."""

    x: Annotated[Places, Field(description="Their middles along x, metres.", examples=[[0.1, 0.45]])]
    y: Annotated[Places, Field(description="Their middles along y, metres.", examples=[[-0.35, 0.35]])]
    z: Annotated[
        Heights, Field(description="Height of the bottoms of those on a stand, metres.", examples=[[0.05, 0.2]])
    ] = (0.05, 0.2)
    on_stand: Annotated[
        Fraction, Field(description="Share of the blocks that are on a stand, 0 to 1.", examples=[0.25])
    ] = 0.0


class ObstacleDraw(Model):
    """A kind of foam blocks that the seed draws."""

    name: Annotated[Name, Field(description="What messages and records call them, with a number.", examples=["foam"])]
    count: Annotated[Counts, Field(description="How many, both ends among them.", examples=[[1, 4]])]
    size: Annotated[
        Edge3, Field(description="How large.", examples=[{"x": [0.05, 0.15], "y": [0.05, 0.15], "z": [0.06, 0.36]}])
    ]
    region: Annotated[Ground, Field(description="Where they stand.", examples=[{"x": [0.1, 0.45], "y": [-0.35, 0.35]}])]
    yaw_deg: Annotated[Angles, Field(description="Turned left by so many degrees.", examples=[[-180, 180]])] = (0, 0)
    hue_deg: Annotated[
        Angles, Field(description="Hue of their colour in degrees; 0 is red.", examples=[[240, 320]])
    ] = (280, 280)


class LightDraw(Model):
    """Light that the seed draws, in place of what the file's `light` says."""

    brightness: Annotated[
        Brightnesses, Field(description="Factor on the ambient and the far light.", examples=[[0.6, 1.3]])
    ] = (1, 1)
    tilt_deg: Annotated[
        Tilts, Field(description="Degrees between the far light and the zenith, to any side.", examples=[[10, 50]])
    ] = (0, 60)


class Draw(Model):
    """What the seed draws. A scene that cannot be solved is thrown away, and the next one is drawn."""

    obstacles: Annotated[
        tuple[ObstacleDraw, ...],
        Field(
            description="Kinds of foam blocks, besides those of the file's `obstacles`.",
            examples=[
                [
                    {
                        "name": "foam",
                        "count": [1, 4],
                        "size": {"x": [0.05, 0.15], "y": [0.05, 0.15], "z": [0.06, 0.36]},
                        "region": {"x": [0.1, 0.45], "y": [-0.35, 0.35]},
                    }
                ]
            ],
        ),
    ] = ()
    light: Annotated[LightDraw | None, Field(description="The light.", examples=[{"brightness": [0.6, 1.3]}])] = None
    tries: Annotated[
        int,
        Field(ge=1, le=10_000, description="How many scenes are drawn at most until one can be solved.", examples=[50]),
    ] = 100

    @field_validator("obstacles")
    @classmethod
    def _each_name_once(cls, kinds: tuple[ObstacleDraw, ...]) -> tuple[ObstacleDraw, ...]:
        names = [kind.name for kind in kinds]
        if twice := [name for name in names if names.count(name) > 1]:
            raise ValueError(f"two kinds of obstacles {twice[0]!r}; rename one")
        return kinds

    def in_cell(self, cell: Cell, rng: np.random.Generator) -> Cell:
        """The cell with what is drawn in it. A task's own model overrides this."""
        return cell


def hue_color(hue_deg: float, saturation: float, value: float) -> Color:
    """RGB of a hue in degrees, 0 red, with this saturation and value (HSV), each 0 to 1."""
    return colorsys.hsv_to_rgb(hue_deg / 360 % 1.0, saturation, value)


def light_direction(tilt_deg: float, azimuth: float) -> Direction:
    """Unit vector from the scene to a light `tilt_deg` degrees off the zenith, at `azimuth` rad left of x."""
    tilt = np.deg2rad(tilt_deg)
    return (float(np.sin(tilt) * np.cos(azimuth)), float(np.sin(tilt) * np.sin(azimuth)), float(np.cos(tilt)))
