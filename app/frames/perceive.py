"""What `regrasp perceive` does: a person's own frames in; the connector's pose, or why there is none, out as JSON."""

import json
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import typer
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform

from regrasp.app.files.findings import Finding, Findings, real_path, shown
from regrasp.app.files.whole_file import write_whole
from regrasp.app.frames.calibration_file import CalibrationFile, load_calibration
from regrasp.app.frames.camera_pose_file import load_camera_pose
from regrasp.app.frames.draw import draw_pose
from regrasp.app.frames.image_files import read_depth, read_rgb
from regrasp.interfaces.cell import FixedMount, KnownCell
from regrasp.interfaces.frame import RgbdFrame
from regrasp.interfaces.quote import nearest, quoted
from regrasp.perception.camera.calibration import undistorted
from regrasp.perception.camera.registration import expected_errors, register
from regrasp.perception.pose.estimate import Estimate, NoEstimate
from regrasp.perception.pose.fiducial import Fiducial
from regrasp.perception.pose.fusion import fuse
from regrasp.perception.pose.technique import TECHNIQUES, Technique, TechniqueName, make_technique

NEEDS_NO_DEPTH = ("fiducial",)
TIP_NOT_TOLD = "the picture does not tell which end is the tip"
FOCAL = (0.2, 20.0)  # of the picture's width; choice: a fisheye has 0.3, a long lens 10


@dataclass(frozen=True)
class Files:
    """The files of one frame, and the camera that took it: its name in the cell, and where it stands."""

    rgb: Path
    depth: Path | None
    intrinsics: Path
    camera: str | None
    pose: Path | None


@dataclass(frozen=True, eq=False)
class Look:
    """A frame, where its camera stands, and what the technique made of it."""

    files: Files
    frame: RgbdFrame
    world_from_camera: RigidTransform
    result: Estimate | NoEstimate


def run(technique: str, files: Sequence[Files], known: KnownCell, unit: float, draw: Path | None) -> bool:
    """Print what is found as JSON, and draw it on the first frame. Whether anything is. Raises `Findings`.

    Poses are in the world of `known` where all cameras' places are known, else in the one camera's frame.
    """
    name = _technique(technique)
    frames = _frames(name, files, known, unit)
    in_world = _in_world(files)
    told = known if in_world else known.model_copy(update={"boxes": ()})
    try:
        finder = make_technique(name, told)
    except ValueError as error:
        raise Findings([Finding("--cell", 0, str(error))]) from None
    looks = [Look(f, frame, pose, finder.estimate(frame, pose)) for f, (frame, pose) in zip(files, frames, strict=True)]
    seen = [look.result for look in looks if isinstance(look.result, Estimate)]
    result = fuse(seen) if seen else _commonest([look.result for look in looks if isinstance(look.result, NoEstimate)])
    answer = {
        "technique": name,
        "frame": "world" if in_world else "camera",
        **_told(result),
        "frames": [
            {**_names(look.files), "camera": look.frame.camera, **_told(look.result), **_clip(finder, look)}
            for look in looks
        ],
    }
    if draw is not None:
        _draw(draw, looks[0], result, told, name)
    typer.echo(_json(answer))
    return bool(seen)


def _technique(name: str) -> TechniqueName:
    for known in TECHNIQUES:
        if name == known:
            return known
    raise Findings([Finding("--technique", 0, f"no technique {quoted(name)}; {nearest(name, TECHNIQUES)}")])


def _in_world(files: Sequence[Files]) -> bool:
    """Whether the cameras' places are known. Raises `Findings` for several cameras, of some of which they are not."""
    placed = [f.camera is not None or f.pose is not None for f in files]
    if not all(placed) and (any(placed) or len({real_path(f.intrinsics) for f in files}) > 1):
        message = "frames of several cameras meet in the world; give --camera or --camera-pose for each, too"
        raise Findings([Finding("--intrinsics", 0, message)])
    return all(placed)


