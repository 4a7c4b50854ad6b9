"""What the seed draws in a cable scenario besides obstacles and light: the cable's stiffness, the connector's hue."""

import colorsys
from typing import Annotated

import numpy as np
from pydantic import AfterValidator, Field

from regrasp.app.task import draw
from regrasp.interfaces.cable.cell import CableCell
from regrasp.interfaces.cell import Cell
from regrasp.interfaces.fields import Model, in_order

_Factor = Annotated[float, Field(ge=0.05, le=20)]
Factors = Annotated[tuple[_Factor, _Factor], AfterValidator(in_order)]


class ColorDraw(Model):
    """The connector's colour, with the saturation and value (HSV) that the cell gives it."""

    hue_deg: Annotated[draw.Angles, Field(description="Its hue in degrees; 0 is red.", examples=[[-35, 10]])]


class CableDraw(draw.Draw):
    """What the seed draws. A scene that cannot be solved is thrown away, and the next one is drawn."""

    stiffness_factor: Annotated[
        Factors | None, Field(description="Factor on the cable's bending stiffness.", examples=[[0.7, 1.4]])
    ] = None
    connector_color: Annotated[
        ColorDraw | None,
        Field(description="The connector's colour.", examples=[{"hue_deg": [-20, 10]}]),
    ] = None

    def in_cell(self, cell: Cell, rng: np.random.Generator) -> Cell:
        """The cell with the drawn stiffness and colour; the robot is told the colour."""
        assert isinstance(cell, CableCell)
        known, hidden = cell.known, cell.hidden
        if self.stiffness_factor is not None:
            factor = float(rng.uniform(*self.stiffness_factor))
            own = hidden.cable.stiffness
            drawn = own.model_copy(update={"zero": factor * own.zero, "earth": factor * own.earth})
            hidden = hidden.model_copy(update={"cable": hidden.cable.model_copy(update={"stiffness": drawn})})
        if self.connector_color is not None:
            connector = known.cable.connector
            _, saturation, value = colorsys.rgb_to_hsv(*connector.color)
            color = draw.hue_color(float(rng.uniform(*self.connector_color.hue_deg)), saturation, value)
            known = known.with_cable(connector=connector.model_copy(update={"color": color}))
        return cell.model_copy(update={"known": known, "hidden": hidden})
