"""Parts of random scenes: layouts of the cell, cables with connectors, look-alikes and clutter."""

from dataclasses import dataclass

import numpy as np
import pybullet as p
from scipy.spatial.transform import RigidTransform

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cable.cell import CableKnown, Connector, Socket
from regrasp.interfaces.cell import Box
from regrasp.interfaces.fields import Color
from regrasp.sim.bodies import OUT_OF_SIGHT
from regrasp.sim.random_scenes import contrasting_color, random_color, set_pose, similar_color, visual_body

_HIDDEN_POSITION = OUT_OF_SIGHT.translation.tolist()


def repainted(known: CableKnown, rng: np.random.Generator, own_share: float = 0.5) -> CableKnown:
    """The cell with the colours of its file, with a probability of `own_share`, or else with random ones."""
    if rng.random() < own_share:
        return known
    wall, socket = random_color(rng, (0.3, 0.95)), contrasting_color(known.cable.connector.color, rng)
    boxes = tuple(
        b.model_copy(update={"color": random_color(rng, (0.2, 0.9)) if b.name == "floor" else wall})
        for b in known.boxes
    )
    sockets = tuple(s.model_copy(update={"color": socket}) for s in known.cable.sockets)
    return known.model_copy(update={"boxes": boxes}).with_cable(sockets=sockets)


def rearranged(known: CableKnown, rng: np.random.Generator) -> CableKnown:
    """The mirrored cell with shifted panels, and sockets at other places and of other sizes."""

    def moved(box: Box) -> Box:
        x, y, z = box.center
        shift = np.zeros(3) if box.name == "floor" else rng.uniform([-0.02, -0.05, -0.1], [0.08, 0.05, 0.0])
        return box.model_copy(update={"center": tuple((np.array([x, -y, z]) + shift).tolist())})

    def placed(socket: Socket) -> Socket:
        center = rng.uniform([0.45, -0.30, 0.15], [0.48, 0.30, 0.55])
        axis = rng.normal(size=3) * [0.1, 1.0, 0.5]
        update = {"center": tuple(center), "axis": tuple(axis), "size": tuple(rng.uniform(0.035, 0.08, 3))}
        return socket.model_copy(update=update)

    boxes, sockets = tuple(map(moved, known.boxes)), tuple(map(placed, known.cable.sockets))
    return known.model_copy(update={"boxes": boxes}).with_cable(sockets=sockets)


def _rotations_of_x(directions: FloatArray) -> FloatArray:
    """Quaternions (n, 4) x, y, z, w of the smallest rotations of the x axis into `directions` (n, 3) of any length."""
    unit = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    zero = np.zeros(len(unit))
    out = np.column_stack([zero, -unit[:, 2], unit[:, 1], 1.0 + unit[:, 0]])  # (x cross d, 1 + x . d)
    out[unit[:, 0] < -1 + 1e-9] = [0.0, 0.0, 1.0, 0.0]
    return out / np.linalg.norm(out, axis=1, keepdims=True)


@dataclass(frozen=True, eq=False)
class PosedCable:
    """A visual cable with its connector: body ids of the connector and of the cable's capsules, which have a length."""

    client: int
    end: int
    links: tuple[int, ...]
    connector: Connector
    link_length: float  # m

    def lay(self, pose: RigidTransform, anchor: FloatArray, away: FloatArray) -> None:
        """Put the connector at `pose`, and the cable on a cubic Bezier curve from its tail to `anchor` (3,) m.

        The cable leaves the anchor along the unit vector `away` (3,).
        """
        set_pose(self.client, self.end, pose)
        axis = pose.rotation.apply([1.0, 0.0, 0.0])
        tail = pose.translation - 0.5 * self.connector.length * axis
        reach = float(np.linalg.norm(anchor - tail))
        control = np.array([tail, tail - 0.5 * reach * axis, anchor + 0.5 * reach * away, anchor])
        t = np.linspace(0.0, 1.0, 200)[:, None]
        weights = np.hstack([(1 - t) ** 3, 3 * t * (1 - t) ** 2, 3 * t**2 * (1 - t), t**3])
        curve = weights @ control
        along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(curve, axis=0), axis=1))])
        knots = np.arange(0.0, min(along[-1], self.link_length * len(self.links)), self.link_length)
        points = np.column_stack([np.interp(knots, along, curve[:, i]) for i in range(3)])
        middles, turns = (points[1:] + points[:-1]) / 2, _rotations_of_x(np.diff(points, axis=0))
        for link, middle, turn in zip(self.links, middles.tolist(), turns.tolist(), strict=False):
            p.resetBasePositionAndOrientation(link, middle, turn, physicsClientId=self.client)
        self._hide(self.links[len(middles) :])

    def hide(self) -> None:
        """Put connector and cable out of sight."""
        self._hide((self.end, *self.links))

    def _hide(self, bodies: tuple[int, ...]) -> None:
        for body in bodies:
            p.resetBasePositionAndOrientation(body, _HIDDEN_POSITION, (0, 0, 0, 1), physicsClientId=self.client)


def make_cable(
    client: int,
    connector: Connector,
    color: Color,
    cable_radius: float,
    cable_color: Color,
    link_length: float = 0.02,
    link_count: int = 50,
) -> PosedCable:
    """A connector of colour `color` on a cable of `link_count` capsules, `link_length` m long each.

    Choice: capsules short enough for the bends of the thesis's cable, and enough of them for a cable of 1 m.
    """
    links = [
        visual_body(client, p.GEOM_CAPSULE, cable_color, radius=cable_radius, length=link_length)
        for _ in range(link_count)
    ]
    end = visual_body(client, p.GEOM_CYLINDER, color, radius=connector.radius, length=connector.length)
    return PosedCable(client, end, tuple(links), connector, link_length)


