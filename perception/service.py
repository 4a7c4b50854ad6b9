"""Answers what the leaves ask about the scene, from the newest frames: the connector's pose, its track, obstacles."""

from collections.abc import Callable, Mapping
from copy import deepcopy
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.transform import RigidTransform

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cable.cell import CableKnown
from regrasp.interfaces.devices import Camera, Clock
from regrasp.interfaces.frame import RgbdFrame
from regrasp.interfaces.wall_time import counts_as
from regrasp.perception.camera.health import CameraHealth, CameraHealthParameters
from regrasp.perception.camera.model import NEAREST_DEPTH, pixel_rays
from regrasp.perception.camera.registration import Registration, RegistrationParameters, expected_errors, register
from regrasp.perception.mapping.occupancy import Occupancy, OccupancyParameters, Spheres
from regrasp.perception.pose.estimate import Estimate, NoEstimate
from regrasp.perception.pose.segmentation import NotSeen
from regrasp.perception.pose.technique import TechniqueName, make_technique
from regrasp.perception.tracking.track import ConnectorTrack, TrackParameters


@dataclass(frozen=True)
class PerceptionParameters:
    """The mapped region, what counts as a new obstacle, and the parameters of the parts."""

    # World frame, m. Where obstacles may matter: the space that the arms share with the cable.
    region_lower: tuple[float, float, float] = (0.16, -0.44, 0.01)
    region_upper: tuple[float, float, float] = (0.50, 0.44, 0.62)
    min_new_voxels: int = 80  # of a new obstacle: the front of a piece of 9 cm
    mapped_distance: float = 0.03  # m; choice: what is so near to a mapped thing is the noise of its edges: 100 voxels
    surface_step: int = 3  # px between the readings of `surface`
    surface_range: float = 1.5  # m; farther readings are left out of `surface`
    health: CameraHealthParameters = field(default_factory=CameraHealthParameters)
    registration: RegistrationParameters = field(default_factory=RegistrationParameters)
    occupancy: OccupancyParameters = field(default_factory=OccupancyParameters)
    track: TrackParameters = field(default_factory=TrackParameters)


class Perception:
    """Sees through the cell's cameras.

    `pose_of` gives world_from_camera of a frame by the robot's own kinematics; `arm_spheres` the robot's own bodies
    now.
    """

    def __init__(
        self,
        known: CableKnown,
        cameras: Mapping[str, Camera],
        clock: Clock,
        pose_of: Callable[[RgbdFrame], RigidTransform],
        arm_spheres: Callable[[], list[Spheres]],
        parameters: PerceptionParameters = PerceptionParameters(),
    ) -> None:
        self._parameters = parameters
        self._known, self._cameras, self._clock = known, cameras, clock
        self._pose_of, self._arm_spheres = pose_of, arm_spheres
        self._technique = make_technique("fused", known)
        self._health = {name: CameraHealth(name, parameters.health) for name in cameras}
        self._results: dict[str, tuple[int, Estimate | NoEstimate]] = {}
        self.track = ConnectorTrack(parameters.track)
        self._axis: FloatArray | None = None  # see `expect_in_hand`
        region = np.array(parameters.region_lower), np.array(parameters.region_upper)
        self.occupancy = Occupancy(*region, known.solids(), known.cable.connector, parameters.occupancy)

    def frame(self, camera: str) -> RgbdFrame | None:
        """The newest frame; None before the first."""
        return self._cameras[camera].latest()

    @counts_as("perception")
    def look(self, camera: str) -> Estimate | NoEstimate | None:
        """The connector's pose by the newest frame, or why there is none; None before the first frame.

        A new result enters the track. A camera in `trouble` gives no pose.
        """
        newest = self._cameras[camera].latest()
        if newest is None:
            return None
        trouble = self.trouble(camera)
        if trouble is not None:
            untrusted = NoEstimate(newest.stamp, camera, NotSeen.NO_CAMERA, trouble)
            self.track.feed(untrusted)
            return untrusted
        if camera in self._results and self._results[camera][0] == newest.number:
            return self._results[camera][1]
        near = self.track.position(self._clock.now())
        result = self._technique.estimate(newest, self._pose_of(newest), axis=self._axis, near=near)
        self._results[camera] = (newest.number, result)
        self.track.feed(result)
        return result

    def expect_in_hand(self, position: FloatArray | None, axis: FloatArray | None) -> None:
        """From now on, a connector that is not seen may be hidden by the hand, which is at `position` (3,) m.

        `axis` (3,) is the connector's from cable to tip in the world, where the robot knows it; see `Technique`. None
        ends either.
        """
        self.track.set_holding_tool(position)
        self._axis = axis

    def use(self, technique: TechniqueName) -> None:
        """Look by this technique from now on. Raises ValueError if the cell lacks what it needs."""
        self._technique, self._results = make_technique(technique, self._known), {}

    @counts_as("perception")
    def trouble(self, camera: str) -> str | None:
        """Why a camera is not to be trusted now, in a sentence; None when all is well."""
        health, newest = self._health[camera], self._cameras[camera].latest()
        if newest is not None:
            health.feed(newest)
        return health.trouble(self._clock.now())

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
        registered, step = self._register(frame), self._parameters.surface_step
        depth, rays = frame.depth[::step, ::step] * registered.scale, pixel_rays(frame.intrinsics)[::step, ::step]
        seen = (depth > NEAREST_DEPTH) & (depth < self._parameters.surface_range)  # NaN compares false
        return np.asarray(registered.world_from_camera.apply(rays[seen] * depth[seen, None]))

    @counts_as("perception")
    def map_obstacles(self, camera: str) -> int:
        """Take the newest frame into the occupancy map, by the registered camera; the number of full voxels.

        Only the rear camera guesses what lies behind a surface: from the side the guess would lie beside the obstacle.
        """
        frame = self.frame(camera)
        if frame is not None:
            registered = self._register(frame)
            scaled = replace(frame, depth=frame.depth * np.float32(registered.scale))
            pose, arms = registered.world_from_camera, self._arm_spheres()
            self.occupancy.integrate(scaled, pose, arms, guess_behind=camera == "rear")
        return len(self.occupancy.occupied_points())

    @counts_as("perception")
    def map_new_obstacle(self, camera: str) -> int:
        """As `map_obstacles` if the newest frame shows an obstacle that is not mapped; its number of voxels, else 0.

        Otherwise the map stays as it is: every look adds noise to the edges, where a hand must pass.
        """
        before = deepcopy(self.occupancy)
        self.map_obstacles(camera)
        points, mapped = self.occupancy.occupied_points(guessed=False), before.occupied_points()
        if len(mapped) and len(points):
            near = self._parameters.mapped_distance
            points = points[cKDTree(mapped).query(points, distance_upper_bound=near)[0] > near]
        filled = len(points)
        if filled < self._parameters.min_new_voxels:
            self.occupancy = before
            return 0
        return filled

    def _register(self, frame: RgbdFrame) -> Registration:
        """A frame's camera, corrected by the known boxes."""
        errors = expected_errors(self._known, frame.camera, self._parameters.registration)
        return register(frame, self._pose_of(frame), self._known.boxes, errors, self._parameters.registration)
