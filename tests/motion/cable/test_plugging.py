"""Plugging by feel, with a hand that goes exactly where it is told and a mouth that pushes back as stated."""

from collections.abc import Generator
from dataclasses import dataclass

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform, Rotation

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cable.motion import PluggedIn
from regrasp.motion.cable.plugging import Plugging, PluggingParameters, spiral

VALUES = PluggingParameters()
DEPTH = 0.015
PLUG = RigidTransform.from_components([0.48, 0.1, 0.37], Rotation.from_euler("zy", [65, -25], degrees=True))
GOAL = RigidTransform.from_components([0.4, 0.08, 0.36], Rotation.from_euler("x", 30, degrees=True))
BORE, CHAMFER = 0.00125, 0.003  # m
SPRING, SEAT = 2500.0, 5000.0  # N/m
FRICTION, PULL_OUT = 3.0, 10.0  # N


@dataclass
class Socket:
    """A socket `off` m from where it is believed to be. `bore` False: a blank block; `clicks` False: it is worn out.

    `cable` N a metre is how much harder the cable pulls the plug back the further it goes in.
    """

    off: tuple[float, float, float] = (0.0, 0.0, 0.0)
    bore: bool = True
    clicks: bool = True
    cable: float = 0.0
    seat: float | None = None
    inside: bool = False
    load: float = 0.0  # N, now
    greatest: float = 0.0  # N
    _last: float = 0.0

    def go(self, pose: RigidTransform) -> Generator[None, None, FloatArray]:
        """Bring the hand there; the drives feel the force on the plug as it is, in the world."""
        yield
        place = PLUG.rotation.inv().apply(pose.translation - GOAL.translation) - [-DEPTH, 0.0, 0.0]
        assert (pose.rotation.inv() * GOAL.rotation).magnitude() < 1e-9
        force = self.push_back(place - self.off)
        self.load = float(np.linalg.norm(force))
        self.greatest = max(self.greatest, self.load)
        force[0] -= self.cable * place[0]
        self._last = place[0]
        return PLUG.rotation.apply(force)

    def push_back(self, tip: FloatArray) -> FloatArray:
        """The force (3,) N of the mouth on a tip (3,) m in it."""
        deep, offset = tip[0], float(np.hypot(tip[1], tip[2]))
        if deep <= 0.0:
            self.inside, self.seat = False, None
            return np.zeros(3)
        if not self.bore or offset >= BORE + CHAMFER:
            return np.array([-SPRING * deep, 0.0, 0.0])
        self.inside = self.inside or (offset < BORE and deep > CHAMFER)
        across = -np.array([0.0, tip[1], tip[2]]) / max(offset, 1e-9)
        if not self.inside:
            overlap = max((offset - BORE - CHAMFER + deep) * np.sqrt(0.5), 0.0)
            return np.asarray(SPRING * overlap * (across - [1.0, 0.0, 0.0]) * np.sqrt(0.5))
        return SPRING * max(offset - BORE, 0.0) * across + [self._along(deep), 0.0, 0.0]

    def _along(self, deep: float) -> float:
        if self.seat is None and self.clicks and deep > DEPTH - 0.001:
            self.seat = min(deep, DEPTH)
        if self.seat is not None:
            spring = SEAT * (self.seat - deep)
            if spring <= PULL_OUT:
                return spring
            self.seat = None
        end = SEAT * min(DEPTH - deep, 0.0)
        return end - FRICTION * deep / DEPTH * float(np.sign(deep - self._last + self.off[0]))


def insert(socket: Socket) -> PluggedIn | None:
    """Plug into it."""
    steps = Plugging(socket.go, lambda change: change, GOAL, PLUG, DEPTH, VALUES).insert()
    try:
        for _ in range(5000):
            next(steps)
    except StopIteration as end:
        found: PluggedIn | None = end.value
        return found
    raise AssertionError("it does not end")


OFFS = [(0.0, 0.0, 0.0), (0.003, 0.002, -0.001), (-0.004, 0.0, 0.003), (0.002, -0.006, 0.0), (0.0, 0.003, 0.007)]


@pytest.mark.parametrize("off", OFFS)
@pytest.mark.parametrize("cable", [0.0, 300.0, 1000.0])
def test_a_plug_finds_its_bore_and_is_left_without_a_load(off: tuple[float, float, float], cable: float) -> None:
    socket = Socket(off, cable=cable)
    found = insert(socket)
    assert found is not None
    assert socket.seat is not None
    assert np.linalg.norm(found.across - off[1:]) < BORE + CHAMFER
    assert (found.tries == 1) == (np.hypot(*off[1:]) < 0.004)
    assert socket.greatest < 15.0
    assert socket.load < 4.0


@pytest.mark.parametrize("socket", [Socket(bore=False), Socket((0.0, 0.015, 0.0))])
def test_a_plug_without_a_bore_is_tried_everywhere_near(socket: Socket) -> None:
    assert insert(socket) is None
    assert socket.greatest < 15.0


def test_a_gentle_pull_tells_a_plug_that_only_sticks() -> None:
    assert insert(Socket(clicks=False)) is None


def test_the_tries_lie_close_enough_together_for_the_chamfer() -> None:
    tries = spiral(VALUES.pitch, VALUES.radius)
    assert tries[0] == pytest.approx([0.0, 0.0])
    distances = np.linalg.norm(tries, axis=1)
    assert (np.diff(distances) > -1e-9).all()
    assert distances.max() <= VALUES.radius
    rng = np.random.default_rng(0)
    places = rng.uniform(-VALUES.radius, VALUES.radius, (2000, 2))
    places = places[np.linalg.norm(places, axis=1) < VALUES.radius - 0.001]
    nearest = np.linalg.norm(places[:, None] - tries, axis=2).min(axis=1)
    assert nearest.max() < BORE + CHAMFER
