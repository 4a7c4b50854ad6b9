"""Whether a drawn cable scene can be solved, by kinematics and the true poses: the robot never sees any of this.

Solved means here: the arms have room where they sleep; the hand has a free way to the plug; the lost end can be seen,
and the hand has a free way to it; and from either grasp there is a free way into the clip. That a motion between these
places is found is not checked.
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np
from scipy.spatial.transform import RigidTransform

from regrasp.app.scenario.shapes import JitteredBox, line_depth
from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cable.cell import PLUGGED_INTO, CableCell, CableKnown
from regrasp.interfaces.cable.fault import CableWhen
from regrasp.interfaces.cell import ArmSpec, Box, FixedMount, WristMount
from regrasp.interfaces.scene import Gravity, Obstacle, SceneSetup
from regrasp.motion.cable.cable_path import natural_paths
from regrasp.motion.cable.held import connector_spheres
from regrasp.motion.cable.seating import poses_before
from regrasp.motion.cable.taking import CableMotionParameters
from regrasp.motion.cable.viewing import outline
from regrasp.motion.cable.viewpoints import closer_views
from regrasp.motion.failure import PlanningError
from regrasp.motion.grasping.approach import find_approaches, pick_candidates
from regrasp.motion.robots.kinematics import ArmKinematics
from regrasp.motion.robots.views import ik_view
from regrasp.motion.scene.collision import ArmBody, CollisionModel
from regrasp.motion.scene.distance_grid import DistanceGrid
from regrasp.perception.camera.model import project
from regrasp.sim.cable.drop import settled_end


@dataclass(frozen=True)
class SolvableParameters:
    """How a scene is checked."""

    voxel: float = 0.01  # m, edge of the voxels in which distances to obstacles are kept; the robot's own are as large
    border: float = 0.2  # m round the obstacles in which they are kept; no sphere of an arm is thicker
    motion: CableMotionParameters = field(default_factory=CableMotionParameters)  # the robot's own


def unsolvable(
    cell: CableCell, gravity: Gravity, setup: SceneSetup, parameters: SolvableParameters = SolvableParameters()
) -> str:
    """Why the scene cannot be solved, in a few words; '' if it can.

    The end is lost where a fault's `carried` says; without one, only plug and clip are looked at.
    """
    scene, cable = TrueScene(cell.known, setup.obstacles, parameters), cell.known.cable
    plug = cable.socket(PLUGGED_INTO).world_from_plug(cable.connector.length)
    if arm := scene.hemmed_in():
        return f"a block too near to the {arm} arm asleep"
    if reason := scene.why_not_stowed(plug, parameters.motion.unplug.shallow):
        return f"{reason} of the plug"
    lost_at = lost_pose(cell.known, setup, parameters.motion)
    if lost_at is None:
        return ""
    settled = settled_end(cell, gravity, setup.obstacles, lost_at)
    if settled is None:
        return "the lost end does not come to rest"
    if not scene.is_seen(settled.connector):
        return "no view of the lost end"
    reason = scene.why_not_stowed(settled.connector, 0.0)
    return f"{reason} of the lost end" if reason else ""


def lost_pose(
    known: CableKnown,
    setup: SceneSetup,
    parameters: CableMotionParameters = CableMotionParameters(),  # noqa: B008 - it does not change
) -> RigidTransform | None:
    """world_from_connector where the hand loses it: while it is drawn out, or on the cable's natural way to the clip.

    None if no fault begins when the connector was carried some way.
    """
    drawn = (fault.when.carried for fault in setup.faults if isinstance(fault.when, CableWhen))
    share = next((span[0] for span in drawn if span is not None), None)
    if share is None:
        return None
    plug = known.cable.socket(PLUGGED_INTO).world_from_plug(known.cable.connector.length)
    back, goal = np.outer(np.linspace(-1.0, 0.0, 10)[::-1], [1.0, 0.0, 0.0]), known.cable.clip.world_from_seat
    out = plug * RigidTransform.from_translation(parameters.unplug.draw_outs[0] * back)
    away = RigidTransform.from_translation(parameters.unplug.retreat * back) * out[-1]
    natural = natural_paths(known, away[-1].as_matrix(), goal.as_matrix(), parameters.carry.cable)
    path = np.concatenate([out.as_matrix(), away.as_matrix(), next(natural)])
    way = goal.translation - plug.translation
    shares = (path[:, :3, 3] - plug.translation) @ way / (way @ way)
    return RigidTransform.from_matrix(path[int(np.argmax(shares >= share))])


class TrueScene:
    """The cell with its obstacles where they are, and both arms asleep."""

    def __init__(self, known: CableKnown, obstacles: Sequence[Obstacle], parameters: SolvableParameters) -> None:
        self._known, self._parameters = known, parameters
        blocks = [(box, o.yaw) for o in obstacles for box in (o.box, o.stand) if box is not None]
        solids = [(box, 0.0) for box in known.solids()]
        self._opaque = [JitteredBox(np.array(b.center), b.size, float(np.rad2deg(yaw))) for b, yaw in blocks + solids]
        self._grid: DistanceGrid | None = None
        if blocks:
            places, yaws = np.array([(box.center, box.size) for box, _ in blocks]), np.array([yaw for _, yaw in blocks])
            self._grid = DistanceGrid.of_boxes(places[:, 0], places[:, 1], yaws, parameters.voxel, parameters.border)

    def hemmed_in(self) -> str:
        """The name of an arm that sleeps nearer to something than any planned motion may begin, or ''."""
        margin = self._parameters.motion.clearances.tight_margin
        arms = self._known.arms
        return next((a.name for a in arms if not self._model(a.name).free(np.array(a.sleep), margin)), "")

    def is_seen(self, connector: RigidTransform) -> bool:
        """Whether the overview camera sees the whole connector, or the one that searches can be brought to see it."""
        known, viewing = self._known, self._parameters.motion.viewing
        points = outline(connector, known.cable.connector.length)
        overview = known.camera(known.cable.overview)
        assert isinstance(overview.mount, FixedMount)  # the cell's check
        pose, k = overview.mount.world_from_camera, overview.intrinsics
        pixels = project(pose.inv().apply(points), k)
        if np.all((pixels >= 0) & (pixels <= [k.width - 1, k.height - 1])) and self._sees(pose, points):
            return True
        mount = known.search_mount
        kin, model = _kinematics(known.arm(mount.arm)), self._model(mount.arm)
        return any(
            self._sees(view, points)
            and any(model.free(q, viewing.margin) for q in ik_view(kin, view, mount.mount_from_camera))
            for view in closer_views(connector, viewing.close_views)
        )

    def why_not_stowed(self, connector: RigidTransform, shallow: float) -> str:
        """Why the hand cannot take the connector (world_from_connector) where it is and bring it into the clip, or ''.

        It lies `shallow` m nearer to the finger tips than the pads' middle.
        """
        known, motion = self._known, self._parameters.motion
        hand, clip = known.arm(known.cable.hand), known.cable.clip
        gap, widest = motion.execution.jaw.open_gap, hand.robot.gripper.opening
        model, near = self._model(hand.name, opening=gap), self._model(hand.name, without=clip.bracket, opening=gap)
        candidates = pick_candidates(connector, known.cable.connector, shallow, widest, motion.pick)
        try:
            ways = find_approaches(model, near, np.array(hand.sleep), candidates, motion.clearances, motion.pick)
        except PlanningError:
            return "no free grasp"
        can_stow = any(self._can_stow(hand, way[-1], connector) for way in ways)
        return "" if can_stow else "no way into the clip from a grasp"

    def _can_stow(self, hand: ArmSpec, q: FloatArray, connector: RigidTransform) -> bool:
        """Whether the hand that takes the connector with joints `q` (n,) can bring it into the clip."""
        cable, motion = self._known.cable, self._parameters.motion
        held = _kinematics(hand).tool(q).inv() * connector
        spheres = connector_spheres(held, cable.connector, motion.connector_padding)
        closed = 2 * cable.connector.radius
        models = (
            self._model(hand.name, held=spheres, opening=closed),
            self._model(hand.name, without=cable.clip.bracket, opening=closed),
        )
        seat, seating = cable.clip.world_from_seat, motion.seating
        return bool(poses_before(models, q, seat, held, seating.straight_in, seating))

    def _model(
        self,
        arm: str,
        *,
        held: FloatArray | None = None,
        without: Collection[Box] = (),
        opening: float | None = None,
    ) -> CollisionModel:
        """As `PlanningScene.model`, with the true obstacles."""
        known = self._known
        others = [_asleep(spec, _camera(known, spec.name)) for spec in known.arms if spec.name != arm]
        boxes = [box for box in known.solids() if box not in without]
        body = ArmBody(_camera(known, arm), held, opening)
        other = np.vstack(others) if others else None
        return CollisionModel(_kinematics(known.arm(arm)), boxes, body, other, self._grid)

    def _sees(self, world_from_camera: RigidTransform, points: FloatArray) -> bool:
        """Whether nothing stands between a camera and any of the points (n, 3) m."""
        sights = [np.array([world_from_camera.translation, point]) for point in points]
        return not any(line_depth(b.generators, b.center, sight, 0.0) > 0 for b in self._opaque for sight in sights)


def _camera(known: CableKnown, arm: str) -> tuple[float, float, float] | None:
    """Where a camera sits in the arm's mount, (3,) m; None if it carries none."""
    mounts = (camera.mount for camera in known.cameras)
    return next((m.offset for m in mounts if isinstance(m, WristMount) and m.arm == arm), None)


@lru_cache(maxsize=8)
def _kinematics(spec: ArmSpec) -> ArmKinematics:
    return ArmKinematics(spec.robot, spec.world_from_base)


@lru_cache(maxsize=8)
def _asleep(spec: ArmSpec, camera: tuple[float, float, float] | None) -> FloatArray:
    """Spheres (n, 4) m of an arm in its sleep pose."""
    return CollisionModel(_kinematics(spec), (), ArmBody(camera)).spheres(np.array(spec.sleep))
