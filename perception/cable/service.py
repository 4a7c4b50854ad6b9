"""Answers what the cable's leaves ask: where the connector is, how it lies in the hand, whether it got lost."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.spatial.transform import RigidTransform

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cable.cell import CableKnown, Connector
from regrasp.interfaces.cable.sight import (
    Estimate,
    InHand,
    NoEstimate,
    NotSeen,
    Sightings,
    TrackHealth,
    TrackState,
)
from regrasp.interfaces.devices import Camera, Clock
from regrasp.interfaces.evidence import Evidence
from regrasp.interfaces.frame import RgbdFrame
from regrasp.interfaces.outline import Outline
from regrasp.interfaces.request import Request
from regrasp.interfaces.services import Obstacles
from regrasp.interfaces.wall_time import counts_as
from regrasp.perception.cable.in_hand import InHandParameters, connector_axis, connector_in_hand
from regrasp.perception.cable.reach import within_reach
from regrasp.perception.cable.watching import FrameRule, watched
from regrasp.perception.camera.model import hull
from regrasp.perception.mapping.occupancy import Spared, Spheres
from regrasp.perception.pose.fusion import fuse
from regrasp.perception.pose.technique import make_technique
from regrasp.perception.service import Perception, PerceptionParameters
from regrasp.perception.tracking.slip import distance_slip, seen_at
from regrasp.perception.tracking.stillness import StillnessParameters
from regrasp.perception.tracking.track import ConnectorTrack, TrackParameters


def _stillness_of_a_cable() -> StillnessParameters:
    # Of the mean brightness: a cable that moves by about 1 mm; the jaw allows for 20 mm.
    return StillnessParameters(threshold=0.25)


@dataclass(frozen=True)
class CablePerceptionParameters(PerceptionParameters):
    """Those of every task, and of what concerns the connector."""

    frames_before_mapping: int = 3  # a frozen camera is noticed after so many frames
    # m from the seat: 20 mm for the clip, 10 mm for the camera's error, the rest for a part that the clip hides
    stowed_radius: float = 0.04
    # m round the connector's axis; voxels in it that were never seen, only taken for occupied, do not count; choice
    clear_radius: float = 0.05
    reach_error: float = 0.025  # m beyond the cable's length where its end may be seen: cameras err by 20 mm
    stillness: StillnessParameters = field(default_factory=_stillness_of_a_cable)
    track: TrackParameters = field(default_factory=TrackParameters)
    in_hand: InHandParameters = field(default_factory=InHandParameters)


class CablePerception(Perception):
    """Sees the connector, too, and keeps its track."""

    parameters: CablePerceptionParameters
    _known: CableKnown

    def __init__(
        self,
        known: CableKnown,
        cameras: Mapping[str, Camera],
        clock: Clock,
        pose_of: Callable[[RgbdFrame], RigidTransform],
        arm_spheres: Callable[[], list[Spheres]],
        parameters: CablePerceptionParameters = CablePerceptionParameters(),
    ) -> None:
        super().__init__(known, cameras, clock, pose_of, arm_spheres, parameters)
        self._technique = make_technique("fused", known)
        self._results: dict[str, tuple[int, Estimate | NoEstimate]] = {}
        self.track = ConnectorTrack(parameters.track)
        self._axis: FloatArray | None = None  # see `expect_in_hand`

    def look_around(self) -> int:
        """As in every task; before, a look at the connector tells the track where it is while no hand hides it."""
        self.look(self._known.cable.overview)
        return super().look_around()

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
        result = self._technique.estimate(newest, self.pose_of(newest), axis=self._axis, near=near)
        if isinstance(result, Estimate):
            result = within_reach(result, self._known, self.parameters.reach_error)
        self._results[camera] = (newest.number, result)
        self.track.feed(result)
        return result

    def outlines(self, camera: str) -> list[Outline]:
        """As in every task, and the connector as it was estimated last: a cylinder of its size."""
        found = super().outlines(camera)
        frame, (_, seen) = self.frame(camera), self._results.get(camera, (0, None))
        if frame is not None and isinstance(seen, Estimate) and seen.world_from_camera is not None:
            rims = (seen.world_from_camera.inv() * seen.world_from_connector).apply(_rims(self._known.cable.connector))
            found.append(Outline("connector, as estimated", seen.stamp, hull(rims, frame.intrinsics)))
        return found

    def watch(
        self,
        camera: str,
        seconds: float,
        *,
        settle: float = 0.0,
        later: bool = False,
        on_mapped: Callable[[], None] | None = None,
    ) -> Request[Sightings]:
        """Look through a camera at every tick, from the next on, for `seconds` after `settle` seconds.

        Frames exposed in the last `seconds` count, each once. One of their very first moment does unless only `later`
        ones shall: a hand may still have moved then. With `on_mapped` the obstacles before the camera are mapped once
        it has shown enough frames to be trusted, and this is called.
        """
        rule = FrameRule(self._clock.now(), seconds, settle, later)
        return watched(self, self._clock, camera, rule, on_mapped, self.parameters.frames_before_mapping)

    @counts_as("perception")
    def fuse(self, estimates: Sequence[Estimate]) -> Estimate:
        """One estimate from several of a connector at rest. Raises ValueError without any."""
        return fuse(estimates)

    def expect_in_hand(self, tool: RigidTransform | None, held: RigidTransform | None = None) -> None:
        """From now on, a connector that is not seen may be hidden by the hand, which is at `tool` (world_from_tool).

        `held` (tool_from_connector) tells the direction from cable to tip, where the robot knows it; see `Technique`.
        None ends either.
        """
        self.track.set_holding_tool(None if tool is None else tool.translation)
        self._axis = None if tool is None or held is None else connector_axis(tool * held)

    def use(self, technique: str) -> None:
        """Look by this technique from now on. Raises ValueError if the cell lacks what it needs."""
        self._technique, self._results = make_technique(technique, self._known), {}

    @property
    def last(self) -> Estimate | None:
        """The track's newest estimate, however old."""
        return self.track.last

    def check(self) -> TrackHealth:
        """The thesis's three questions to the track now."""
        return self.track.check(self._clock.now())

    def state(self) -> tuple[TrackState, str]:
        """What is known of the connector now, and a sentence. What the hand hides is not lost."""
        return self.track.state(self._clock.now())

    def slipped(self, tool: RigidTransform) -> Evidence | None:
        """The thesis's test of the distance to the hand at `tool` (world_from_tool), only while the connector is seen.

        One that the hand hides has not slipped: None.
        """
        last = self.track.last
        if last is None or self.state()[0] is not TrackState.VISIBLE:
            return None
        return distance_slip(tool.translation, last.position)

    def stowed(self, estimate: Estimate) -> Evidence:
        """Whether a connector seen so lies in the clip."""
        return seen_at(estimate.position, np.array(self._known.cable.clip.seat), self.parameters.stowed_radius)

    def plugged(self, estimate: Estimate, socket: str) -> Evidence:
        """Whether a connector seen so lies in the socket of that name."""
        plug = self._known.cable.socket(socket).world_from_plug(self._known.cable.connector.length)
        return seen_at(estimate.position, plug.translation, self.parameters.stowed_radius)

    @counts_as("perception")
    def in_hand(
        self, seen: Sequence[Estimate], tool: RigidTransform, held: RigidTransform, *, least_turn_deg: float = 0.0
    ) -> InHand | None:
        """How the connector lies in the hand at `tool` (world_from_tool), where it was believed to be `held`.

        `held` is tool_from_connector. None where too little of it is seen. A turn by less than `least_turn_deg` is
        taken for an error of the sight.
        """
        length = self._known.cable.connector.length
        return connector_in_hand(seen, length, tool, held, least_turn_deg, self.parameters.in_hand)

    def obstacles_beside(self, world_from_connector: RigidTransform) -> Obstacles:
        """`obstacles` without unseen voxels near a connector: it was looked at, so only seen surfaces count there."""
        found, half = self.obstacles(), 0.5 * self._known.cable.connector.length
        far = _distance_to_axis(found.unseen, world_from_connector, half) > self.parameters.clear_radius
        return found._replace(unseen=found.unseen[far])

    def _spared(self) -> Spared | None:
        connector = self._known.cable.connector
        return Spared(connector.color, 2 * connector.radius)


def _rims(connector: Connector) -> FloatArray:
    """Points (n, 3) m round both ends of a connector, in its frame."""
    angles = np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False)
    rim = connector.radius * np.column_stack([np.zeros(24), np.cos(angles), np.sin(angles)])
    end = np.array([0.5 * connector.length, 0.0, 0.0])
    return np.vstack([rim - end, rim + end])


def _distance_to_axis(points: FloatArray, connector: RigidTransform, half: float) -> FloatArray:
    """Distances (n,) m of points (n, 3) m to the connector's axis, a segment of `half` m to each side of its centre."""
    if not len(points):
        return np.empty(0)
    local = connector.inv().apply(points)
    local[:, 0] -= np.clip(local[:, 0], -half, half)
    return np.asarray(np.linalg.norm(local, axis=1))
