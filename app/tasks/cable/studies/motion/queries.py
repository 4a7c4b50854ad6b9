"""Retrieval queries: the motions that getting a lost end back asks of the planner, in cells with random foam."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import islice

import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation

from regrasp.app.tasks.cable.studies.motion.clutter import ClutteredCell, draw_pieces
from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cable.cell import PLUGGED_INTO, CableCell
from regrasp.motion.cable.seating import poses_before
from regrasp.motion.failure import PlanningError
from regrasp.motion.grasping.approach import find_approaches, pick_candidates
from regrasp.motion.scene.collision import CollisionModel


@dataclass(frozen=True, eq=False)
class Query:
    """A question to a planner: from joints `start` to `goal` (n,) rad of `arm`, `margin` m from all in the model.

    `held` is tool_from_connector of what the hand carries.
    """

    kind: str
    cell: ClutteredCell
    arm: str
    model: CollisionModel
    start: FloatArray
    goal: FloatArray
    margin: float
    held: RigidTransform | None = None


@dataclass(frozen=True)
class QueryParameters:
    """Where an end is lost, and how often is drawn. Lengths in m."""

    lower: tuple[float, float, float] = (0.20, -0.20, 0.06)  # corners of where a lost end lies; choice: in reach
    upper: tuple[float, float, float] = (0.44, 0.30, 0.40)
    tilt: float = 0.5  # rad, standard deviation of a lost end's tilt out of the horizontal; choice
    watching: float = 0.5  # share of the hand's queries in which the camera's arm stands at a view of the lost end
    viewpoints: int = 30  # of the search's that are tried; choice
    tries: int = 200  # draws of a cell and a query; choice


class NoQuery(Exception):  # noqa: N818 - it is no error: another is drawn
    """There is no such query in this cell."""


def draw_queries(
    cell: CableCell, kind: str, rng: np.random.Generator, parameters: QueryParameters = QueryParameters()
) -> Iterator[Query]:
    """Queries of a kind (a key of `KINDS`), each in a cell of its own; both ends keep the margin."""
    for _ in range(parameters.tries):
        pieces = draw_pieces(cell, rng)
        cluttered = ClutteredCell(cell.known, pieces, int(rng.integers(2**31)))
        try:
            yield KINDS[kind](kind, cluttered, rng, parameters)
        except (NoQuery, PlanningError):
            continue


def _look(kind: str, cell: ClutteredCell, rng: np.random.Generator, parameters: QueryParameters) -> Query:
    """The camera's arm leaves its sleep for the best view of the lost end."""
    arm = cell.motion.search_arm
    return _query(kind, cell, arm, cell.arms[arm].positions, _best_view(cell, lost_end(rng, parameters)))


def _look_again(kind: str, cell: ClutteredCell, rng: np.random.Generator, parameters: QueryParameters) -> Query:
    """The camera's arm goes from a viewpoint of the search to the best view of the lost end."""
    lost, motion = lost_end(rng, parameters), cell.motion
    views = []
    for viewpoint in islice(motion.search_views(lost.translation)[1], parameters.viewpoints):
        try:
            views.append(motion.view(viewpoint.world_from_camera).joints[0])
        except PlanningError:
            continue
    if not views:
        raise NoQuery
    return _query(kind, cell, motion.search_arm, views[rng.integers(len(views))], _best_view(cell, lost))


def _fetch(kind: str, cell: ClutteredCell, rng: np.random.Generator, parameters: QueryParameters) -> Query:
    """The hand leaves its sleep, or the plug, for the standoff of a grasp of the lost end."""
    lost = lost_end(rng, parameters)
    _watch(cell, lost, rng, parameters)
    start = _asleep(cell) if rng.random() < 0.5 else _approach(cell, _plug(cell), _asleep(cell))[0]
    return _query(kind, cell, cell.motion.hand, start, _approach(cell, lost, start)[0])


def _bring(kind: str, cell: ClutteredCell, rng: np.random.Generator, parameters: QueryParameters) -> Query:
    """The hand, drawn back with the connector in it, goes before the clip."""
    lost = lost_end(rng, parameters)
    _watch(cell, lost, rng, parameters)
    approach = _approach(cell, lost, _asleep(cell))
    held = cell.motion.kinematics[cell.motion.hand].tool(approach[-1]).inv() * lost
    return _query(kind, cell, cell.motion.hand, approach[0], _before_clip(cell, approach[0], held), held)