@dataclass(frozen=True)
class ClutterObject:
    """A rigid group of bodies, each with its position in m along the group's x axis."""

    parts: tuple[tuple[int, float], ...]

    def set_pose(self, client: int, pose: RigidTransform) -> None:
        """Set the group's pose, world_from_group."""
        for body, ahead in self.parts:
            set_pose(client, body, pose * RigidTransform.from_translation([ahead, 0.0, 0.0]))


def make_clutter(
    client: int,
    connector: Connector,
    rng: np.random.Generator,
    count: int,
    held_out: bool,
    lookalike_share: float = 0.5,
) -> list[ClutterObject]:
    """`count` random objects; a share of `lookalike_share` has nearly the connector's colour.

    None is a cylinder of the connector's proportions, because nothing would tell it from a connector. Kinds: can,
    screwdriver, and box, ball, pole, barbell, stack of boxes or, if `held_out`, capsule, hammer, thin rod.
    """
    others = (_capsule, _hammer, _rod) if held_out else (_box, _ball, _pole, _barbell, _stack)
    kinds = (_can, _screwdriver, *others)
    clutter = []
    for _ in range(count):
        draw_color = similar_color if rng.random() < lookalike_share else contrasting_color
        color = draw_color(connector.color, rng)
        clutter.append(kinds[int(rng.integers(len(kinds)))](client, color, rng))
    return clutter


def _box(client: int, color: Color, rng: np.random.Generator) -> ClutterObject:
    half = np.exp(rng.uniform(np.log(0.004), np.log(0.06), 3))  # from splints to plates
    return ClutterObject(((visual_body(client, p.GEOM_BOX, color, halfExtents=half.tolist()), 0.0),))


def _ball(client: int, color: Color, rng: np.random.Generator) -> ClutterObject:
    return ClutterObject(((visual_body(client, p.GEOM_SPHERE, color, radius=float(rng.uniform(0.008, 0.05))), 0.0),))


def _pole(client: int, color: Color, rng: np.random.Generator) -> ClutterObject:
    radius, length = float(rng.uniform(0.006, 0.02)), float(rng.uniform(0.25, 0.6))
    return ClutterObject(((visual_body(client, p.GEOM_CYLINDER, color, radius=radius, length=length), 0.0),))


def _barbell(client: int, color: Color, rng: np.random.Generator) -> ClutterObject:
    radius, length = float(rng.uniform(0.015, 0.03)), float(rng.uniform(0.08, 0.2))
    bar = visual_body(client, p.GEOM_CYLINDER, random_color(rng), radius=0.4 * radius, length=length)
    weights = [visual_body(client, p.GEOM_SPHERE, color, radius=radius) for _ in range(2)]
    return ClutterObject(((bar, 0.0), (weights[0], -length / 2), (weights[1], length / 2)))


def _stack(client: int, color: Color, rng: np.random.Generator) -> ClutterObject:
    parts, reach = [], 0.0
    for shade in (color, random_color(rng), similar_color(color, rng)):
        half = rng.uniform(0.006, 0.03, 3)
        body = visual_body(client, p.GEOM_BOX, shade, halfExtents=half.tolist())
        parts.append((body, reach + float(half[0])))
        reach += 2 * float(half[0])
    return ClutterObject(tuple(parts))


def _can(client: int, color: Color, rng: np.random.Generator) -> ClutterObject:
    radius = float(rng.uniform(0.022, 0.045))
    length = radius * float(rng.uniform(0.6, 2.5))
    return ClutterObject(((visual_body(client, p.GEOM_CYLINDER, color, radius=radius, length=length), 0.0),))


def _screwdriver(client: int, color: Color, rng: np.random.Generator) -> ClutterObject:
    radius, length = float(rng.uniform(0.016, 0.024)), float(rng.uniform(0.06, 0.09))
    handle = visual_body(client, p.GEOM_CYLINDER, color, radius=radius, length=length)
    shaft = visual_body(client, p.GEOM_CYLINDER, (0.7, 0.7, 0.72), radius=0.2 * radius, length=1.2 * length)
    return ClutterObject(((handle, 0.0), (shaft, 1.1 * length)))


def _capsule(client: int, color: Color, rng: np.random.Generator) -> ClutterObject:
    radius = float(rng.uniform(0.02, 0.035))
    length = radius * float(rng.uniform(0.5, 1.5))
    return ClutterObject(((visual_body(client, p.GEOM_CAPSULE, color, radius=radius, length=length), 0.0),))


def _hammer(client: int, color: Color, rng: np.random.Generator) -> ClutterObject:
    length = float(rng.uniform(0.1, 0.2))
    handle = visual_body(client, p.GEOM_BOX, (0.6, 0.45, 0.25), halfExtents=[length / 2, 0.009, 0.007])
    head = visual_body(client, p.GEOM_BOX, color, halfExtents=[0.016, 0.045, 0.016])
    return ClutterObject(((handle, 0.0), (head, length / 2)))


def _rod(client: int, color: Color, rng: np.random.Generator) -> ClutterObject:
    radius, length = float(rng.uniform(0.002, 0.004)), float(rng.uniform(0.1, 0.4))
    return ClutterObject(((visual_body(client, p.GEOM_CYLINDER, color, radius=radius, length=length), 0.0),))
