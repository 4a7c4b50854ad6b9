"""Finds the connector by a small network of our own (Hwang 2024, section 3.2.2, has a YOLOv5 in its place).

The network is a CenterNet (Zhou et al. 2019): it gives a map of how likely each cell holds the centre of a connector's
visible part, and maps of that part's box and of the axis' direction. Unlike the thesis's network it also sees depth, as
the size of what a pixel shows: this tells the connector from a thin rod nearby and a can far away.
`regrasp train-detector` makes the file.
"""

from dataclasses import dataclass, field
from importlib.resources import files

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform

from regrasp.interfaces.arrays import ColorImage, DepthImage, FloatArray
from regrasp.interfaces.cable.cell import CableKnown
from regrasp.interfaces.frame import Intrinsics, RgbdFrame
from regrasp.perception.camera.color import SegmentationParameters, color_mask
from regrasp.perception.camera.model import NEAREST_DEPTH, deproject, project
from regrasp.perception.detection import STRIDE, PixelBox, four_pixels_one, letterboxed, peaks
from regrasp.perception.pose.estimate import DEFAULT_AXIS, Estimate, NoEstimate, pose_covariance
from regrasp.perception.pose.rgbd import RgbdParameters, min_max_axis, seen_pose, without_outliers
from regrasp.perception.pose.segmentation import NoSegment, NotSeen, segment

# The format of the network's input and output. A change needs a new training.
NETWORK_WIDTH, NETWORK_HEIGHT = 432, 240  # px of its picture: half a camera's image, and whole numbers of its cells
NETWORK_INPUT = "four_pixels_one_size"  # name in the file; OpenCV checks an input's name, not its shape
MIN_PIXEL_SIZE = 6e-4  # m that two pixels of the picture show; choice: nearer than 0.1 m counts as without a reading
MAX_NETWORK_DEPTH = 10.0  # m; choice: stereo cameras of this size measure no farther


@dataclass(frozen=True)
class DetectorParameters:
    """Which boxes count, how their depth is read, and how far off the result is."""

    min_score: float = 0.5  # choice: about as many missed as false ones on pictures drawn as the held-out ones are
    min_color_share: float = 0.05  # of a box's pixels; choice: of true ones up to 70 % hidden 499 of 500 have 0.12
    max_detections: int = 10  # in an image; choice: more than a cell holds
    max_overlap: float = 0.5  # intersection over union from which two boxes are one; choice: that of AP50
    window_share: float = 0.3  # of the box's edges, for depth; choice: most of a slanting connector's box is background
    min_readings: int = 5  # choice: fewer make no cluster
    cluster_distance: float = 0.02  # m from the median, on one surface; choice: the connector's thickness
    min_cluster_share: float = 0.2  # of the readings; choice: uniform noise over 1 m has 0.04, a slanting connector 0.5
    max_points: int = 2000  # for the axis; choice: as at 0.6 m; ten times as many, from nearby, tell no more
    # 95 % of the errors of right boxes, on pictures as `evaluate-detector` draws them, lie within 1.96 of these (2.45
    # for an axis, which has two). The front counts as the centre, the visible part as the whole; depth scale is off.
    position_deviation: float = 0.0145  # m, each axis
    rgbd_axis_deviation: float = 0.3  # rad, of an axis by the RGB-D technique
    network_axis_deviation: float = 0.6  # rad, of an axis by the network
    rgbd: RgbdParameters = field(default_factory=RgbdParameters)  # of the axis


@dataclass(frozen=True)
class Detection:
    """A connector in an image."""

    score: float  # 0 to 1
    box: PixelBox  # around its visible part, by the edges of pixels: pixel u covers u - 0.5 to u + 0.5
    angle: float  # rad, of its axis in the image from u to v, -pi/2 to pi/2
    in_plane: float  # length of its unit axis in the image: 1 for one across the view, 0 for one along it

    @property
    def center(self) -> tuple[float, float]:
        """The box's centre (u, v), px."""
        return (self.box[0] + self.box[2]) / 2, (self.box[1] + self.box[3]) / 2

    @property
    def size(self) -> tuple[float, float]:
        """The box's width and height, px."""
        return self.box[2] - self.box[0], self.box[3] - self.box[1]

    def pixels(self, shape: tuple[int, ...], share: float = 1.0) -> tuple[slice, slice]:
        """Rows and columns of the box in an image of `shape` (H, W); `share` of its edges, about its centre."""
        (u, v), (width, height) = self.center, self.size
        ranges = []
        for at, edge, count in ((v, height, shape[0]), (u, width, shape[1])):
            reach = max(share * edge / 2, 1.0)
            ranges.append(
                slice(int(np.clip(np.ceil(at - reach), 0, count)), int(np.clip(np.floor(at + reach) + 1, 0, count)))
            )
        return ranges[0], ranges[1]