def _frames(
    technique: TechniqueName, files: Sequence[Files], known: KnownCell, unit: float
) -> list[tuple[RgbdFrame, RigidTransform]]:
    """Frames and their world_from_camera. Raises `Findings` for all that is wrong in any file."""
    frames, wrong = [], []
    number_of = {path: i for i, path in enumerate(dict.fromkeys(f.intrinsics for f in files), 1)}
    for number, f in enumerate(files, 1):
        try:
            if f.depth is None and technique not in NEEDS_NO_DEPTH:
                message = f"the technique {technique} needs depth; give --depth FILE for each --rgb"
                raise Findings([Finding("--depth", 0, message)])
            lens = load_calibration(f.intrinsics)
            rgb, depth = _images(f, lens, unit)
            camera = f.camera or ("camera" if len(number_of) == 1 else f"camera {number_of[f.intrinsics]}")
            frame = RgbdFrame(camera, number, 0.0, rgb, depth, lens.intrinsics)
            frames.append((frame, _place(f, known)))
        except Findings as error:
            wrong += error.items
    if wrong:
        raise Findings(wrong)
    return frames


def _images(files: Files, camera: CalibrationFile, unit: float) -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
    """Colour and depth as the camera without its distortion would give them."""
    k, source = camera.intrinsics, shown(files.intrinsics)
    if not all(FOCAL[0] <= f / k.width <= FOCAL[1] for f in (k.fx, k.fy)):
        right = f"expected {FOCAL[0] * k.width:.0f} to {FOCAL[1] * k.width:.0f} for pictures {k.width} wide"
        raise Findings([Finding(source, 0, f"fx, fy are {k.fx:g}, {k.fy:g} pixels; {right}")])
    if not (abs(k.cx - k.width / 2) < k.width and abs(k.cy - k.height / 2) < k.height):
        right = f"expected a point near the middle of {k.width}x{k.height} pixels"
        raise Findings([Finding(source, 0, f"cx, cy are {k.cx:g}, {k.cy:g}; {right}")])
    if _folds(camera):
        right = "write OpenCV's k1, k2, p1, p2, k3, or none"
        raise Findings([Finding(source, 0, f"distortion bends the picture beyond use; {right}")])
    rgb = read_rgb(files.rgb)
    depth = np.zeros((k.height, k.width), np.float32) if files.depth is None else read_depth(files.depth, unit)
    wrong = [
        Finding(shown(path), 0, f"is {image.shape[1]}x{image.shape[0]} pixels, {source} is for {k.width}x{k.height}; "
                "give the pictures and the intrinsics of one camera in one mode, depth aligned to colour")
        for path, image in ((files.rgb, rgb), (files.depth, depth))
        if path is not None and image.shape[:2] != (k.height, k.width)
    ]  # fmt: skip
    if wrong:
        raise Findings(wrong)
    if any(camera.distortion):
        return undistorted(rgb, k, camera.distortion), undistorted(depth, k, camera.distortion)
    return rgb, depth


def _folds(camera: CalibrationFile) -> bool:
    """Whether the distortion folds the picture, or more than doubles it, nearer to its middle than its sides are.

    Further out, where a calibration may have seen nothing, it may.
    """
    k, (k1, k2, _, _, k3) = camera.intrinsics, camera.distortion
    r = np.linspace(0.0, 0.5 * min(k.width / k.fx, k.height / k.fy), 100)
    with np.errstate(over="ignore", invalid="ignore"):
        bent = r * (1.0 + k1 * r**2 + k2 * r**4 + k3 * r**6)
        return not bool(np.all(np.diff(bent) > 0) and bent[-1] < 2.0 * r[-1])  # NaN too


def _place(files: Files, known: KnownCell) -> RigidTransform:
    """world_from_camera; the identity where it is not known."""
    spec = next((c for c in known.cameras if c.name == files.camera), None)
    if files.camera is not None and spec is None:
        message = f"no camera {quoted(files.camera)}; {nearest(files.camera, [c.name for c in known.cameras])}"
        raise Findings([Finding("--camera", 0, message)])
    if files.pose is not None:
        return load_camera_pose(files.pose)
    if spec is None:
        return RigidTransform.identity()
    if not isinstance(spec.mount, FixedMount):
        message = f"the {spec.name} camera moves with an arm; say where it stood with --camera-pose FILE, too"
        raise Findings([Finding("--camera", 0, message)])
    return spec.mount.world_from_camera


