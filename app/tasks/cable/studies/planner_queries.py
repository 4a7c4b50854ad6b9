"""Queries to the planner, such as a whole run asks: between stops of each arm, all free with the margin."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import islice

import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cable.cell import PLUGGED_INTO, CableKnown
from regrasp.interfaces.cell import WristMount
from regrasp.interfaces.scene import Obstacle
from regrasp.motion.cable.viewpoints import SpiralParameters, closer_views, spiral
from regrasp.motion.failure import PlanningError
from regrasp.motion.grasping.approach import find_approaches, pick_candidates
from regrasp.motion.robots.views import ik_view
from regrasp.motion.scene.collision import Clearances, CollisionModel
from regrasp.motion.scene.planning_scene import PlanningScene


@dataclass(frozen=True, eq=False)
class Query:
    """A question to a planner: joints (6,) rad at both ends of `arm`, `margin` m from all in the model."""

    arm: str
    model: CollisionModel
    start: FloatArray
    goal: FloatArray
    margin: float


@dataclass(frozen=True)
class QueryParameters:
    """What the queries are drawn from."""

    # m, the middle and the half edges of where a lost end settles in the thesis cell without gravity
    lost_at: tuple[float, float, float] = (0.36, 0.145, 0.21)
    lost_within: tuple[float, float, float] = (0.02, 0.04, 0.06)
    lost_turn: float = 0.4  # rad, standard deviation of the lost end's turn out of world y
    lost_ends: int = 2  # choice: gives each arm some 20 stops
    views: int = 6  # viewpoints of the camera of each kind and lost end that are kept
    tried_views: int = 40  # viewpoints of a kind that are tried
    standoffs: int = 3  # standoffs of a grasp that are kept
    camera_margin: float = 0.02  # m, as the search of a run keeps
    voxel: float = 0.01  # m, edge of the voxels in which obstacles are seen
    search_distance: float = 0.25  # m from the plane of the search, as in a run
    clearances: Clearances = field(default_factory=Clearances)


def draw_queries(
    scene: PlanningScene,
    obstacles: Sequence[Obstacle],
    rng: np.random.Generator,
    count: int,
    parameters: QueryParameters = QueryParameters(),
) -> list[Query]:
    """So many queries to either arm in turn, from stop to stop; the obstacles are seen as the surfaces of voxels.

    The camera arm stops at viewpoints of a search and of closer looks. The other stops before grasps of a connector in
    the socket, in the clip and where it was lost. Both sleep. The arm that does not move is where the scene reads it.
    """
    points = [_surface(o, parameters.voxel) for o in obstacles]
    scene.set_obstacles(np.vstack(points) if points else np.empty((0, 3)), parameters.voxel)
    lost = [_lost_end(rng, parameters) for _ in range(parameters.lost_ends)]
    camera_arm = next(c.mount.arm for c in scene.known.cameras if isinstance(c.mount, WristMount))
    hand = next(spec.name for spec in scene.known.arms if spec.name != camera_arm)
    asked = []
    for arm, margin, stops in (
        (camera_arm, parameters.camera_margin, _viewing(scene, camera_arm, lost, parameters)),
        (hand, parameters.clearances.margin, _grasping(scene, hand, lost, parameters)),
    ):
        model = scene.model(arm)
        found = np.array([q for q in (np.array(scene.known.arm(arm).sleep), *stops) if model.free(q, margin)])
        asked.append(_between(arm, model, found, margin, rng))
    return [next(asked[n % 2]) for n in range(count)]


def _between(
    arm: str, model: CollisionModel, stops: FloatArray, margin: float, rng: np.random.Generator
) -> Iterator[Query]:
    """Queries between two different stops (n, 6); every third begins or ends at the first, the sleep pose."""
    if len(stops) < 3:
        raise ValueError(f"the {arm} arm has {len(stops)} free stops only; draw from other obstacles")
    while True:
        for kind in range(3):
            a, b = rng.choice(np.arange(1, len(stops)), 2, replace=False)
            if kind == 2:
                a, b = (0, b) if rng.random() < 0.5 else (a, 0)
            yield Query(arm, model, stops[a], stops[b], margin)


def _lost_end(rng: np.random.Generator, parameters: QueryParameters) -> RigidTransform:
    """world_from_connector of a lost end: about along world y."""
    place = np.asarray(parameters.lost_at) + rng.uniform(-1, 1, 3) * parameters.lost_within
    turn = Rotation.from_rotvec(rng.normal(scale=parameters.lost_turn, size=3)) * Rotation.from_euler("z", 90, True)
    return RigidTransform.from_components(place, turn)


def _viewing(
    scene: PlanningScene, arm: str, lost: Sequence[RigidTransform], parameters: QueryParameters
) -> Iterator[FloatArray]:
    """Joints (6,) rad at viewpoints of the search for the lost ends, and of closer looks at them."""
    known = _with_cable(scene)
    rear, mount = known.camera(known.cable.overview), known.search_mount
    assert not isinstance(rear.mount, WristMount)
    model, size = scene.model(arm), SpiralParameters(distance=parameters.search_distance)
    for end in lost:
        search = spiral(end.translation, rear.mount.world_from_camera, rear.intrinsics, size)
        for views in ((view.world_from_camera for view in search), closer_views(end)):
            tried = islice(views, parameters.tried_views)
            found = (ik_view(scene.kinematics[arm], view, mount.mount_from_camera) for view in tried)
            free = (next((q for q in qs if model.free(q, parameters.camera_margin)), None) for qs in found)
            yield from islice((q for q in free if q is not None), parameters.views)


def _grasping(
    scene: PlanningScene, arm: str, lost: Sequence[RigidTransform], parameters: QueryParameters
) -> Iterator[FloatArray]:
    """Joints (6,) rad before grasps of a connector in the socket, in the clip, and where it was lost."""
    cable = _with_cable(scene).cable
    connector = cable.connector
    plug = cable.socket(PLUGGED_INTO).world_from_plug(connector.length)
    sleep = np.array(scene.known.arm(arm).sleep)
    model, near = scene.model(arm), scene.model(arm, without=cable.clip.bracket)
    for pose in (plug, cable.clip.world_from_seat, *lost):
        try:
            grasps = pick_candidates(pose, connector, 0.0, scene.known.arm(arm).robot.gripper.opening)
            paths = find_approaches(model, near, sleep, grasps, parameters.clearances)
        except PlanningError:  # none from which this one can be reached
            continue
        yield from (path[0] for path in paths[: parameters.standoffs])


def _with_cable(scene: PlanningScene) -> CableKnown:
    assert isinstance(scene.known, CableKnown)
    return scene.known


def _surface(obstacle: Obstacle, voxel: float) -> FloatArray:
    """Points (n, 3) m on the surface of an obstacle and of its stand, about `voxel` apart."""
    turn = Rotation.from_euler("z", obstacle.yaw)
    points = []
    for box in (obstacle.box, obstacle.stand):
        if box is not None:
            axes = [np.linspace(-0.5, 0.5, max(2, 1 + round(edge / voxel))) for edge in box.size]
            grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
            shell = grid[np.abs(grid).max(axis=1) == 0.5]
            points.append(turn.apply(shell * np.asarray(box.size)) + np.asarray(box.center))
    return np.vstack(points)
