"""Pictures without the connector: a black plug in its socket, and look-alikes. Every estimate there is false."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation

from regrasp.app.tasks.cable.studies.pose.scenes import CAMERA
from regrasp.app.tasks.cable.studies.pose.trial import Setup
from regrasp.interfaces.cable.cell import CableCell
from regrasp.interfaces.cell import FixedMount
from regrasp.interfaces.fields import Color
from regrasp.interfaces.frame import RgbdFrame
from regrasp.interfaces.scene import Prop, SceneSetup
from regrasp.perception.pose.estimate import Estimate
from regrasp.sim.cable.objects import cable_world
from regrasp.sim.render.renderer import RendererName

OTHER_COLORS: tuple[Color, ...] = ((0.05, 0.45, 0.10), (0.08, 0.15, 0.70), (0.85, 0.70, 0.05), (0.80, 0.35, 0.02))
STICKER = 0  # the index of the look-alike that lies on the panel


@dataclass(frozen=True)
class NegativeParameters:
    """Which pictures without a connector are drawn."""

    frames: int = 10  # per seed, with the look-alikes in other places; choice: 20 seeds give 200
    lowest: tuple[float, float, float] = (0.20, -0.30, 0.08)  # m, world: a corner of the box that holds the look-alikes
    highest: tuple[float, float, float] = (0.46, 0.35, 0.50)  # m, world: its other corner, in the rear camera's view
    shown_share: float = 0.5  # of the pictures, for each look-alike; choice


_DEFAULTS = NegativeParameters()


@dataclass(frozen=True)
class Negative:
    """In how many of `frames` pictures without a connector a technique found one."""

    technique: str
    seed: int
    frames: int
    false: int

    def __str__(self) -> str:
        return f"{self.technique} {self.false} of {self.frames} false"


def run_negatives(setup: Setup, seed: int, parameters: NegativeParameters = _DEFAULTS) -> list[Negative]:
    """Count each technique's false estimates in the same pictures of one seed."""
    mount = setup.cell.known.camera("rear").mount
    assert isinstance(mount, FixedMount)
    made = {name: setup.technique(name) for name in setup.techniques}
    false = dict.fromkeys(setup.techniques, 0)
    for frame in negative_frames(setup.cell, seed, setup.renderer, parameters):
        for name, technique in made.items():
            false[name] += isinstance(technique.estimate(frame, mount.world_from_camera), Estimate)
    return [Negative(name, seed, parameters.frames, false[name]) for name in setup.techniques]


def negative_frames(
    cell: CableCell, seed: int, renderer: RendererName = "software", parameters: NegativeParameters = _DEFAULTS
) -> Iterator[RgbdFrame]:
    """The rear camera's pictures of one seed."""
    rng = np.random.default_rng([seed, 6])
    black = cell.known.cable.connector.model_copy(update={"color": cell.hidden.cable.color, "tag": None})
    props = look_alikes(cell, rng)
    without = cell.model_copy(update={"known": cell.known.with_cable(connector=black)})
    world = cable_world(without, "zero", seed, SceneSetup(props=props), renderer=renderer)
    try:
        panel = next(box for box in cell.known.boxes if box.name == "back_panel")
        face = panel.center[0] - 0.5 * panel.size[0]
        for _ in range(parameters.frames):
            for number in range(len(props)):
                place, turn = rng.uniform(parameters.lowest, parameters.highest), Rotation.random(rng=rng)
                if number == STICKER:
                    place[0], turn = face, Rotation.from_euler("x", float(rng.uniform(0.0, np.pi)))
                shown = rng.random() < parameters.shown_share
                world.place_prop(number, RigidTransform.from_components(place, turn) if shown else None)
            world.advance(1.0 / world.cameras[CAMERA].spec.rate)
            yield next(world.cameras[CAMERA].static_frames(1))
    finally:
        world.close()


def look_alikes(cell: CableCell, rng: np.random.Generator) -> tuple[Prop, ...]:
    """Objects of the connector's colour in other shapes and sizes, and one of its shape in another colour."""
    connector = cell.known.cable.connector
    color, length, radius = connector.color, connector.length, connector.radius
    edges = rng.uniform(0.02, 0.08, 3)
    sticker = (0.002, *rng.uniform(0.03, 0.10, 2).tolist())
    stout, thin = float(rng.uniform(1.8, 3.0)), float(rng.uniform(0.3, 0.5))  # over the connector's size
    other = OTHER_COLORS[int(rng.integers(len(OTHER_COLORS)))]
    return (
        Prop("box", sticker, color),
        Prop("box", tuple(edges.tolist()), color),
        Prop("ball", (float(rng.uniform(0.01, 0.04)),), color),
        Prop("rod", (stout * length, stout * radius), color),
        Prop("rod", (length, thin * radius), color),
        Prop("rod", (length, radius), other),
    )
