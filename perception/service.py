"""Answers what the leaves of every task ask about the scene, from the newest frames: obstacles, surfaces, motion."""

from collections.abc import Callable, Mapping
from copy import deepcopy
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.transform import RigidTransform

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cell import FixedMount, KnownCell, MappedRegion
from regrasp.interfaces.devices import Camera, Clock
from regrasp.interfaces.frame import RgbdFrame
from regrasp.interfaces.outline import Outline
from regrasp.interfaces.services import Obstacles
from regrasp.interfaces.wall_time import counts_as
from regrasp.perception.camera.health import CameraHealth, CameraHealthParameters
from regrasp.perception.camera.model import NEAREST_DEPTH, pixel_rays
from regrasp.perception.camera.registration import Registration, RegistrationParameters, expected_errors, register
from regrasp.perception.mapping.occupancy import Occupancy, OccupancyParameters, Spared, Spheres, Voxel
from regrasp.perception.tracking.stillness import Stillness, StillnessParameters


@dataclass(frozen=True)
class PerceptionParameters:
    """The mapped region, what counts as a new obstacle, and the parameters of the parts."""

    # World frame, m. Where obstacles may matter: in the thesis's cell from the arms' bases to the panel that they face.
    region: MappedRegion = field(
        default_factory=lambda: MappedRegion(lower=(0.0, -0.44, 0.01), upper=(0.50, 0.44, 0.62))
    )
    min_new_voxels: int = 80  # of a new obstacle: the front of a piece of 9 cm
    mapped_distance: float = 0.03  # m; choice: what is so near to a mapped thing is the noise of its edges: 100 voxels
    surface_step: int = 3  # px between the readings of `surface`
    surface_range: float = 1.5  # m; farther readings are left out of `surface`
    health: CameraHealthParameters = field(default_factory=CameraHealthParameters)
    registration: RegistrationParameters = field(default_factory=RegistrationParameters)
    occupancy: OccupancyParameters = field(default_factory=OccupancyParameters)
    stillness: StillnessParameters = field(default_factory=StillnessParameters)


class StillnessWatch:
    """Whether anything moves before a camera at rest; only frames from the time `since` (s) on count."""

    def __init__(self, camera: Camera, since: float, parameters: StillnessParameters) -> None:
        self._camera, self._since, self._stillness = camera, since, Stillness(parameters)

    @counts_as("perception")
    def still(self) -> bool | None:
        """Whether nothing moved of late, the newest frame included; None until there are enough frames to tell."""
        frame = self._camera.latest()
        return None if frame is None or frame.stamp < self._since else self._stillness.feed(frame)


