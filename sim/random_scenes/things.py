"""What random pictures are furnished with: colours, layouts of the cell, a cable, look-alikes and clutter."""

import colorsys
from dataclasses import dataclass

import numpy as np
import pybullet as p
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform

from regrasp.interfaces.cell import Box, Connector, KnownCell, Socket

Color = tuple[float, float, float]
UNDER_FLOOR = (0.2, 0.0, -0.4)  # m, where no camera sees
AWAY = RigidTransform.from_translation(UNDER_FLOOR)
ALIKE = 0.5  # share of the things that have nearly the connector's colour
OWN_COLORS = 0.5  # share of the scenes in which the cell has the colours of its file
LINK = 0.02  # m; choice: a cable's capsule, short enough for the bends of the thesis's cable
LINKS = 50  # enough for a cable of 1 m
_ALONG_X = (0.0, np.sqrt(0.5), 0.0, np.sqrt(0.5))  # PyBullet's cylinders and capsules lie along z


def any_color(rng: np.random.Generator, value: tuple[float, float] = (0.1, 0.95)) -> Color:
    """RGB of any hue, often greyish, with a brightness in the range `value`."""
    saturation = float(rng.beta(1.0, 1.5))
    return colorsys.hsv_to_rgb(float(rng.random()), saturation, float(rng.uniform(*value)))


def like(color: Color, rng: np.random.Generator) -> Color:
    """RGB close to `color`: hue +-10 degrees, paler by up to a quarter, brighter or darker by as much."""
    hue, saturation, value = colorsys.rgb_to_hsv(*color)
    saturation, value = saturation * float(rng.uniform(0.75, 1.0)), min(1.0, value * float(rng.uniform(0.75, 1.25)))
    return colorsys.hsv_to_rgb((hue + float(rng.uniform(-10, 10)) / 360) % 1.0, saturation, value)


def unlike(color: Color, rng: np.random.Generator) -> Color:
    """RGB of a hue at least 60 degrees away from that of `color`."""
    hue = colorsys.rgb_to_hsv(*color)[0] + float(rng.uniform(60, 300)) / 360
    return colorsys.hsv_to_rgb(hue % 1.0, float(rng.uniform(0.5, 1.0)), float(rng.uniform(0.3, 0.9)))


def repainted(known: KnownCell, rng: np.random.Generator) -> KnownCell:
    """The cell in its own colours or, as often, in others."""
    if rng.random() < OWN_COLORS:
        return known
    wall, socket = any_color(rng, (0.3, 0.95)), unlike(known.connector.color, rng)
    boxes = tuple(
        b.model_copy(update={"color": any_color(rng, (0.2, 0.9)) if b.name == "floor" else wall}) for b in known.boxes
    )
    return known.model_copy(
        update={"boxes": boxes, "sockets": tuple(s.model_copy(update={"color": socket}) for s in known.sockets)}
    )


def rearranged(known: KnownCell, rng: np.random.Generator) -> KnownCell:
    """The cell mirrored, its panels shifted, its sockets elsewhere and of other sizes."""

    def moved(box: Box) -> Box:
        x, y, z = box.center
        shift = np.zeros(3) if box.name == "floor" else rng.uniform([-0.02, -0.05, -0.1], [0.08, 0.05, 0.0])
        return box.model_copy(update={"center": tuple((np.array([x, -y, z]) + shift).tolist())})

    def placed(socket: Socket) -> Socket:
        center = rng.uniform([0.45, -0.30, 0.15], [0.48, 0.30, 0.55])
        axis = rng.normal(size=3) * [0.1, 1.0, 0.5]
        update = {"center": tuple(center), "axis": tuple(axis), "size": tuple(rng.uniform(0.035, 0.08, 3))}
        return socket.model_copy(update=update)

    boxes, sockets = tuple(map(moved, known.boxes)), tuple(map(placed, known.sockets))
    return known.model_copy(update={"boxes": boxes, "sockets": sockets})


def shape(client: int, kind: int, color: Color, **size: object) -> int:
    """A body that is only seen; cylinders and capsules lie along its x."""
    turned = {} if kind in (p.GEOM_BOX, p.GEOM_SPHERE) else {"visualFrameOrientation": _ALONG_X}
    visual = p.createVisualShape(kind, rgbaColor=[*color, 1], **size, **turned, physicsClientId=client)
    return int(p.createMultiBody(0, -1, visual, UNDER_FLOOR, physicsClientId=client))


