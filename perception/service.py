"""What the leaves ask about the scene: newest frames to estimates, the track, obstacles."""

from collections.abc import Callable, Mapping
from copy import deepcopy
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from scipy.spatial.transform import RigidTransform

from regrasp.interfaces.cell import KnownCell
from regrasp.interfaces.devices import Camera, Clock
from regrasp.interfaces.frame import RgbdFrame
from regrasp.perception.camera.health import CameraHealth
from regrasp.perception.camera.model import NEAREST, rays
from regrasp.perception.camera.registration import Registration, expected_errors, register
from regrasp.perception.mapping.occupancy import ASSUMED_DEPTH, Occupancy, Spheres
from regrasp.perception.pose.estimate import Estimate, NoEstimate
from regrasp.perception.pose.segmentation import NotSeen
from regrasp.perception.pose.technique import TechniqueName, make_technique
from regrasp.perception.tracking.track import ConnectorTrack

# Where obstacles may matter: the space that the arms share with the cable.
VOXEL = 0.010  # m; obstacles stand within 0.1 of the connector, and a hand must pass between
NEW_THING = 80  # voxels: the front of a piece of 9 cm
BESIDE = 0.03  # m; choice: nearer to what is mapped it is the noise of that thing's edges, up to 100 voxels a look
SPARSE, FAR = 3, 1.5  # each so-manieth row and column of `surface`, up to so many metres
REGION = (np.array([0.16, -0.44, 0.01]), np.array([0.50, 0.44, 0.62]))


class Perception:
    """Sees through the cell's cameras.

    `pose_of` gives world_from_camera of a frame as the robot believes it; `arm_spheres` the robot's own bodies now.
    """

    def __init__(
        self,
        known: KnownCell,
        cameras: Mapping[str, Camera],
        clock: Clock,
        pose_of: Callable[[RgbdFrame], RigidTransform],
        arm_spheres: Callable[[], list[Spheres]],
    ) -> None:
        self._known, self._cameras, self._clock = known, cameras, clock
        self._pose_of, self._arm_spheres = pose_of, arm_spheres
        self._technique = make_technique("fused", known)
        self._health = {name: CameraHealth(name) for name in cameras}
        self._results: dict[str, tuple[int, Estimate | NoEstimate]] = {}
        self.track = ConnectorTrack()
        self.hint: NDArray[np.float64] | None = None  # (3,) from cable to tip, as far as it is known: no view tells
        self.occupancy = Occupancy(*REGION, known.solids(), known.connector, VOXEL)

    def frame(self, camera: str) -> RgbdFrame | None:
        """The newest frame; None before the first."""
        return self._cameras[camera].latest()

    def look(self, camera: str) -> Estimate | NoEstimate | None:
        """What the newest frame shows of the connector, None before the first; a new result enters the track.

        A camera in `trouble` shows nothing.
        """
        newest = self._cameras[camera].latest()
        if newest is None:
            return None
        trouble = self.trouble(camera)
        if trouble is not None:
            missed = NoEstimate(newest.stamp, camera, NotSeen.NO_CAMERA, trouble)
            self.track.feed(missed)
            return missed
        if camera in self._results and self._results[camera][0] == newest.number:
            return self._results[camera][1]
        near = self.track.position(self._clock.now())
        result = self._technique.estimate(newest, self._pose_of(newest), axis=self.hint, near=near)
        self._results[camera] = (newest.number, result)
        self.track.feed(result)
        return result

    def use(self, technique: TechniqueName) -> None:
        """Look by this technique from now on. Raises ValueError for a cell that has not what it needs."""
        self._technique, self._results = make_technique(technique, self._known), {}

    def trouble(self, camera: str) -> str | None:
        """Why a camera is not to be trusted now, in a sentence; None when all is well."""
        health, newest = self._health[camera], self._cameras[camera].latest()
        if newest is not None:
            health.feed(newest)
        return health.trouble(self._clock.now())

    def surface(self, camera: str, since: float) -> NDArray[np.float64] | None:
        """Points (n, 3) m, world, that the newest frame shows, the camera set right by the known boxes.

        None while there is no frame from `since` (s) on; no points of a camera in `trouble`.
        """
        if self.trouble(camera) is not None:
            return np.empty((0, 3))
        frame = self.frame(camera)
        if frame is None or frame.stamp < since:
            return None
        place = self._place(frame)
        depth, arms = frame.depth[::SPARSE, ::SPARSE] * place.scale, rays(frame.intrinsics)[::SPARSE, ::SPARSE]
        seen = (depth > NEAREST) & (depth < FAR)  # NaN compares false
        return np.asarray(place.world_from_camera.apply(arms[seen] * depth[seen, None]))

    def map_obstacles(self, camera: str) -> int:
        """Take the newest frame into the occupancy, its camera set right by the known boxes; the number of full voxels.

        Only the rear camera's look makes a guess of what lies behind a surface: slanting looks would put it beside.
        """
        frame = self.frame(camera)
        if frame is not None:
            depth = ASSUMED_DEPTH if camera == "rear" else 0.0
            place = self._place(frame)
            scaled = replace(frame, depth=frame.depth * np.float32(place.scale))
            self.occupancy.integrate(scaled, place.world_from_camera, self._arm_spheres(), depth)
        return len(self.occupancy.occupied_points())

    def map_new_obstacle(self, camera: str) -> int:
        """As `map_obstacles`, if the newest frame shows a thing that is not mapped; the voxels that it fills, else 0.

        What is mapped stays as it is otherwise: every look puts noise on the edges, where a hand must pass.
        """
        before = deepcopy(self.occupancy)
        self.map_obstacles(camera)
        points, mapped = self.occupancy.occupied_points(guessed=False), before.occupied_points()
        if len(mapped) and len(points):
            points = points[cKDTree(mapped).query(points, distance_upper_bound=BESIDE)[0] > BESIDE]
        filled = len(points)
        if filled < NEW_THING:
            self.occupancy = before
            return 0
        return filled

    def _place(self, frame: RgbdFrame) -> Registration:
        """A frame's camera, set right by the known boxes."""
        return register(frame, self._pose_of(frame), self._known.boxes, expected_errors(self._known, frame.camera))