class Perception:
    """Sees through the cell's cameras.

    `pose_of` gives world_from_camera of a frame by the robot's own kinematics; `arm_spheres` the robot's own bodies
    now.
    """

    def __init__(
        self,
        known: KnownCell,
        cameras: Mapping[str, Camera],
        clock: Clock,
        pose_of: Callable[[RgbdFrame], RigidTransform],
        arm_spheres: Callable[[], list[Spheres]],
        parameters: PerceptionParameters = PerceptionParameters(),
    ) -> None:
        self.parameters = parameters
        self._known, self._cameras, self._clock = known, cameras, clock
        self.pose_of, self._arm_spheres = pose_of, arm_spheres
        self._health = {name: CameraHealth(name, parameters.health) for name in cameras}
        self._region = parameters.region if known.mapped is None else known.mapped
        self._mapped = False  # whether a frame was taken into the map
        self._outlines: dict[str, Outline] = {}  # by camera

    @cached_property
    def occupancy(self) -> Occupancy:
        """The map, made when it is first used: that takes a third of a second, and not every tree maps."""
        return Occupancy(self._region, self._known.solids(), self._spared(), self.parameters.occupancy)

    @property
    def fixed_cameras(self) -> tuple[str, ...]:
        """The names of the cameras that no arm carries, in the cell's order."""
        return tuple(camera.name for camera in self._known.cameras if isinstance(camera.mount, FixedMount))

    def frame(self, camera: str) -> RgbdFrame | None:
        """The newest frame; None before the first."""
        return self._cameras[camera].latest()

    def found(self, camera: str, outline: Outline) -> None:
        """Keep what was found in a camera's picture, until the next is found there: a record may draw it."""
        self._outlines[camera] = outline

    def outlines(self, camera: str) -> list[Outline]:
        """What was found last in the pictures of a camera."""
        return [self._outlines[camera]] if camera in self._outlines else []

    @counts_as("perception")
    def trouble(self, camera: str) -> str | None:
        """Why a camera is not to be trusted now, in a sentence; None when all is well."""
        health, newest = self._health[camera], self._cameras[camera].latest()
        if newest is not None:
            health.feed(newest)
        return health.trouble(self._clock.now())

    def repeats(self, camera: str) -> bool:
        """Whether the newest frame, as `trouble` last saw it, shows the same as the one before."""
        return self._health[camera].repeats

    @counts_as("perception")
    def surface(self, camera: str, since: float) -> FloatArray | None:
        """Points (n, 3) m, world, that the newest frame shows, by the registered camera.

        None while there is no frame from the time `since` (s) on; (0, 3) of a camera in `trouble`.
        """
        if self.trouble(camera) is not None:
            return np.empty((0, 3))
        frame = self.frame(camera)
        if frame is None or frame.stamp < since:
            return None
        registered, step = self._register(frame), self.parameters.surface_step
        depth, rays = frame.depth[::step, ::step] * registered.scale, pixel_rays(frame.intrinsics)[::step, ::step]
        seen = (depth > NEAREST_DEPTH) & (depth < self.parameters.surface_range)  # NaN compares false
        return np.asarray(registered.world_from_camera.apply(rays[seen] * depth[seen, None]))

    def look_around(self) -> int:
        """Map what every fixed camera sees; the number of full voxels."""
        for camera in self.fixed_cameras:
            self.map_obstacles(camera)
        return len(self.occupancy.occupied_points()) if self._mapped else 0

    @counts_as("perception")
    def map_obstacles(self, camera: str) -> int:
        """Take the newest frame into the occupancy map, by the registered camera; the number of full voxels.

        Only a fixed camera guesses what lies behind a surface: from the side, as an arm's camera looks, the guess would
        lie beside the obstacle.
        """
        frame = self.frame(camera)
        if frame is not None:
            registered = self._register(frame)
            scaled = replace(frame, depth=frame.depth * np.float32(registered.scale))
            pose, arms = registered.world_from_camera, self._arm_spheres()
            self.occupancy.integrate(scaled, pose, arms, guess_behind=camera in self.fixed_cameras)
            self._mapped = True
        return len(self.occupancy.occupied_points())

    @counts_as("perception")
    def map_new_obstacle(self, camera: str) -> int:
        """As `map_obstacles` if the newest frame shows an obstacle that is not mapped; its number of voxels, else 0.

        Otherwise the map stays as it is: every look adds noise to the edges, where a hand must pass.
        """
        before = deepcopy(self.occupancy)
        self.map_obstacles(camera)
        points, mapped = self.occupancy.occupied_points(Voxel.SURFACE), before.occupied_points()
        if len(mapped) and len(points):
            near = self.parameters.mapped_distance
            points = points[cKDTree(mapped).query(points, distance_upper_bound=near)[0] > near]
        filled = len(points)
        if filled < self.parameters.min_new_voxels:
            self.occupancy = before
            return 0
        return filled

    def obstacles(self) -> Obstacles:
        """The mapped obstacles."""
        if not self._mapped:
            none = np.empty((0, 3))
            return Obstacles(none, self._region.voxel, none, none)
        seen = self.occupancy.occupied_points(Voxel.INSIDE)
        return Obstacles(
            seen, self.occupancy.voxel_size, self.occupancy.unseen_points(), self.occupancy.shadow_points()
        )

    def watch_stillness(self, camera: str) -> StillnessWatch:
        """Begin to watch whether anything moves before a fixed camera."""
        return StillnessWatch(self._cameras[camera], self._clock.now(), self.parameters.stillness)

    def _spared(self) -> Spared | None:
        """What the task takes hold of, which is no obstacle."""
        return None

    def _register(self, frame: RgbdFrame) -> Registration:
        """A frame's camera, corrected by the known boxes."""
        errors = expected_errors(self._known, frame.camera, self.parameters.registration)
        return register(frame, self.pose_of(frame), self._known.boxes, errors, self.parameters.registration)