class Detector:
    """The thesis's learned technique, a `Technique`. The network knows what it was trained on.

    As in the thesis, the box's centre gives the position in the image, the mean of a cluster of depth readings gives
    the depth, and the RGB-D technique gives the axis, here from the box's pixels alone. Where the box has too little
    depth, the axis is the network's own, taken to lie across the view. A box must show some of the connector's colour.
    """

    def __init__(
        self, known: CableKnown, model: bytes | None = None, parameters: DetectorParameters = DetectorParameters()
    ) -> None:
        """`model` holds an ONNX file; None takes the shipped one."""
        data = shipped_network() if model is None else model
        self._net = cv2.dnn.readNetFromONNX(np.frombuffer(data, np.uint8))
        self._color = SegmentationParameters.for_color(known.cable.connector.color)
        self._parameters = parameters

    def detect(self, frame: RgbdFrame, min_score: float | None = None) -> list[Detection]:
        """The connectors in `frame`, the likeliest first. `min_score` overrides the parameters' own."""
        least = self._parameters.min_score if min_score is None else min_score
        return self._with_color(frame.rgb, self._decode(*self._forward(frame), least))

    def estimate(
        self,
        frame: RgbdFrame,
        world_from_camera: RigidTransform,
        *,
        axis: FloatArray | None = None,
        near: FloatArray | None = None,
    ) -> Estimate | NoEstimate:
        """See `Technique.estimate`."""
        found = self._best(frame, world_from_camera, near)
        if isinstance(found, NoEstimate):
            return found
        limits = self._parameters
        readings = _cluster(frame.depth, found, limits)
        if len(readings) < limits.min_readings:
            message = f"{len(readings)} depth readings in the middle of the box, {limits.min_readings} are needed"
            return NoEstimate(frame.stamp, frame.camera, NotSeen.NO_DEPTH, message)
        depth, k = float(readings.mean()), frame.intrinsics
        u, v = found.center
        center = depth * np.array([(u - k.cx) / k.fx, (v - k.cy) / k.fy, 1.0])
        seen_axis, deviation = self._rgbd_axis(frame, found), limits.rgbd_axis_deviation
        if seen_axis is None:
            seen_axis = np.array([np.cos(found.angle), np.sin(found.angle), 0.0])
            deviation = limits.network_axis_deviation
        pose = seen_pose(center, seen_axis, world_from_camera, DEFAULT_AXIS if axis is None else axis)
        position, direction = pose.translation, pose.as_matrix()[:3, 0]
        covariance = pose_covariance(direction, limits.position_deviation, deviation)
        width, height = found.size
        extent = depth * float(np.hypot(width / k.fx, height / k.fy))
        stamp, camera, area = frame.stamp, frame.camera, round(width * height)
        points, seen_from = len(readings), world_from_camera
        return Estimate(
            stamp,
            camera,
            position,
            direction,
            pose,
            covariance,
            points,
            area,
            extent,
            False,
            world_from_camera=seen_from,
        )

    def _best(
        self, frame: RgbdFrame, world_from_camera: RigidTransform, near: FloatArray | None
    ) -> Detection | NoEstimate:
        """The likeliest detection of the right colour, or the one nearest to `near` (3,) m, world."""
        maps, scale = self._forward(frame)
        least = self._parameters.min_score
        likely = self._decode(maps, scale, least)
        if not likely:
            message = f"the likeliest box scores {maps[0].max():.2f}, {least} is needed"
            return NoEstimate(frame.stamp, frame.camera, NotSeen.LOW_SCORE, message)
        good = self._with_color(frame.rgb, likely)
        if not good:
            share = self._parameters.min_color_share
            message = f"less than {share:.0%} of the likeliest box has the connector's colour"
            return NoEstimate(frame.stamp, frame.camera, NotSeen.NO_COLOR, message)
        if near is None:
            return good[0]
        return _nearest(good, project(world_from_camera.inv().apply([near]), frame.intrinsics))

    def _forward(self, frame: RgbdFrame) -> tuple[NDArray[np.float32], float]:
        """The network's output (7, 30, 54), and the factor by which its picture is smaller than `frame`."""
        image, scale = letterboxed(frame.rgb, (NETWORK_HEIGHT, NETWORK_WIDTH))
        self._net.setInput(network_input(image, pixel_sizes(frame.depth, frame.intrinsics))[None], NETWORK_INPUT)
        maps = self._net.forward()
        if maps.shape != (1, 7, NETWORK_HEIGHT // STRIDE, NETWORK_WIDTH // STRIDE):
            raise ValueError(f"a network that answers with maps of shape {maps.shape} is none of ours")
        return maps[0], scale

    def _decode(self, maps: NDArray[np.float32], scale: float, min_score: float) -> list[Detection]:
        return decode(maps, scale, min_score, self._parameters.max_overlap, self._parameters.max_detections)

    def _with_color(self, rgb: ColorImage, found: list[Detection]) -> list[Detection]:
        """Those that show some of the connector's colour, since the network learned to ignore small changes of hue."""
        parts = ((d, rgb[d.pixels(rgb.shape)]) for d in found)
        masks = ((d, color_mask(part, self._color)) for d, part in parts if part.size)
        return [d for d, mask in masks if cv2.countNonZero(mask) >= self._parameters.min_color_share * mask.size]

    def _rgbd_axis(self, frame: RgbdFrame, box: Detection) -> FloatArray | None:
        """The axis (3,) that the RGB-D technique finds in the box, optical frame; None where it finds too little."""
        there = box.pixels(frame.depth.shape)
        found = segment(frame.rgb[there], self._color)
        if isinstance(found, NoSegment):
            return None
        corner = there[1].start + found.corner[0], there[0].start + found.corner[1]
        cloud = deproject(frame.depth, found.mask, frame.intrinsics, corner)
        cloud = cloud[:: 1 + len(cloud) // self._parameters.max_points]
        limits = self._parameters.rgbd
        points = without_outliers(cloud, limits.outlier_deviations) if len(cloud) >= limits.min_points else cloud
        return min_max_axis(points, limits.end_share) if len(points) >= limits.min_points else None


def _nearest(found: list[Detection], pixel: FloatArray) -> Detection:
    """The detection whose centre is nearest to `pixel` (1, 2); the likeliest if that is NaN, behind the camera."""
    return min(found, key=lambda d: float(np.nan_to_num(np.linalg.norm(d.center - pixel[0]))))


def _cluster(depth: DepthImage, box: Detection, parameters: DetectorParameters) -> FloatArray:
    """Readings (n,) m of `depth` (H, W) about the box's centre that lie on one surface: near to their median.

    (0,) where too few do: such a depth is noise.
    """
    there = depth[box.pixels(depth.shape, parameters.window_share)]
    readings = there[(there > NEAREST_DEPTH) & (there < MAX_NETWORK_DEPTH)].astype(float)  # NaN compares false
    if not len(readings):
        return readings
    cluster = readings[np.abs(readings - np.median(readings)) <= parameters.cluster_distance]
    return cluster if len(cluster) >= parameters.min_cluster_share * len(readings) else readings[:0]


def shipped_network() -> bytes:
    """The ONNX file that comes with Regrasp."""
    return files("regrasp.perception.pose").joinpath("detector.onnx").read_bytes()


def pixel_sizes(depth: DepthImage, intrinsics: Intrinsics) -> NDArray[np.float32]:
    """The width (120, 216) m of what two pixels of the network's picture show, from one reading for every 2x2 of them.

    `depth` (H, W) m; 0 without a reading.
    """
    small, scale = letterboxed(depth, (NETWORK_HEIGHT // 2, NETWORK_WIDTH // 2), cv2.INTER_NEAREST)
    # NaN is in no range; what is not copied is 0.
    small = cv2.copyTo(small, cv2.inRange(small, NEAREST_DEPTH, MAX_NETWORK_DEPTH))
    small *= np.float32(1.0 / (intrinsics.fx * scale))
    return small


def network_input(image: ColorImage, sizes: NDArray[np.float32]) -> NDArray[np.float32]:
    """The network's input (13, h / 2, w / 2) from `image` (h, w, 3) RGB and its `pixel_sizes` (h / 2, w / 2) m.

    Channels 0 to 11 are the image's, see `four_pixels_one`. Channel 12 is half the logarithm of the block's size over
    `MIN_PIXEL_SIZE`, 0 where there is no reading.
    """
    out = np.empty((13, *sizes.shape), np.float32)
    four_pixels_one(image, out[:12])
    logarithm = cv2.log(np.maximum(sizes * np.float32(1 / MIN_PIXEL_SIZE), np.float32(1.0)))
    np.multiply(logarithm, np.float32(0.5), out=out[12])
    return out


def decode(
    maps: NDArray[np.float32],
    scale: float,
    min_score: float,
    max_overlap: float = DetectorParameters.max_overlap,
    max_detections: int = DetectorParameters.max_detections,
) -> list[Detection]:
    """Detections from the network's output (7, 30, 54), the likeliest first; of boxes on one thing only the likeliest.

    The maps are: likelihood; offset of the box's centre from the cell's (u, v, cells); logarithm of its edges (u, v,
    cells); and the axis as in_plane^2 (cos 2 angle, sin 2 angle), which is the same for both its signs.
    """
    rows, columns, scores, boxes = peaks(maps[0], maps[1:5], scale, min_score, max_overlap, max_detections)
    cosine, sine = maps[5:, rows, columns].astype(float)
    angles, in_plane = np.arctan2(sine, cosine) / 2, np.clip(np.hypot(cosine, sine), 0.0, 1.0) ** 0.5
    return [
        Detection(score, box, angle, length)
        for score, box, angle, length in zip(scores.tolist(), boxes, angles.tolist(), in_plane.tolist(), strict=True)
    ]
