"""All the evidence at once: colour, outline, depth, the connector's size, its cable, and the cell's known faces.

A cylinder of the known size is fitted to the depth readings and to the outline of the coloured patch together, each
weighed by its noise. So a half-hidden connector is not drawn towards its visible part, and what has the colour but not
the shape is refused.
"""

from dataclasses import dataclass, replace

import cv2
import numba
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform

from regrasp.interfaces.cell import Box, Connector, KnownCell, pose_along
from regrasp.interfaces.frame import RgbdFrame
from regrasp.perception.camera.model import NEAREST
from regrasp.perception.camera.registration import FIXED, CameraErrors, Registration, expected_errors, register
from regrasp.perception.pose.cable_end import cable_leaves
from regrasp.perception.pose.estimate import LEFT, ROLL_VARIANCE, Estimate, NoEstimate
from regrasp.perception.pose.fused.blob import D415, MIN_AREA, Cut, Patch, Stereo, directions, look, patches
from regrasp.perception.pose.fused.cylinder import COARSE, FINE, Fit, Sight, depth_misses, fit, nearest_on_rays, thinned
from regrasp.perception.pose.segmentation import NotSeen, SegmentationParameters, color_mask

FloatArray = NDArray[np.float64]
Mask = NDArray[np.bool_]

MIN_READINGS, MIN_EDGES = 12, 8
SIDE_SEEN = 2.0  # choice: a patch so many times longer than wide shows which way the axis runs in the image
TILTS = np.deg2rad([-80.0, -65.0, -40.0, 0.0, 40.0, 65.0, 80.0])  # of the starts, out of the image: noise tilts a stub
TURNS = np.deg2rad([0.0, 45.0, 90.0, 135.0])  # of the starts, in the image, where the patch does not show it
ROUGH_COUNT, ROUGH_STEPS = 50, 6  # points and outline points of rough fits, and their steps
PROMISING = (10, 4)  # starts that are fitted roughly, rough fits that are fitted in full
ALIKE, ALIKE_COSINE = 0.02, 0.94  # m, and of 20 degrees: fits so near to each other end alike
MISSING_COST = 100.0  # of a whole axis that should show: what is not there weighs like twenty points off
DOUBT = 3.0  # of cost that makes another fit e times less likely; 1 by theory, whose noise has no outliers
ALONG = np.linspace(-0.45, 0.45, 19)  # of its length: places on the axis that should show
BEFORE = 0.7  # of the radius before the axis; choice: between what touches the body there and the surface of a cable
HOPELESS = 4.0  # choice: a fit so many times worse than the best is no doubt, and not worth more steps
END = 0.004  # m: outline points so near to an end belong to it
END_EDGES = 4  # of them show that the end is in sight
SIDE_EDGES = 3  # outline points on either side of the axis that show how thick it is
BESIDE = 10  # pixels round a patch in which more of its colour, beyond the fit, makes it a part of something larger
# Refused is what does not fit. Of 140 renders in all poses, up to 70 % hidden, 139 stay within all of these.
MAX_EDGE_MISS = 0.5  # pixels, median over the outline
MAX_STRAY = 0.3  # share of the outline that lies more than a pixel off: a cable before it makes as much
MAX_MIDDLE_MISS, MAX_FAR_MISS = 1.2, 2.2  # deviations of depth: median, and 80th percentile
MAX_BESIDE = 0.25  # of the patch's pixels
HEAD_ON = np.cos(np.deg2rad(4.0))  # choice: seen so nearly along its axis it shows a disc, as balls do
EXPECTED = 0.05  # m from where it was last: there a little of it will do; choice: half its length
LEAST_SHOWN = 1.8  # radii of its length: of 70 % hidden ones 19 mm have readings, of bits of other things up to 17
MAX_SURPRISE = 40.0  # of the camera's correction; choice: errors as expected exceed it once in a million cameras
MAX_MISSING = 0.15  # share of the axis that should show and does not; a shorter rod of 7 cm misses a tenth


@dataclass(frozen=True, eq=False)
class _Found:
    """A fit that holds, in the camera's frame; `sign` is +1 where the axis points from cable to tip, 0 if not seen."""

    patch: Patch
    fit: Fit
    whole: bool
    sign: float


@dataclass(frozen=True, eq=False)
class _Refused:
    """A patch that is not the connector, or shows too little of it, and why; see `NoEstimate`."""

    reason: NotSeen
    message: str
    glimpse: FloatArray | None = None