def _commonest(results: Sequence[NoEstimate]) -> NoEstimate:
    reason = Counter(result.reason for result in results).most_common(1)[0][0]
    return next(result for result in results if result.reason == reason)


def _names(files: Files) -> dict[str, str]:
    return {"rgb": shown(files.rgb)} | ({} if files.depth is None else {"depth": shown(files.depth)})


def _told(result: Estimate | NoEstimate) -> dict[str, Any]:
    if isinstance(result, NoEstimate):
        return {"found": False, "reason": str(result.reason), "message": result.message}
    pose = {
        "position": _rounded(result.position, 5),
        "quaternion": _rounded(result.world_from_connector.rotation.as_quat(canonical=True), 6),
        "axis": _rounded(result.axis, 6),
        "covariance": [[float(f"{value:.3e}") for value in row] for row in result.covariance],
        "extent": round(result.extent, 4),
        "whole": result.whole,
        "sign_seen": result.sign_seen,
    }
    return {"found": True, "pose": pose, "points": result.points, "mask_area": result.mask_area}


def _clip(finder: Technique, look: Look) -> dict[str, Any]:
    """Where the stow clip's seat is, for a technique that reads the clip's tag."""
    if not isinstance(finder, Fiducial):
        return {}
    seat = finder.seat(look.frame, look.world_from_camera)
    if isinstance(seat, NoEstimate):
        return {"clip": {"found": False, "reason": str(seat.reason), "message": seat.message}}
    pose = {
        "position": _rounded(seat.pose.translation, 5),
        "quaternion": _rounded(seat.pose.rotation.as_quat(canonical=True), 6),
        "covariance": [[float(f"{value:.3e}") for value in row] for row in seat.covariance],
    }
    return {"clip": {"found": True, "pose": pose}}


def _rounded(values: NDArray[np.float64], digits: int) -> list[float]:
    return [float(value) + 0.0 for value in values.round(digits)]  # + 0.0: no -0.0


def _json(answer: dict[str, Any]) -> str:
    """JSON, indented, each list of numbers on one line."""
    text = json.dumps(answer, indent=2, allow_nan=False)
    return re.sub(r"\[\n[-+.,e\d\s]+\]", lambda numbers: f"[{' '.join(numbers[0][1:-1].split())}]", text)


def _draw(path: Path, look: Look, result: Estimate | NoEstimate, known: KnownCell, technique: str) -> None:
    """The result on the look's picture."""
    place = look.world_from_camera
    if technique == "fused":  # which sets the camera right first
        errors = expected_errors(known, look.frame.camera)
        place = register(look.frame, place, known.boxes, errors).world_from_camera
    found = (result, place.inv()) if isinstance(result, Estimate) else None
    size = (known.connector.radius, known.connector.length)
    image = draw_pose(look.frame.rgb, look.frame.intrinsics, found, *size, _lines(technique, result))
    ok, data = cv2.imencode(path.suffix, cv2.cvtColor(image, cv2.COLOR_RGB2BGR))
    assert ok
    path.parent.mkdir(parents=True, exist_ok=True)
    write_whole(path, data.tobytes())


def _lines(technique: str, result: Estimate | NoEstimate) -> list[str]:
    """The result in words, for the picture."""
    if isinstance(result, NoEstimate):
        return [f"{technique}: not found, {result.reason}", result.message]
    spread = float(np.sqrt(np.linalg.eigvalsh(result.covariance[:3, :3])[-1]))
    across = np.linalg.svd(result.axis[None])[2][1:]
    turn = float(np.sqrt(np.linalg.eigvalsh(across @ result.covariance[3:, 3:] @ across.T)[-1]))
    part = "whole" if result.whole else f"{1e3 * result.extent:.0f} mm of it seen"
    return [
        f"{technique}: found, {part}; {'the arrow points to the tip' if result.sign_seen else TIP_NOT_TOLD}",
        f"position {_words(result.position, 4)} m, +-{1e3 * spread:.1f} mm",
        f"axis {_words(result.axis, 3)}, +-{np.rad2deg(turn):.1f} deg",
    ]


def _words(values: NDArray[np.float64], digits: int) -> str:
    return " ".join(f"{value:.{digits}f}" for value in values)