def put(client: int, body: int, pose: RigidTransform) -> None:
    """Move a body to `pose`, world_from_body."""
    turn = pose.rotation.as_quat().tolist()
    p.resetBasePositionAndOrientation(body, pose.translation.tolist(), turn, physicsClientId=client)


def _turns_of_x(directions: NDArray[np.float64]) -> NDArray[np.float64]:
    """Quaternions (n, 4) x, y, z, w that turn the x axis into `directions` (n, 3) of any length."""
    unit = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    zero = np.zeros(len(unit))
    out = np.column_stack([zero, -unit[:, 2], unit[:, 1], 1.0 + unit[:, 0]])  # x cross d, 1 + x . d
    out[unit[:, 0] < -1 + 1e-9] = [0.0, 0.0, 1.0, 0.0]
    return out / np.linalg.norm(out, axis=1, keepdims=True)


@dataclass(frozen=True, eq=False)
class Plug:
    """A cable with its end: the body of the end, the capsules of the cable, the end's measures."""

    client: int
    end: int
    links: tuple[int, ...]
    connector: Connector

    def lay(self, pose: RigidTransform, anchor: NDArray[np.float64], away: NDArray[np.float64]) -> None:
        """Put the end to `pose`, and the cable on a cubic from its tail to `anchor` (3,), m, left along `away` (3,)."""
        put(self.client, self.end, pose)
        axis = pose.rotation.apply([1.0, 0.0, 0.0])
        tail = pose.translation - 0.5 * self.connector.length * axis
        reach = float(np.linalg.norm(anchor - tail))
        control = np.array([tail, tail - 0.5 * reach * axis, anchor + 0.5 * reach * away, anchor])
        t = np.linspace(0.0, 1.0, 200)[:, None]
        weights = np.hstack([(1 - t) ** 3, 3 * t * (1 - t) ** 2, 3 * t**2 * (1 - t), t**3])
        curve = weights @ control
        along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(curve, axis=0), axis=1))])
        knots = np.arange(0.0, min(along[-1], LINK * len(self.links)), LINK)
        points = np.column_stack([np.interp(knots, along, curve[:, i]) for i in range(3)])
        middles, turns = (points[1:] + points[:-1]) / 2, _turns_of_x(np.diff(points, axis=0))
        for link, middle, turn in zip(self.links, middles.tolist(), turns.tolist(), strict=False):
            p.resetBasePositionAndOrientation(link, middle, turn, physicsClientId=self.client)
        self._hide(self.links[len(middles) :])

    def hide(self) -> None:
        """Put it out of sight."""
        self._hide((self.end, *self.links))

    def _hide(self, bodies: tuple[int, ...]) -> None:
        for body in bodies:
            p.resetBasePositionAndOrientation(body, UNDER_FLOOR, (0, 0, 0, 1), physicsClientId=self.client)


def make_plug(client: int, connector: Connector, color: Color, cable_radius: float, cable_color: Color) -> Plug:
    """A connector of that colour on a cable of that one."""
    links = [shape(client, p.GEOM_CAPSULE, cable_color, radius=cable_radius, length=LINK) for _ in range(LINKS)]
    end = shape(client, p.GEOM_CYLINDER, color, radius=connector.radius, length=connector.length)
    return Plug(client, end, tuple(links), connector)


@dataclass(frozen=True)
class Thing:
    """A rigid group of bodies: each with its place along the group's x axis, m."""

    parts: tuple[tuple[int, float], ...]

    def put(self, client: int, pose: RigidTransform) -> None:
        """Move the group to `pose`."""
        for body, ahead in self.parts:
            put(client, body, pose * RigidTransform.from_translation([ahead, 0.0, 0.0]))


