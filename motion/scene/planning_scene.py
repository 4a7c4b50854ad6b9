"""The planning scene: where the arms are, and what they must not touch."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform

from regrasp.interfaces.arguments import positive, rows
from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cause import CauseCode
from regrasp.interfaces.cell import Box, KnownCell, WristMount
from regrasp.interfaces.devices import Arm, Gripper
from regrasp.interfaces.frame import RgbdFrame
from regrasp.interfaces.quote import arm_words
from regrasp.interfaces.wall_time import counts_as
from regrasp.motion.failure import PlanningError
from regrasp.motion.robots.contact_guard import Touch
from regrasp.motion.robots.contact_place import ContactPlaceParameters, contact_place, felt_points
from regrasp.motion.robots.ik_parameters import InverseKinematicsParameters
from regrasp.motion.robots.kinematics import ArmKinematics
from regrasp.motion.robots.spheres import sphere_distances
from regrasp.motion.scene.collision import ArmBody, CollisionModel, CollisionParameters
from regrasp.motion.scene.distance_grid import FREE_DISTANCE, DistanceGrid

NO_POINTS = np.empty((0, 3))


@dataclass(frozen=True)
class PlanningSceneParameters:
    """How seen points become obstacles."""

    # m round an arm where seen points are its own: 13 mm of depth error, half a voxel's diagonal, 5 mm of arm error
    arm_margin: float = 0.025
    touching: float = 0.005  # m; a seen point so near to a standing arm is no obstacle
    # m further from a base than the arm's links are long: what it carries and where a camera looks
    beyond_reach: float = 0.2
    grid_border: float = 0.2  # m round the voxels; no sphere of an arm is thicker
    sight_samples: int = 24  # points on a line of sight that must be free; choice
    sight_range: tuple[float, float] = (0.15, 0.85)  # shares of a line of sight that are checked: not its ends; choice
    felt_time: float = 60.0  # s that a felt place stays on the map; what was felt may move, as a cable does; choice
    pad_radius: float = 0.01  # m of the disc at a pad that counts as what a jaw met; choice
    contact: ContactPlaceParameters = field(default_factory=ContactPlaceParameters)
    collision: CollisionParameters = field(default_factory=CollisionParameters)
    kinematics: InverseKinematicsParameters = field(default_factory=InverseKinematicsParameters)


class PlanningScene:
    """The arms as read, the cell as known, and the voxels and other points as seen."""

    def __init__(
        self,
        known: KnownCell,
        arms: Mapping[str, Arm],
        grippers: Mapping[str, Gripper],
        parameters: PlanningSceneParameters = PlanningSceneParameters(),
    ) -> None:
        self.known, self.arms, self.grippers = known, arms, grippers
        self._scene_parameters = parameters
        self.kinematics: dict[str, ArmKinematics] = {
            spec.name: ArmKinematics(spec.robot, spec.world_from_base, parameters.kinematics) for spec in known.arms
        }
        self._cameras: dict[str, WristMount] = {
            c.mount.arm: c.mount for c in known.cameras if isinstance(c.mount, WristMount)
        }
        self._boxes = known.solids()
        self._grids: dict[bool, DistanceGrid | None] = {}  # optimistic or not; made when asked for
        self._all_mapped: DistanceGrid | None = None  # made when asked for
        self._points = self._unseen = self._more = self._all_points = NO_POINTS
        self._certain: NDArray[np.int64] = np.empty(0, np.int64)  # the voxels among them that were seen without an arm
        self._felt: list[tuple[float, FloatArray]] = []  # when, and points (n, 3) m
        self._spacing = 0.01  # m, until the first voxels come

    @counts_as("planning")
    def set_obstacles(
        self,
        points: FloatArray,
        spacing: float,
        unseen: FloatArray | None = None,
        shadow: FloatArray | None = None,
    ) -> None:
        """Keep clear of occupied voxels from now on: centres (n, 3) m in the world, and the edge `spacing` m.

        `unseen` (m, 3) m are voxels that no camera has seen, behind seen surfaces: an arm enters them only where it
        finds no other way. In the `shadow` (k, 3) m, further behind, it moves slowly, as beside a surface. Points where
        an arm sleeps do not count, nor those where one is now unless they were there before it came: what was seen
        there was an arm. Nor do points that no arm reaches.
        Raises ValueError for points that are not finite and a spacing that is not above 0.
        """
        margin = self._scene_parameters.arm_margin
        self._points, self._spacing = self._within_reach(points), positive("the spacing", spacing)
        self._unseen = self._within_reach(NO_POINTS if unseen is None else unseen)
        dark = self._within_reach(NO_POINTS if shadow is None else shadow)
        self._all_points = np.vstack([self._points, self._unseen, dark])
        now = max((arm.reading().stamp for arm in self.arms.values()), default=0.0)
        self._felt = [(at, felt) for at, felt in self._felt if at > now - self._scene_parameters.felt_time]
        for spec in self.known.arms:
            asleep = self.model(spec.name, others=False).spheres(np.array(spec.sleep))
            self._points = _points_beyond(self._points, asleep, margin)
            self._unseen = _points_beyond(self._unseen, asleep, margin)
        alone = self._points
        for spec in self.known.arms:
            body = self.model(spec.name, others=False).spheres(self.joints(spec.name))
            alone = _points_beyond(alone, body, margin)
            self._unseen = _points_beyond(self._unseen, body, margin)
        keys = _voxel_keys(self._points, spacing)
        self._certain = np.union1d(np.intersect1d(keys, self._certain), _voxel_keys(alone, spacing))
        self._points = self._points[np.isin(keys, self._certain)]
        self._forget_grids()

    @counts_as("planning")
    def keep_clear(self, points: FloatArray) -> None:
        """Keep clear of these points (n, 3) m too, such as a cable's; they replace an earlier call's.

        Points that no arm reaches do not count. Raises ValueError for points that are not finite.
        """
        self._more = self._within_reach(points)
        self._forget_grids()

    @counts_as("planning")
    def feel(self, arm: str, touch: Touch) -> FloatArray:
        """Keep clear of where an arm touched something, as well; the place (3,) m in the world.

        Not of what would be in the place of a sleeping arm: from there they came.
        """
        model = self.model(arm)
        spheres, kin = model.spheres(touch.joints), self.kinematics[arm]
        place, inward = contact_place(
            kin, spheres, model.links, touch, model.clearances(touch.joints), self._scene_parameters.contact
        )
        felt = felt_points(place, inward, self._spacing, self._scene_parameters.contact)
        for spec in self.known.arms:
            felt = _points_beyond(
                felt, self.model(spec.name, others=False).spheres(np.array(spec.sleep)), self._spacing
            )
        self._felt.append((touch.stamp, felt))
        self._forget_grids()
        return place

    @counts_as("planning")
    def feel_in_jaw(self, arm: str, gap: float, thickness: float) -> None:
        """Keep clear of what a jaw may have met beside a thing of `thickness` m: one pad or both, `gap` m apart."""
        reading, tool = self.arms[arm].reading(), self.kinematics[arm].tool_matrix(self.joints(arm))
        pad = self._scene_parameters.pad_radius
        disc = replace(self._scene_parameters.contact, radius=pad, depth=max(0.5 * (gap - thickness), 0.0))
        for side in (-1.0, 1.0):
            across = side * tool[:3, 1]
            felt = felt_points(tool[:3, 3] + 0.5 * gap * across, -across, self._spacing, disc)
            self._felt.append((reading.stamp, felt))
        self._forget_grids()

    def forget_felt(self) -> bool:
        """Take what was felt off the map; whether there was any. Where a touch was is known to centimetres only."""
        felt, self._felt = self._felt, []
        self._forget_grids()
        return bool(felt)

    def _forget_grids(self) -> None:
        self._grids.clear()
        self._all_mapped = None

    def _within_reach(self, points: FloatArray) -> FloatArray:
        """The points (n, 3) m as far from an arm's base as it reaches, and `beyond_reach`; the grid grows no larger."""
        seen = rows("the points", points, 3)
        beyond, near = self._scene_parameters.beyond_reach, np.zeros(len(seen), np.bool_)
        for kin in self.kinematics.values():
            near |= np.linalg.norm(seen - kin.base[:3, 3], axis=1) < kin.reach + beyond
        return seen[near]

    @counts_as("planning")
    def grid_beside(self, course: FloatArray, radius: float, optimistic: bool = False) -> DistanceGrid:
        """The distances to all points further than `radius` m from a `course` (n, 3) m: no obstacle is there."""
        spheres = np.column_stack([course, np.zeros(len(course))])
        return self._grid_of(_points_beyond(self._map(optimistic), spheres, radius), optimistic)

    def _map(self, optimistic: bool, felt: bool = True) -> FloatArray:
        guesses = [] if optimistic else [self._unseen]
        return np.vstack([self._points, self._more, *guesses, *(some for _, some in self._felt if felt)])

    def _grid_of(self, points: FloatArray, optimistic: bool) -> DistanceGrid:
        border = self._scene_parameters.grid_border
        if not len(points):
            return DistanceGrid(np.full((1, 1, 1), FREE_DISTANCE, np.float32), np.zeros(3), 1e-3)
        lower, upper = points.min(axis=0) - border, points.max(axis=0) + border
        return DistanceGrid.from_points(points, lower, upper, self._spacing, least=not optimistic)

    @counts_as("planning")
    def all_mapped(self, felt: bool = True) -> DistanceGrid | None:
        """The least distances to all points: the shadow's, and those that may be an arm itself, here or asleep.

        Without `felt`, not to where an arm has touched something.
        """
        if not felt and self._felt:
            points = np.vstack([self._all_points, self._map(optimistic=False, felt=False)])
            return self._grid_of(points, optimistic=False) if len(points) else None
        if self._all_mapped is None and len(points := np.vstack([self._all_points, self._map(optimistic=False)])):
            self._all_mapped = self._grid_of(points, optimistic=False)
        return self._all_mapped

    def _grid(self, optimistic: bool = False) -> DistanceGrid | None:
        """The least distances to all points, or the likely ones to those that were seen; None where there are none."""
        if optimistic not in self._grids:
            points = self._map(optimistic)
            self._grids[optimistic] = self._grid_of(points, optimistic) if len(points) else None
        return self._grids[optimistic]

    @counts_as("planning")
    def start_model(
        self,
        arm: str,
        *,
        held: FloatArray | None = None,
        without: Collection[Box] = (),
        opening: float | None = None,
        optimistic: bool = False,
    ) -> CollisionModel:
        """`model` for a motion that begins now; seen points that the arm touches where it stands are forgotten.

        Voxels are coarse and cameras err by millimetres: a hand that came in beside an obstacle must get out again.
        """
        model = self.model(arm, held=held, without=without, opening=opening, optimistic=optimistic)
        distance, what = model.nearest(self.joints(arm))
        touching = self._scene_parameters.touching
        if what == "seen surface" and distance < touching:
            spheres, reach = model.spheres(self.joints(arm)), self._spacing
            self._points = _points_beyond(self._points, spheres, reach)
            self._unseen = _points_beyond(self._unseen, spheres, reach)
            self._more = _points_beyond(self._more, spheres, reach)
            self._felt = [(at, _points_beyond(felt, spheres, reach)) for at, felt in self._felt]
            self._forget_grids()
            model = self.model(arm, held=held, without=without, opening=opening, optimistic=optimistic)
        return model

    def joints(self, arm: str) -> FloatArray:
        """The arm's joints (n,) as read. Raises PlanningError ARM_FAILED where an encoder gives no number."""
        positions = self.arms[arm].reading().positions
        if not np.isfinite(positions).all():
            names = self.kinematics[arm].chain.names
            silent = ", ".join(names[i] for i in np.flatnonzero(~np.isfinite(positions)))
            message = f"the encoders of {arm_words(arm)} give no number for {silent}"
            raise PlanningError(CauseCode.ARM_FAILED, message)
        return positions

    def tool(self, arm: str) -> RigidTransform:
        """world_from_tool as read."""
        return self.kinematics[arm].tool(self.joints(arm))

    def camera_pose(self, frame: RgbdFrame) -> RigidTransform:
        """world_from_camera of a frame, by the mount as known and the encoders as read at the exposure."""
        mount = self.known.camera(frame.camera).mount
        if isinstance(mount, WristMount):
            assert frame.joints is not None
            return self.kinematics[mount.arm].mount(frame.joints) * mount.mount_from_camera
        return mount.world_from_camera

    @counts_as("planning")
    def spheres(self) -> list[tuple[FloatArray, FloatArray]]:
        """The arms' bodies now: centres (n, 3) m and radii (n,) m of each."""
        bodies = [self.model(name, others=False).spheres(self.joints(name)) for name in self.arms]
        return [(s[:, :3], s[:, 3]) for s in bodies]

    @counts_as("planning")
    def model(
        self,
        arm: str,
        *,
        held: FloatArray | None = None,
        others: bool = True,
        without: Collection[Box] = (),
        opening: float | None = None,
        optimistic: bool = False,
        grown: float = 0.0,
    ) -> CollisionModel:
        """What `arm` must not touch now.

        `held` (m, 4) m are spheres in the tool frame that stand for what the hand carries. Without `others` the other
        arms and the seen surfaces do not count; the boxes `without` may be touched. The jaw stands as the fingers read,
        or `opening` m wide. `optimistic`: the space that no camera has seen
        counts as free, and seen surfaces are taken to be at the far sides of their voxels. Known boxes count as
        `grown` m larger on each side.
        """
        bodies = [
            self.model(name, others=False).spheres(self.joints(name)) for name in self.arms if others and name != arm
        ]
        boxes = [_larger(box, grown) if grown else box for box in self._boxes if box not in without]
        camera = self._cameras.get(arm)
        body = ArmBody(
            camera.offset if camera else None,
            held,
            self.grippers[arm].reading().gap if opening is None else opening,
        )
        other = np.vstack(bodies) if bodies else None
        grid = self._grid(optimistic) if others else None
        return CollisionModel(self.kinematics[arm], boxes, body, other, grid, self._scene_parameters.collision)

    @counts_as("planning")
    def sees(
        self, world_from_camera: RigidTransform, points: FloatArray, optimistic: bool = False, past: str | None = None
    ) -> bool:
        """Whether nothing known or mapped stands between a camera and any of the points (n, 3) m; see `model`.

        Nor the arm `past`, if one is named.
        """
        eye = world_from_camera.translation
        first, last = self._scene_parameters.sight_range
        shares = np.linspace(first, last, self._scene_parameters.sight_samples)[:, None, None]
        rays = (eye + shares * (points - eye)).reshape(-1, 3)
        for box in self._boxes:
            if np.any(np.all(np.abs(rays - box.center) < 0.5 * np.array(box.size), axis=1)):
                return False
        if past is not None:
            body = self.model(past, others=False).spheres(self.joints(past))
            if np.min(sphere_distances(rays, body)[0]) < 0.0:
                return False
        grid = self._grid(optimistic)
        return grid is None or bool(np.min(grid.at(rays)) > 0.0)


def _larger(box: Box, by: float) -> Box:
    """The box, `by` m larger on each side."""
    x, y, z = (edge + 2 * by for edge in box.size)
    return box.model_copy(update={"size": (x, y, z)})


def _voxel_keys(points: FloatArray, edge: float) -> NDArray[np.int64]:
    """A number (n,) for each of the voxels in which points (n, 3) lie, of this `edge` m."""
    most = 1 << 20  # voxels from the origin along an axis
    i, j, k = (np.floor(points / edge).astype(np.int64) + most).T
    return np.asarray((i << 42) | (j << 21) | k)


def _points_beyond(points: FloatArray, spheres: FloatArray, margin: float) -> FloatArray:
    """The points (n, 3) further than `margin` m from the spheres (m, 4)."""
    reach = spheres[:, 3:] + margin
    lower, upper = (spheres[:, :3] - reach).min(axis=0), (spheres[:, :3] + reach).max(axis=0)
    near = np.all((points >= lower) & (points <= upper), axis=1)  # most points lie far from an arm
    near[near] = sphere_distances(points[near], spheres)[0] <= margin
    return points[~near]