def _home(kind: str, cell: ClutteredCell, rng: np.random.Generator, parameters: QueryParameters) -> Query:
    """The hand goes to sleep, from before the clip or the standoff of a grasp of the lost end."""
    lost, asleep = lost_end(rng, parameters), _asleep(cell)
    _watch(cell, lost, rng, parameters)
    approach = _approach(cell, lost, asleep)
    start = approach[0]
    if rng.random() < 0.5:
        held = cell.motion.kinematics[cell.motion.hand].tool(approach[-1]).inv() * lost
        start = _before_clip(cell, start, held)
    return _query(kind, cell, cell.motion.hand, start, asleep)


KINDS: dict[str, Callable[[str, ClutteredCell, np.random.Generator, QueryParameters], Query]] = {
    "sleep to view": _look,
    "view to view": _look_again,
    "to a grasp": _fetch,
    "to the clip": _bring,
    "to sleep": _home,
}


def lost_end(rng: np.random.Generator, parameters: QueryParameters) -> RigidTransform:
    """world_from_connector of a lost end: anywhere in its region, in any direction, about level."""
    heading, tilt = rng.uniform(-np.pi, np.pi), rng.normal(scale=parameters.tilt)
    turn = Rotation.from_euler("ZY", [heading, tilt])
    return RigidTransform.from_components(rng.uniform(parameters.lower, parameters.upper), turn)


def _query(
    kind: str,
    cell: ClutteredCell,
    arm: str,
    start: FloatArray,
    goal: FloatArray,
    held: RigidTransform | None = None,
) -> Query:
    """The query with the widest of the margins of a run that both ends keep. Raises `NoQuery` if there is none."""
    parameters = cell.motion.parameters
    spheres = None if held is None else cell.motion.held_spheres(held)
    model = cell.motion.model(arm, held=spheres)
    margins = [parameters.clearances.margin, parameters.clearances.tight_margin]
    if arm == cell.motion.search_arm:
        margins = [parameters.viewing.margin]
    for margin in margins:
        if model.free(start, margin) and model.free(goal, margin):
            return Query(kind, cell, arm, model, start, goal, margin, held)
    raise NoQuery


def _watch(cell: ClutteredCell, lost: RigidTransform, rng: np.random.Generator, parameters: QueryParameters) -> None:
    """Sometimes the camera's arm stands at its view of the lost end while the hand moves."""
    if rng.random() < parameters.watching:
        cell.arms[cell.motion.search_arm].positions = _best_view(cell, lost)


def _best_view(cell: ClutteredCell, lost: RigidTransform) -> FloatArray:
    return cell.motion.best_view(lost).joints[0]


def _asleep(cell: ClutteredCell) -> FloatArray:
    return np.array(cell.known.arm(cell.motion.hand).sleep)


def _plug(cell: ClutteredCell) -> RigidTransform:
    cable = cell.known.cable
    return cable.socket(PLUGGED_INTO).world_from_plug(cable.connector.length)


def _approach(cell: ClutteredCell, connector: RigidTransform, near: FloatArray) -> FloatArray:
    """The joint path (k, n) from standoff to grasp that `pick` would take from joints `near`."""
    motion, known = cell.motion, cell.known
    model = motion.model(motion.hand)
    over_clip = motion.model(motion.hand, without=known.cable.clip.bracket)
    opening = known.arm(motion.hand).robot.gripper.opening
    grasps = pick_candidates(connector, known.cable.connector, 0.0, opening, motion.parameters.pick)
    return find_approaches(model, over_clip, near, grasps, motion.parameters.clearances, motion.parameters.pick)[0]


def _before_clip(cell: ClutteredCell, q: FloatArray, held: RigidTransform) -> FloatArray:
    """Joints before the clip, from where the held connector goes straight in."""
    motion, clip = cell.motion, cell.known.cable.clip
    models = (
        motion.model(motion.hand, held=motion.held_spheres(held)),
        motion.model(motion.hand, without=clip.bracket),
    )
    seating, kin = motion.parameters.seating, motion.kinematics[motion.hand]
    tight = motion.parameters.clearances.tight_margin
    for pose in poses_before(models, q, clip.world_from_seat, held, seating.straight_in, seating):
        for goal in kin.ik(pose, q):
            if models[0].free(goal, tight):
                return np.asarray(goal)
    raise NoQuery