def make_things(client: int, connector: Connector, rng: np.random.Generator, count: int, held_out: bool) -> list[Thing]:
    """So many things, most of nearly the connector's colour. None is a cylinder of its proportions: that would be one.

    Kinds: can, screwdriver, and box, ball, pole, barbell, stack of boxes or, if `held_out`, capsule, hammer, thin rod.
    """
    others = (_capsule, _hammer, _rod) if held_out else (_box, _ball, _pole, _barbell, _stack)
    kinds = (_can, _screwdriver, *others)
    things = []
    for _ in range(count):
        color = like(connector.color, rng) if rng.random() < ALIKE else unlike(connector.color, rng)
        things.append(kinds[int(rng.integers(len(kinds)))](client, color, rng))
    return things


def _box(client: int, color: Color, rng: np.random.Generator) -> Thing:
    half = np.exp(rng.uniform(np.log(0.004), np.log(0.06), 3))  # from splints to plates
    return Thing(((shape(client, p.GEOM_BOX, color, halfExtents=half.tolist()), 0.0),))


def _ball(client: int, color: Color, rng: np.random.Generator) -> Thing:
    return Thing(((shape(client, p.GEOM_SPHERE, color, radius=float(rng.uniform(0.008, 0.05))), 0.0),))


def _pole(client: int, color: Color, rng: np.random.Generator) -> Thing:
    radius, length = float(rng.uniform(0.006, 0.02)), float(rng.uniform(0.25, 0.6))
    return Thing(((shape(client, p.GEOM_CYLINDER, color, radius=radius, length=length), 0.0),))


def _barbell(client: int, color: Color, rng: np.random.Generator) -> Thing:
    radius, length = float(rng.uniform(0.015, 0.03)), float(rng.uniform(0.08, 0.2))
    bar = shape(client, p.GEOM_CYLINDER, any_color(rng), radius=0.4 * radius, length=length)
    weights = [shape(client, p.GEOM_SPHERE, color, radius=radius) for _ in range(2)]
    return Thing(((bar, 0.0), (weights[0], -length / 2), (weights[1], length / 2)))


def _stack(client: int, color: Color, rng: np.random.Generator) -> Thing:
    parts, reach = [], 0.0
    for shade in (color, any_color(rng), like(color, rng)):
        half = rng.uniform(0.006, 0.03, 3)
        body = shape(client, p.GEOM_BOX, shade, halfExtents=half.tolist())
        parts.append((body, reach + float(half[0])))
        reach += 2 * float(half[0])
    return Thing(tuple(parts))


def _can(client: int, color: Color, rng: np.random.Generator) -> Thing:
    radius = float(rng.uniform(0.022, 0.045))
    length = radius * float(rng.uniform(0.6, 2.5))
    return Thing(((shape(client, p.GEOM_CYLINDER, color, radius=radius, length=length), 0.0),))


def _screwdriver(client: int, color: Color, rng: np.random.Generator) -> Thing:
    radius, length = float(rng.uniform(0.016, 0.024)), float(rng.uniform(0.06, 0.09))
    handle = shape(client, p.GEOM_CYLINDER, color, radius=radius, length=length)
    shaft = shape(client, p.GEOM_CYLINDER, (0.7, 0.7, 0.72), radius=0.2 * radius, length=1.2 * length)
    return Thing(((handle, 0.0), (shaft, 1.1 * length)))


def _capsule(client: int, color: Color, rng: np.random.Generator) -> Thing:
    radius = float(rng.uniform(0.02, 0.035))
    length = radius * float(rng.uniform(0.5, 1.5))
    return Thing(((shape(client, p.GEOM_CAPSULE, color, radius=radius, length=length), 0.0),))


def _hammer(client: int, color: Color, rng: np.random.Generator) -> Thing:
    length = float(rng.uniform(0.1, 0.2))
    handle = shape(client, p.GEOM_BOX, (0.6, 0.45, 0.25), halfExtents=[length / 2, 0.009, 0.007])
    head = shape(client, p.GEOM_BOX, color, halfExtents=[0.016, 0.045, 0.016])
    return Thing(((handle, 0.0), (head, length / 2)))


def _rod(client: int, color: Color, rng: np.random.Generator) -> Thing:
    radius, length = float(rng.uniform(0.002, 0.004)), float(rng.uniform(0.1, 0.4))
    return Thing(((shape(client, p.GEOM_CYLINDER, color, radius=radius, length=length), 0.0),))