class Fused:
    """A `Technique`. It knows the connector's colour and size, and the cell's floor and panels."""

    def __init__(self, known: KnownCell) -> None:
        self._connector, self._boxes = known.connector, known.boxes
        self._errors: dict[str, CameraErrors] = {c.name: expected_errors(known, c.name) for c in known.cameras}
        self._stereo: dict[str, Stereo] = {c.name: Stereo.of(c) for c in known.cameras}
        self._color = SegmentationParameters.for_color(known.connector.color)

    def estimate(
        self,
        frame: RgbdFrame,
        world_from_camera: RigidTransform,
        *,
        axis: FloatArray | None = None,
        near: FloatArray | None = None,
    ) -> Estimate | NoEstimate:
        """See `Technique.estimate`."""
        cuts = patches(color_mask(frame.rgb, self._color))
        if not cuts:
            message = f"no patch of {MIN_AREA} pixels has the connector's colour"
            return NoEstimate(frame.stamp, frame.camera, NotSeen.NO_COLOR, message)
        camera = register(frame, world_from_camera, self._boxes, self._errors.get(frame.camera, FIXED))
        if camera.surprise > MAX_SURPRISE:
            message = "the cell's panels are not where the camera's intrinsics, its depth and its place put them"
            return NoEstimate(frame.stamp, frame.camera, NotSeen.NO_CAMERA, message)
        results = [self._find(frame, cut, camera, near) for cut in cuts]
        found = [r for r in results if isinstance(r, _Found)]
        if not found:
            refused = [r for r in results if isinstance(r, _Refused)]
            told = next((r for r in refused if r.glimpse is not None), refused[0])
            return NoEstimate(frame.stamp, frame.camera, told.reason, told.message, told.glimpse)
        return _estimate(frame, camera, _choose(found, camera, near), axis)

    def _find(self, frame: RgbdFrame, cut: Cut, camera: Registration, near: FloatArray | None) -> _Found | _Refused:
        patch = look(frame, cut, camera.scale, self._stereo.get(frame.camera, D415))
        readings, edges = len(patch.sight.points), int(np.count_nonzero(~patch.sight.inside))
        if readings < MIN_READINGS:
            return _Refused(
                NotSeen.NO_DEPTH, f"{readings} depth readings on {patch.area} pixels, {MIN_READINGS} are needed"
            )
        if edges < MIN_EDGES:
            return _Refused(NotSeen.TOO_SMALL, f"{edges} points of its outline are in sight, {MIN_EDGES} are needed")
        best, *others = _fits(patch, self._connector)
        refusal = _refusal(patch, best, self._connector)
        if refusal is not None:
            return _Refused(NotSeen.NOT_ITS_SHAPE, refusal)
        center = camera.world_from_camera.apply(best.center)
        for box in self._boxes:  # a flat piece of its colour on a panel, partly hidden, fits best there
            if _behind_face(box, camera.world_from_camera.translation, center):
                message = f"it would lie within the {box.name.replace('_', ' ')} or behind it"
                return _Refused(NotSeen.NOT_ITS_SHAPE, message)
        whole, leaves = _ends(patch, best, self._connector)
        if leaves == [False, False]:
            return _Refused(NotSeen.NOT_ITS_SHAPE, "no cable leaves either of its ends")
        expected = near is not None and float(np.linalg.norm(center - near)) < EXPECTED
        if True not in leaves and not expected and (less := _too_little(patch, best, self._connector)) is not None:
            return _Refused(NotSeen.TOO_SMALL, f"no cable shows, and {less}", center)
        sign = float(leaves[0] is True) - float(leaves[1] is True)
        return _Found(patch, _doubted(best, others), whole, sign)


def _behind_face(box: Box, eye: FloatArray, place: FloatArray) -> bool:
    """Whether the way from the camera at `eye` (3,) m to a place (3,) m leads into the box."""
    with np.errstate(divide="ignore", invalid="ignore"):
        low, high = ((np.add(box.center, side * np.divide(box.size, 2)) - eye) / (place - eye) for side in (-1, 1))
    enters, leaves = np.nanmax(np.minimum(low, high)), np.nanmin(np.maximum(low, high))
    return bool(0.0 < enters < min(leaves, 1.0))


def _fits(patch: Patch, connector: Connector) -> list[Fit]:
    """The best fits of all starts, best first: roughly from each, then in full from the most promising ones."""

    def burden(found: Fit) -> float:
        return found.cost + MISSING_COST * _missing(patch, found, connector)

    size, few = (connector.radius, connector.length), thinned(patch.sight, ROUGH_COUNT)
    starts = [fit(few, *start, *size, COARSE, 0) for start in _starts(patch.sight, connector)]
    starts.sort(key=lambda f: f.cost)
    rough = [fit(few, f.center, f.axis, *size, COARSE, ROUGH_STEPS) for f in _distinct(starts, PROMISING[0])]
    rough.sort(key=burden)
    full = [fit(patch.sight, f.center, f.axis, *size, COARSE) for f in _distinct(rough, PROMISING[1])]
    full.sort(key=burden)
    worst = HOPELESS * (burden(full[0]) + DOUBT)
    return [fit(patch.sight, f.center, f.axis, *size, FINE) for f in full if burden(f) < worst]


