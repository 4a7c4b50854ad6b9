"""Perception at a printer: where the handle of its door is, and where the printed part."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np
from scipy.spatial.transform import RigidTransform

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cell import Box
from regrasp.interfaces.devices import Camera, Clock
from regrasp.interfaces.frame import RgbdFrame
from regrasp.interfaces.outline import Outline
from regrasp.interfaces.printer.actions import PlaceView, Sighting
from regrasp.interfaces.printer.cell import PrinterKnown
from regrasp.interfaces.wall_time import counts_as
from regrasp.perception.camera.color import SegmentationParameters, color_mask
from regrasp.perception.camera.model import deproject, hull
from regrasp.perception.detection import corners
from regrasp.perception.mapping.occupancy import Spheres
from regrasp.perception.printer.approach_tables import ApproachTables, load_tables
from regrasp.perception.printer.part_track import PartTracker, PartTrackParameters
from regrasp.perception.service import Perception, PerceptionParameters


@dataclass(frozen=True)
class PrinterPerceptionParameters(PerceptionParameters):
    """Those of every task, and of the handle."""

    least_points: int = 200  # pixels of the handle with depth; choice: it has 2000 at 0.35 m
    track: PartTrackParameters = field(default_factory=PartTrackParameters)
    place_rise: float = 0.015  # m over a place's floor from which a point belongs to what stands there; choice: camera
    # and arm are off by 6 mm at 0.45 m
    place_inset: float = 0.015  # m within a place's edges that do not count, for the same reason
    place_top: float = 0.99  # quantile of the points' heights that counts as how high something rises
    span: tuple[float, float] = (0.5, 99.5)  # percentiles of its pixels between which its middle lies; choice


class PrinterPerception(Perception):
    """Sees the handle of the door, and the printed part."""

    parameters: PrinterPerceptionParameters

    def __init__(
        self,
        known: PrinterKnown,
        cameras: Mapping[str, Camera],
        clock: Clock,
        pose_of: Callable[[RgbdFrame], RigidTransform],
        arm_spheres: Callable[[], list[Spheres]],
        parameters: PrinterPerceptionParameters = PrinterPerceptionParameters(),
    ) -> None:
        super().__init__(known, cameras, clock, pose_of, arm_spheres, parameters)
        self._known_printer = known
        self.tables: ApproachTables | None = None  # None: the shipped ones, once they are asked for
        self._color = SegmentationParameters.for_color(known.printer.door.handle.color)

    def part_tracker(
        self,
        tool_of: Callable[[RgbdFrame], RigidTransform],
        gap: Callable[[], float],
        since: float,
        say: Callable[..., None] = lambda event, **values: None,
    ) -> PartTracker:
        """What follows the part's section through the camera on the hand, in frames from the time `since` (s) on.

        `tool_of` gives world_from_tool at a frame's exposure, `gap` what the finger encoder reads (m), and `say` is
        told what the record should show.
        """
        return PartTracker(self, self._known_printer, tool_of, gap, since, self.parameters.track, say)

    def offset_by_tables(self, seen: Sighting) -> FloatArray:
        """Offset (3,) m in the world from the tool to its goal before the part, see `ApproachTables`."""
        if self.tables is None:
            self.tables = load_tables()
        return self.tables.offset(seen)

    @counts_as("perception")
    def see_handle(self, camera: str, since: float) -> FloatArray | None:
        """The middle (3,) m, world, of the handle's front as the newest frame shows it.

        It is the middle of what has the handle's colour, at the median of the depths there: these are missing in parts.
        None while there is no frame from the time `since` (s) on, in trouble, or where too few pixels have a depth.
        """
        frame = self.frame(camera)
        if frame is None or frame.stamp < since or self.trouble(camera) is not None:
            return None
        mask = color_mask(frame.rgb, self._color) > 0
        depths = deproject(frame.depth, mask, frame.intrinsics)[:, 2]
        if len(depths) < self.parameters.least_points:
            return None
        (top, left), (bottom, right) = np.percentile(np.argwhere(mask), self.parameters.span, axis=0)
        self.found(camera, Outline("handle, by its colour", frame.stamp, corners((left, top, right, bottom))))
        u, v = 0.5 * (left + right), 0.5 * (top + bottom)
        k, depth = frame.intrinsics, float(np.median(depths))
        return self.pose_of(frame).apply([depth * (u - k.cx) / k.fx, depth * (v - k.cy) / k.fy, depth])

    @counts_as("perception")
    def see_place(self, camera: str, since: float, place: Box) -> PlaceView | None:
        """What stands on a place, the box that something shall take up, as the newest frame of a camera shows it.

        Points over the box's bottom by less than `place_rise` m count as the place's own surface. None while there is
        no frame from the time `since` (s) on, or in trouble.
        """
        values, points = self.parameters, self.surface(camera, since)
        if points is None or self.trouble(camera) is not None:
            return None
        bottom = np.array(place.center) - 0.5 * np.array(place.size)
        off = points - bottom
        beside = np.array([values.place_inset, values.place_inset, -values.place_rise])
        within = np.all((off > beside) & (off < np.array(place.size) - np.maximum(beside, 0.0)), axis=1)
        inside, over = points[within], off[within][:, 2]
        above = over[over > values.place_rise]
        height = float(np.quantile(over, values.place_top)) if len(over) else 0.0
        self._outline_place(camera, place, inside[over > values.place_rise], height)
        return PlaceView(len(over), len(above), height)

    def _outline_place(self, camera: str, place: Box, above: FloatArray, height: float) -> None:
        """Note what was found on a place: points (n, 3) m over its floor up to `height` m, or that it is free."""
        frame = self.frame(camera)
        if frame is None:
            return
        low, high = (
            np.array(place.center) - 0.5 * np.array(place.size),
            np.array(place.center) + 0.5 * np.array(place.size),
        )
        floor = np.array(
            [(x, y, low[2]) for x, y in ((low[0], low[1]), (high[0], low[1]), (high[0], high[1]), (low[0], high[1]))]
        )
        label = f"{1e3 * height:.0f} mm high in the {place.name}" if len(above) else f"{place.name}, free"
        points = self.pose_of(frame).inv().apply(above if len(above) else floor)
        self.found(camera, Outline(label, frame.stamp, hull(points, frame.intrinsics)))
