"""How a hand finds a socket's mouth by force sensing, and pushes the plug that it holds into it."""

from collections import deque
from collections.abc import Callable, Generator, Iterator
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import RigidTransform

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cable.motion import PluggedIn

Go = Callable[[RigidTransform], Generator[None, None, FloatArray]]


@dataclass(frozen=True)
class PluggingParameters:
    """How a plug is pushed in."""

    # m before the mouth where it is felt what pulls on the hand; the last is where pushing begins: the arm errs by 5 mm
    gaps: tuple[float, ...] = (0.038, 0.028, 0.018, 0.008)
    step: float = 0.001  # m between two feelings; choice
    speed: float = 0.4  # share of the joints' speed in the small steps; choice
    look_back: int = 3  # steps over which a force is said to rise; the cable's own changes by 2 N a step at most
    push: float = 7.0  # N by which the resistance has risen when a push ends: a mouth is met, or the bore's end
    most: float = 20.0  # N at which a push ends in any case; choice: under what the jaw holds, 50 N
    deeper: float = 0.008  # m past the bore's end where a push ends that meets nothing; the arm errs by 5 mm
    yielding: float = 0.00015  # m/N that the hand yields to a force across: so a chamfer draws the plug in; choice
    most_yielding: float = 0.001  # m that it yields at once; choice
    across: float = 1.0  # N across to which the hand yields; choice: below, it is the cable's
    yields: int = 6  # times in a row that the hand only yields; choice
    pitch: float = 0.005  # m between two tries; a chamfer draws in a plug that is up to 3 mm off
    radius: float = 0.0088  # m round the believed place that is tried
    back: float = 0.003  # m before what was met where the next push begins; choice
    # N by which the gentle pull exceeds the push through the bore: both ways its friction of about 3 N, and 2 N more
    pull: float = 8.0
    friction: float = 3.0  # N of a bore; where the pull ends, so much less than half of it is left
    touch: float = 1.5  # N by which the force falls over six such steps while something gives; choice
    pull_step: float = 0.0005  # m between two feelings of a pull; choice


def spiral(pitch: float, radius: float) -> FloatArray:
    """Points (n, 2) m no more than `radius` from the middle, on a grid of triangles with edge `pitch`, from inside."""
    count = int(np.ceil(2 * radius / pitch))
    i, j = np.mgrid[-count : count + 1, -count : count + 1].reshape(2, -1)
    points = pitch * np.column_stack([i + 0.5 * j, np.sqrt(0.75) * j])
    distances = np.linalg.norm(points, axis=1).round(9)
    order = np.lexsort((np.arctan2(points[:, 1], points[:, 0]), distances))
    return points[order][distances[order] <= radius]


class Plugging:
    """Pushes a plug into a bore.

    `go` are steps that bring the hand to a pose (world_from_tool) and return the efforts (n,) that its drives then
    need; `force` turns a change of them into the force (3,) N on the plug's tip, in the world. `goal` is
    world_from_tool with the plug all the way in at `plug` (world_from_connector), `depth` m deep. A place in the mouth
    is (depth, across, across) in m, in the plug's axes.
    """

    def __init__(
        self,
        go: Go,
        force: Callable[[FloatArray], FloatArray],
        goal: RigidTransform,
        plug: RigidTransform,
        depth: float,
        parameters: PluggingParameters = PluggingParameters(),
    ) -> None:
        self._go, self._force, self._goal, self._depth, self._parameters = go, force, goal, depth, parameters
        self._frame = plug.rotation.as_matrix()
        self._at, self._felt, self._efforts = np.zeros(3), np.zeros(3), np.zeros(0)
        self._tare = np.zeros((3, 0))  # coefficients of the efforts without contact, by the depth, highest power first
        self._strongest = 0.0

    def insert(self) -> Generator[None, None, PluggedIn | None]:
        """Push at one place after the other until the plug is in and holds; None when none is left."""
        values = self._parameters
        yield from self._feel_nothing()
        begin = -values.gaps[-1]
        for number, across in enumerate(spiral(values.pitch, values.radius), 1):
            yield from self._to(np.array([begin, *across]))
            passed = yield from self._push()
            if (yield from self._holds(passed)):
                return PluggedIn(number, self._at[1:].copy(), self._strongest)
            yield from self._to(np.array([begin, *self._at[1:]]))
        return None

    def _feel_nothing(self) -> Iterator[None]:
        """Feel before the mouth what pulls on the hand: its weight and the cable, which change along the way."""
        gaps, felt = np.array(self._parameters.gaps), []
        for gap in gaps:
            yield from self._to(np.array([-gap, 0.0, 0.0]))
            felt.append(self._efforts)
        self._tare = np.polyfit(-gaps, np.array(felt), 2)

    def _push(self) -> Generator[None, None, float]:
        """Push on along the bore, and yield to what pushes across, until it goes no further.

        Returns the resistance in N that was felt some steps before.
        """
        values, yielded = self._parameters, 0
        passed = deque([self._pressed], maxlen=values.look_back)
        while self._at[0] < self._depth + values.deeper:
            across = self._felt[1:]
            sideways = float(np.linalg.norm(across))
            blocked = self._pressed > min(passed[0] + values.push, values.most)
            yielded = yielded + 1 if blocked else 0
            if blocked and (sideways < values.across or yielded > values.yields):
                break
            way = np.zeros(3) if blocked else np.array([values.step, 0.0, 0.0])
            if sideways > values.across:
                way[1:] = min(values.yielding, values.most_yielding / sideways) * across
            if not blocked:
                passed.append(self._pressed)
            yield from self._to(self._at + way)
        return passed[0]

    def _holds(self, passed: float) -> Generator[None, None, bool]:
        """Pull gently at a plug that resisted with `passed` N on its way; whether something holds it.

        The plug is then neither pulled nor pressed.
        """
        values, step = self._parameters, np.array([self._parameters.pull_step, 0.0, 0.0])
        drawn: deque[float] = deque(maxlen=2 * values.look_back)
        while self._pressed > passed - values.pull:
            if len(drawn) == drawn.maxlen and drawn[0] - self._pressed < values.touch:
                return False
            drawn.append(self._pressed)
            yield from self._to(self._at - step)
        while self._pressed < passed - values.friction:
            yield from self._to(self._at + step)
        return True

    @property
    def _pressed(self) -> float:
        """The force in N against the way in, less what was felt of weight and cable."""
        return -float(self._felt[0])

    def _to(self, at: FloatArray) -> Iterator[None]:
        """Bring the tip to a place (3,) m in the mouth as believed, and feel there."""
        self._at = np.asarray(at)
        way = self._frame @ (self._at - [self._depth, 0.0, 0.0])
        pose = RigidTransform.from_components(self._goal.translation + way, self._goal.rotation)
        self._efforts = yield from self._go(pose)
        if self._tare.size:
            expected = np.polyval(self._tare, self._at[0])
            self._felt = self._force(self._efforts - expected) @ self._frame
            self._strongest = max(self._strongest, float(np.linalg.norm(self._felt)))