def _distinct(fits: list[Fit], count: int) -> list[Fit]:
    """The first `count` of them that are not nearly alike."""
    kept: list[Fit] = []
    for f in fits:
        if not any(
            abs(f.axis @ k.axis) > ALIKE_COSINE and float(np.linalg.norm(f.center - k.center)) < ALIKE for k in kept
        ):
            kept.append(f)
        if len(kept) == count:
            break
    return kept


def _doubted(best: Fit, others: list[Fit]) -> Fit:
    """The best fit, its covariance widened by those that explain the patch nearly as well."""
    covariance = best.covariance.copy()
    for other in others:
        doubt = float(np.exp(min(0.0, (best.cost - other.cost) / DOUBT)))
        turn = np.cross(best.axis, other.axis * (1.0 if best.axis @ other.axis >= 0 else -1.0))
        apart = np.concatenate([other.center - best.center, best.tilts @ turn])
        covariance += doubt * np.outer(apart, apart)
    return replace(best, covariance=covariance)


def _starts(sight: Sight, connector: Connector) -> list[tuple[FloatArray, FloatArray]]:
    """Centres (3,) and axes (3,) to start a fit from: along the patch, tilted in depth, along the line of sight."""
    middle = np.median(sight.points, axis=0)
    view = middle / np.linalg.norm(middle)
    offsets = sight.points - middle
    flat = offsets - np.outer(offsets @ view, view)
    values, vectors = np.linalg.eigh(flat.T @ flat)
    turns = (0.0,) if values[-1] > SIDE_SEEN**2 * values[-2] else TURNS
    ways = [np.cos(turn) * vectors[:, -1] + np.sin(turn) * vectors[:, -2] for turn in turns]
    axes = [np.linalg.eigh(offsets.T @ offsets)[1][:, -1]]
    axes += [np.cos(tilt) * way + np.sin(tilt) * view for way in ways for tilt in TILTS]
    ends = np.percentile(offsets @ np.array(axes).T, [2, 98], axis=0).T
    starts = []
    for axis, (low, high) in zip(axes, ends, strict=True):
        behind = middle + np.pi / 4 * connector.radius * (view - (view @ axis) * axis)
        shifts = (low + connector.length / 2, high - connector.length / 2)
        starts += [(behind + shift * axis, axis) for shift in shifts]
    return starts


def _missing(patch: Patch, found: Fit, connector: Connector) -> float:
    """Share of the axis that should show, nothing being before it, and does not show the patch."""
    k, before = patch.intrinsics, BEFORE * connector.radius
    along = connector.length * ALONG
    return _missing_share(patch.depth, patch.cut.mask, k.fx, k.fy, k.cx, k.cy, found.center, found.axis, along, before)


@numba.njit(cache=True, error_model="numpy")
def _missing_share(
    depth: NDArray[np.float32],
    mask: Mask,
    fx: float,
    fy: float,
    cx: float,
    cy: float,
    center: FloatArray,
    axis: FloatArray,
    along: FloatArray,
    before: float,
) -> float:
    missing = 0
    for a in along:
        x, y, z = center[0] + a * axis[0], center[1] + a * axis[1], center[2] + a * axis[2]
        if z < NEAREST:
            continue
        u, v = round(fx * x / z + cx), round(fy * y / z + cy)
        if not (0 <= u < mask.shape[1] and 0 <= v < mask.shape[0]):
            continue
        # The body shows a radius before its axis or more, a cable that goes on from a shorter rod does not.
        missing += not mask[v, u] and depth[v, u] > z - before
    return missing / len(along)


def _refusal(patch: Patch, found: Fit, connector: Connector) -> str | None:
    """Why the patch is not the connector, in a sentence; None when it may be."""
    sight, size = patch.sight, (connector.radius, connector.length)
    misses, far = nearest_on_rays(sight.rays, found.center, found.axis, *size)
    pixels = np.abs(misses / far * patch.intrinsics.fx)[~sight.inside]
    edge, stray = float(np.median(pixels)), float(np.mean(pixels > 1.0))
    if edge > MAX_EDGE_MISS or stray > MAX_STRAY:
        return f"its outline is {edge:.1f} pixels off the connector's, {stray:.0%} of it more than one"
    off = np.abs(depth_misses(sight.points, sight.deviations, found.center, found.axis, *size))
    middle, most = float(np.median(off)), float(np.percentile(off, 80))
    if middle > MAX_MIDDLE_MISS or most > MAX_FAR_MISS:
        return f"its surface is {middle:.1f} deviations off the connector's, a fifth of it more than {most:.1f}"
    if abs(float(found.axis @ found.center)) > HEAD_ON * float(np.linalg.norm(found.center)):
        return "nothing but a disc shows, which may be an end or a ball"
    if (beside := _beside(patch, found, connector)) > MAX_BESIDE * patch.area:
        return f"{beside} more pixels of its colour lie beside it"
    missing = _missing(patch, found, connector)
    if missing > MAX_MISSING:
        return f"{missing:.0%} of its length should show and does not, at most {MAX_MISSING:.0%} may be"
    return None


