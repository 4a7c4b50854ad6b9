"""The connector found by a small network of our own (Hwang 2024, section 3.2.2, has a YOLOv5 in its place).

The network is a CenterNet (Zhou et al. 2019): a map of how likely each cell holds the middle of a connector's visible
part, and maps of that part's box and of the axis' direction. Unlike the thesis's it sees depth, too: as the size of
what a pixel shows, so that a rod nearby and a can afar are none. `regrasp train-detector` makes the file.
"""

from dataclasses import dataclass
from importlib.resources import files
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform

from regrasp.interfaces.cell import KnownCell
from regrasp.interfaces.frame import Intrinsics, RgbdFrame
from regrasp.perception.camera.model import NEAREST, deproject, project
from regrasp.perception.pose.estimate import LEFT, Estimate, NoEstimate, pose_covariance
from regrasp.perception.pose.rgbd import MIN_POINTS, min_max_axis, seen_pose, without_outliers
from regrasp.perception.pose.segmentation import NoSegment, NotSeen, SegmentationParameters, color_mask, segment

FloatArray = NDArray[np.float64]
Box = tuple[float, float, float, float]

WIDTH, HEIGHT = 432, 240  # px of the network's picture: half a camera's image, and whole numbers of its cells
INPUT = "four_pixels_one_size"  # in its file; OpenCV refuses a file with another name, but not with another shape
LEAST_SIZE = 6e-4  # m; of what two pixels of the picture show; choice: nearer than 0.1 m is as without a reading
STRIDE = 8  # px of the picture that a cell of the output covers
MIN_SCORE = 0.5  # choice: about as many missed as false ones on pictures drawn as the held-out ones are
MIN_COLORED = 0.05  # of a box's pixels; choice: of true ones up to 70 % hidden, all but one in 500 have 0.12
MOST = 10  # boxes looked at in an image; choice: more than a cell holds
OVERLAP = 0.5  # intersection over union at which two boxes are one; choice: that of AP50
WINDOW = 0.3  # of the box's edges: where depth is read; choice: most of a slanting connector's box is beside it
# Of position on each axis (m), of a borrowed axis and of the network's own (rad): on pictures as `evaluate-detector`
# draws, 95 % of the errors of right boxes lie within 1.96 of these (2.45 for an axis, which has two). The front is
# taken for the middle, the visible part for the whole, and the depth scale is off.
POSITION_DEVIATION, BORROWED_DEVIATION, OWN_DEVIATION = 0.0145, 0.3, 0.6
FAR = 10.0  # m; choice: stereo cameras of this size read no farther
MOST_POINTS = 2000  # choice: as at 0.6 m; ten times as many, from nearby, tell no more
MIN_READINGS = 5  # choice: fewer make no cluster
CLUSTER = 0.02  # m; readings this near to their median are one surface; choice: the connector's thickness
SURFACE_SHARE = 0.2  # of the readings; choice: even noise over a metre has 0.04, a slanting connector half and more


@dataclass(frozen=True)
class Detection:
    """A connector in an image.

    `score` 0 to 1; `box` (u0, v0, u1, v1) px around its visible part, edges of pixels: pixel u covers u -0.5 to u +0.5;
    `angle`: rad, of its axis in the image from u to v, -pi/2 to pi/2; `in_plane`: the length of its unit axis in the
    image, 1 for one across the view, 0 for one along it.
    """

    score: float
    box: Box
    angle: float
    in_plane: float

    @property
    def middle(self) -> tuple[float, float]:
        """The box's middle (u, v), px."""
        return (self.box[0] + self.box[2]) / 2, (self.box[1] + self.box[3]) / 2

    @property
    def edges(self) -> tuple[float, float]:
        """The box's width and height, px."""
        return self.box[2] - self.box[0], self.box[3] - self.box[1]

    def pixels(self, shape: tuple[int, ...], share: float = 1.0) -> tuple[slice, slice]:
        """Rows and columns of an image of that shape (H, W) in the box, or in so much of its edges about its middle."""
        (u, v), (width, height) = self.middle, self.edges
        ranges = []
        for at, edge, size in ((v, height, shape[0]), (u, width, shape[1])):
            reach = max(share * edge / 2, 1.0)
            ranges.append(
                slice(int(np.clip(np.ceil(at - reach), 0, size)), int(np.clip(np.floor(at + reach) + 1, 0, size)))
            )
        return ranges[0], ranges[1]