def _too_little(patch: Patch, found: Fit, connector: Connector) -> str | None:
    """Why what shows of the body, but for its cable, may be a bit of anything; None where it is enough."""
    if patch.cut.broken_off:
        return "it goes on beyond the picture"
    if not _both_sides(patch, found, connector):
        return "only one side of it"
    shown, least = _extent(patch, found), LEAST_SHOWN * connector.radius
    return f"{1e3 * shown:.0f} mm of its length, {1e3 * least:.0f} are needed" if shown < least else None


def _both_sides(patch: Patch, found: Fit, connector: Connector) -> bool:
    """Whether the outline shows on either side of the axis, between the ends: how thick it is."""
    rays = patch.sight.rays[~patch.sight.inside]
    _, far = nearest_on_rays(rays, found.center, found.axis, connector.radius, connector.length)
    from_center = far[:, None] * rays - found.center
    between = np.abs(from_center @ found.axis) < connector.length / 2 - END
    aside = from_center[between] @ np.cross(found.axis, found.center)
    return bool(min(np.count_nonzero(aside > 0), np.count_nonzero(aside < 0)) >= SIDE_EDGES)


def _beside(patch: Patch, found: Fit, connector: Connector) -> int:
    """Pixels of the colour close to the patch, at its depth, that the fitted body does not explain."""
    kernel = np.ones((2 * BESIDE + 1, 2 * BESIDE + 1), np.uint8)
    v, u = np.nonzero(patch.cut.others & (cv2.dilate(patch.cut.mask.astype(np.uint8), kernel) > 0))
    if not len(u):
        return 0
    rays = directions(np.column_stack([u, v]), patch.intrinsics)
    rays /= np.linalg.norm(rays, axis=1)[:, None]
    misses, far = nearest_on_rays(rays, found.center, found.axis, connector.radius, connector.length)
    return int(np.count_nonzero(misses / far * patch.intrinsics.fx > 1.0))


def _ends(patch: Patch, found: Fit, connector: Connector) -> tuple[bool, list[bool | None]]:
    """Whether an end is in sight, so that the length gives the centre; and whether the cable leaves either end."""
    rays = patch.sight.rays[~patch.sight.inside]
    _, far = nearest_on_rays(rays, found.center, found.axis, connector.radius, connector.length)
    along = (far[:, None] * rays - found.center) @ found.axis
    seen, leaves = [], []
    for side in (-1.0, 1.0):
        near = np.abs(side * along - connector.length / 2) < END
        seen.append(int(np.count_nonzero(near)) >= END_EDGES)
        end = found.center + side * connector.length / 2 * found.axis
        leaves.append(cable_leaves(patch.depth, end, side * found.axis, patch.intrinsics) if seen[-1] else None)
    return any(seen), leaves


def _extent(patch: Patch, found: Fit) -> float:
    """Length m of what shows, along the axis."""
    return float(np.ptp(np.percentile((patch.sight.points - found.center) @ found.axis, [1, 99])))


def _choose(found: list[_Found], camera: Registration, near: FloatArray | None) -> _Found:
    """The one nearest to where it was, else the largest."""
    if near is None:
        return max(found, key=lambda f: f.patch.area)
    place = camera.world_from_camera.inv().apply(near)
    return min(found, key=lambda f: float(np.linalg.norm(f.fit.center - place)))


def _estimate(frame: RgbdFrame, camera: Registration, found: _Found, hint: FloatArray | None) -> Estimate:
    """The find in the world."""
    turn = camera.world_from_camera.rotation
    position, axis = camera.world_from_camera.apply(found.fit.center), turn.apply(found.fit.axis)
    sign = found.sign or (1.0 if axis @ (LEFT if hint is None else hint) >= 0 else -1.0)
    spread = np.zeros((6, 5))
    spread[:3, :3] = turn.as_matrix()
    spread[3:, 3:] = turn.apply(found.fit.tilts).T
    covariance = spread @ found.fit.covariance @ spread.T + camera.point_covariance(position)
    covariance[3:, 3:] += ROLL_VARIANCE * np.outer(axis, axis)
    x, y, z = position.tolist()
    ax, ay, az = (sign * axis).tolist()
    return Estimate(
        frame.stamp,
        frame.camera,
        position,
        sign * axis,
        pose_along((x, y, z), (ax, ay, az)),
        covariance,
        len(found.patch.sight.points),
        found.patch.area,
        _extent(found.patch, found.fit),
        found.whole,
        bool(found.sign),
    )