class Detector:
    """The thesis's learned technique (`regrasp.perception.pose.technique`): the network knows what it was trained on.

    As there, the middle of the box gives the place in the image, the mean of a cluster of depth readings the depth, and
    the orientation is borrowed from the RGB-D technique, here looking into the box alone. Where that has too little
    depth the axis is the network's own, taken to lie across the view. A box must show some of the connector's colour.
    `model` holds an ONNX file; None takes the shipped one.
    """

    def __init__(self, known: KnownCell, model: bytes | None = None) -> None:
        data = shipped_network() if model is None else model
        self._net = cv2.dnn.readNetFromONNX(np.frombuffer(data, np.uint8))
        self._color = SegmentationParameters.for_color(known.connector.color)

    def detect(self, frame: RgbdFrame, min_score: float = MIN_SCORE) -> list[Detection]:
        """The connectors in `frame` that score at least so, the likeliest first."""
        return self._of_its_color(frame.rgb, decode(*self._answer(frame), min_score))

    def estimate(
        self,
        frame: RgbdFrame,
        world_from_camera: RigidTransform,
        *,
        axis: FloatArray | None = None,
        near: FloatArray | None = None,
    ) -> Estimate | NoEstimate:
        """See `Technique.estimate`."""
        maps, scale = self._answer(frame)
        likely = decode(maps, scale, MIN_SCORE)
        if not likely:
            message = f"the likeliest box scores {maps[0].max():.2f}, {MIN_SCORE} is needed"
            return NoEstimate(frame.stamp, frame.camera, NotSeen.LOW_SCORE, message)
        good = self._of_its_color(frame.rgb, likely)
        if not good:
            message = f"less than {MIN_COLORED:.0%} of the likeliest box has the connector's colour"
            return NoEstimate(frame.stamp, frame.camera, NotSeen.NO_COLOR, message)
        box = (
            good[0]
            if near is None
            else _nearest(good, project(world_from_camera.inv().apply([near]), frame.intrinsics))
        )
        readings = _cluster(frame.depth, box)
        if len(readings) < MIN_READINGS:
            message = f"{len(readings)} depth readings in the middle of the box, {MIN_READINGS} are needed"
            return NoEstimate(frame.stamp, frame.camera, NotSeen.NO_DEPTH, message)
        depth, k = float(readings.mean()), frame.intrinsics
        u, v = box.middle
        center = depth * np.array([(u - k.cx) / k.fx, (v - k.cy) / k.fy, 1.0])
        borrowed = self._borrowed_axis(frame, box)
        own = np.array([np.cos(box.angle), np.sin(box.angle), 0.0])
        hint = LEFT if axis is None else axis
        pose = seen_pose(center, own if borrowed is None else borrowed, world_from_camera, hint)
        position, direction = pose.translation, pose.as_matrix()[:3, 0]
        covariance = pose_covariance(
            direction, POSITION_DEVIATION, OWN_DEVIATION if borrowed is None else BORROWED_DEVIATION
        )
        width, height = box.edges
        extent = depth * float(np.hypot(width / k.fx, height / k.fy))
        stamp, camera, area = frame.stamp, frame.camera, round(width * height)
        return Estimate(stamp, camera, position, direction, pose, covariance, len(readings), area, extent, False)

    def _answer(self, frame: RgbdFrame) -> tuple[NDArray[np.float32], float]:
        """The network's output (7, 30, 54), and how much smaller than `frame` it saw the image."""
        image, scale = fitted(frame.rgb)
        self._net.setInput(network_input(image, pixel_sizes(frame.depth, frame.intrinsics))[None], INPUT)
        maps = self._net.forward()
        if maps.shape != (1, 7, HEIGHT // STRIDE, WIDTH // STRIDE):
            raise ValueError(f"a network that answers with maps of shape {maps.shape} is none of ours")
        return maps[0], scale

    def _of_its_color(self, rgb: NDArray[np.uint8], found: list[Detection]) -> list[Detection]:
        """Those that show some of the connector's colour: the network learned to overlook hues that are a bit off."""
        parts = ((d, rgb[d.pixels(rgb.shape)]) for d in found)
        masks = ((d, color_mask(part, self._color)) for d, part in parts if part.size)
        return [d for d, mask in masks if cv2.countNonZero(mask) >= MIN_COLORED * mask.size]

    def _borrowed_axis(self, frame: RgbdFrame, box: Detection) -> FloatArray | None:
        """The axis (3,) that the RGB-D technique finds in the box, optical frame; None where it finds too little."""
        there = box.pixels(frame.depth.shape)
        found = segment(frame.rgb[there], self._color)
        if isinstance(found, NoSegment):
            return None
        corner = there[1].start + found.corner[0], there[0].start + found.corner[1]
        cloud = deproject(frame.depth, found.mask, frame.intrinsics, corner)
        cloud = cloud[:: 1 + len(cloud) // MOST_POINTS]
        points = without_outliers(cloud) if len(cloud) >= MIN_POINTS else cloud
        return min_max_axis(points) if len(points) >= MIN_POINTS else None


def _nearest(found: list[Detection], pixel: FloatArray) -> Detection:
    """The detection whose middle is nearest to `pixel` (1, 2); the likeliest if that is NaN, behind the camera."""
    return min(found, key=lambda d: float(np.nan_to_num(np.linalg.norm(d.middle - pixel[0]))))


def _cluster(depth: NDArray[np.float32], box: Detection) -> NDArray[np.float64]:
    """Readings (n,) m of `depth` (H, W) about the middle of the box that lie on one surface: near to their median.

    None where hardly any do: such a depth is noise.
    """
    there = depth[box.pixels(depth.shape, WINDOW)]
    readings = there[(there > NEAREST) & (there < FAR)].astype(float)  # NaN compares false
    if not len(readings):
        return readings
    cluster = readings[np.abs(readings - np.median(readings)) <= CLUSTER]
    return cluster if len(cluster) >= SURFACE_SHARE * len(readings) else readings[:0]


def shipped_network() -> bytes:
    """The ONNX file that comes with Regrasp."""
    return files("regrasp.perception.pose").joinpath("detector.onnx").read_bytes()


def fitted(
    image: NDArray[Any], interpolation: int = cv2.INTER_AREA, shape: tuple[int, int] = (HEIGHT, WIDTH)
) -> tuple[NDArray[Any], float]:
    """An image (H, W, ...) shrunk to fit `shape` (h, w), zero beside it: (h, w, ...), and the factor."""
    height, width = image.shape[:2]
    scale = min(shape[1] / width, shape[0] / height)
    size = max(1, round(scale * width)), max(1, round(scale * height))
    canvas = np.zeros((*shape, *image.shape[2:]), image.dtype)
    cv2.resize(image, size, dst=canvas[: size[1], : size[0]], interpolation=interpolation)
    return canvas, scale


def pixel_sizes(depth: NDArray[np.float32], intrinsics: Intrinsics) -> NDArray[np.float32]:
    """The width (120, 216) m of what two pixels of the network's picture show, from one reading for every four of them.

    `depth` (H, W) m; 0 without a reading.
    """
    small, scale = fitted(depth, cv2.INTER_NEAREST, (HEIGHT // 2, WIDTH // 2))
    small = cv2.copyTo(small, cv2.inRange(small, NEAREST, FAR))  # NaN is in no range; what is not copied is 0
    small *= np.float32(1.0 / (intrinsics.fx * scale))
    return small


def network_input(image: NDArray[np.uint8], sizes: NDArray[np.float32]) -> NDArray[np.float32]:
    """What the network sees (13, h / 2, w / 2) of `image` (h, w, 3) RGB and of its `pixel_sizes` (h / 2, w / 2) m.

    Every four neighbours are one: red, green, blue (0 to 1) of the upper left ones, then of those on their right, and
    so below; last half the logarithm of their size over `LEAST_SIZE`, 0 where there is no reading. OpenCV takes a
    seventh less time for the whole network than with the same pixels side by side.
    """
    height, width = sizes.shape
    out = np.empty((13, height, width), np.float32)
    apart = image.reshape(height, 2, width, 2, 3).transpose(1, 3, 4, 0, 2)
    np.multiply(apart, np.float32(1 / 255), out=out[:12].reshape(2, 2, 3, height, width))
    logarithm = cv2.log(np.maximum(sizes * np.float32(1 / LEAST_SIZE), np.float32(1.0)))
    np.multiply(logarithm, np.float32(0.5), out=out[12])
    return out


def decode(maps: NDArray[np.float32], scale: float, min_score: float) -> list[Detection]:
    """Detections from the network's output (7, 30, 54), the likeliest first; of boxes on one thing the likeliest.

    Maps: likelihood, offset of the box's middle from the cell's (u, v, cells), logarithm of its edges (u, v, cells),
    and the axis as in_plane^2 (cos 2 angle, sin 2 angle), which is the same for both its signs.
    """
    rows, columns = np.nonzero(maps[0] >= min_score)
    if not len(rows):
        return []
    scores, du, dv, log_width, log_height, cosine, sine = maps[:, rows, columns].astype(float)
    cell = STRIDE / scale
    middles = cell * np.column_stack([columns + 0.5 + du, rows + 0.5 + dv]) - 0.5
    edges = cell * np.exp(np.clip(np.column_stack([log_width, log_height]), -4, 6))
    boxes = np.hstack([middles - edges / 2, middles + edges / 2]).tolist()
    # CenterNet looks at peaks of the likelihood alone; beside one may be a better box, of a thing that is crossed.
    kept = cv2.dnn.NMSBoxes(np.hstack([middles - edges / 2, edges]).tolist(), scores.tolist(), 0.0, OVERLAP)[:MOST]
    angles, in_plane = np.arctan2(sine, cosine) / 2, np.clip(np.hypot(cosine, sine), 0.0, 1.0) ** 0.5
    return [Detection(float(scores[i]), tuple(boxes[i]), float(angles[i]), float(in_plane[i])) for i in kept]


def overlap(a: Box, b: Box) -> float:
    """Intersection over union of two boxes; 0 of two without area."""
    across, down = min(a[2], b[2]) - max(a[0], b[0]), min(a[3], b[3]) - max(a[1], b[1])
    shared = max(0.0, across) * max(0.0, down)
    union = (a[2] - a[0]) * (a[3] - a[1]) + (b[2] - b[0]) * (b[3] - b[1]) - shared
    return shared / union if union > 0 else 0.0
