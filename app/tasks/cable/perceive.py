"""`regrasp perceive`: from a user's own frames to the connector's pose, or why there is none, as JSON."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import typer
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform

from regrasp.app.files.findings import Finding, Findings, real_path, shown
from regrasp.app.files.json_text import json_text
from regrasp.app.files.resources import resolve
from regrasp.app.frames.camera_pose_file import load_camera_pose
from regrasp.app.frames.frame_files import read_frame
from regrasp.app.frames.image_files import write_picture
from regrasp.app.task.technique import FrameFiles, PerceiveRequest
from regrasp.app.tasks.cable.cells import cable_cell
from regrasp.interfaces.cable.cell import CableKnown
from regrasp.interfaces.cell import FixedMount
from regrasp.interfaces.frame import RgbdFrame
from regrasp.interfaces.quote import nearest, quoted
from regrasp.perception.pose.estimate import Estimate, NoEstimate
from regrasp.perception.pose.fusion import fuse
from regrasp.perception.pose.technique import TECHNIQUES, Technique, TechniqueName, make_technique

NEEDS_NO_DEPTH = ("fiducial",)
TIP_NOT_TOLD = "the picture does not tell which end is the tip"


@dataclass(frozen=True, eq=False)
class FrameResult:
    """A frame, its camera's pose, and the technique's result."""

    files: FrameFiles
    frame: RgbdFrame
    world_from_camera: RigidTransform
    result: Estimate | NoEstimate


def perceive_connector(request: PerceiveRequest) -> bool:
    """Print the result as JSON, and draw it on the first frame; whether the connector is found.

    Poses are in the cell's world where the poses of all cameras are known, else in the frame of the one camera.

    Raises:
        Findings: a file or an option is wrong.
    """
    name, files, known = _technique(request.technique), request.frames, _known(request)
    frames = _frames(name, files, known, 0.001 if request.depth_unit is None else request.depth_unit)
    in_world = _in_world(files)
    cell = known if in_world else without_boxes(known)
    try:
        estimator = make_technique(name, cell)
    except ValueError as error:
        raise Findings([Finding("--cell", 0, str(error))]) from None
    results = [
        FrameResult(f, frame, pose, estimator.estimate(frame, pose))
        for f, (frame, pose) in zip(files, frames, strict=True)
    ]
    estimates = [each.result for each in results if isinstance(each.result, Estimate)]
    failures = [each.result for each in results if isinstance(each.result, NoEstimate)]
    result = fuse(estimates) if estimates else _most_common(failures)
    answer = {
        "technique": name,
        "frame": "world" if in_world else "camera",
        **_result_fields(result),
        "frames": [
            {
                **_file_names(each.files),
                "camera": each.frame.camera,
                **_result_fields(each.result),
                **(_clip_fields(estimator, each) if name == "fiducial" else {}),
            }
            for each in results
        ],
    }
    if request.draw is not None:
        _draw(request.draw, results[0], result, cell, name)
    typer.echo(json_text(answer))
    return bool(estimates)


def without_boxes(known: CableKnown) -> CableKnown:
    """The cell for a camera whose place is not known: floor and panels cannot tell where it stands."""
    return known.model_copy(update={"boxes": ()})


def _technique(name: str) -> TechniqueName:
    return next(known for known in TECHNIQUES if name == known)


def _known(request: PerceiveRequest) -> CableKnown:
    """What is known of the cell, with the connector as the user says it is."""
    known = cable_cell(resolve("cell", request.cell or "thesis", Path()), laid_out=False).known
    given = {"color": request.color, "length": request.length, "radius": request.radius}
    told = {key: value for key, value in given.items() if value is not None}
    connector = known.cable.connector.model_copy(update=told)
    if 2 * connector.radius >= connector.length:
        message = (
            f"a connector {connector.length:g} m long and {2 * connector.radius:g} thick; one is longer than thick"
        )
        raise Findings([Finding("--radius", 0, message)])
    return known.with_cable(connector=connector)


def _intrinsics(files: FrameFiles) -> Path:
    if files.intrinsics is None:
        message = "a pose needs the camera's intrinsics; give --intrinsics FILE, which `regrasp calibrate` writes"
        raise Findings([Finding("--intrinsics", 0, message)])
    return files.intrinsics


def _in_world(files: Sequence[FrameFiles]) -> bool:
    """Whether all cameras' poses are known. Raises `Findings` where only some of several cameras' are."""
    placed = [f.camera is not None or f.pose is not None for f in files]
    if not all(placed) and (any(placed) or len({real_path(_intrinsics(f)) for f in files}) > 1):
        message = "frames of several cameras meet in the world; give --camera or --camera-pose for each, too"
        raise Findings([Finding("--intrinsics", 0, message)])
    return all(placed)


def _frames(
    technique: TechniqueName, files: Sequence[FrameFiles], known: CableKnown, unit: float
) -> list[tuple[RgbdFrame, RigidTransform]]:
    """Frames and their world_from_camera. Raises `Findings` with everything that is wrong in any file."""
    frames, wrong = [], []
    number_of = {path: i for i, path in enumerate(dict.fromkeys(_intrinsics(f) for f in files), 1)}
    for number, f in enumerate(files, 1):
        try:
            if f.depth is None and technique not in NEEDS_NO_DEPTH:
                message = f"the technique {technique} needs depth; give --depth FILE for each --rgb"
                raise Findings([Finding("--depth", 0, message)])
            camera = f.camera or ("camera" if len(number_of) == 1 else f"camera {number_of[_intrinsics(f)]}")
            frame = read_frame(f.rgb, f.depth, _intrinsics(f), unit=unit, camera=camera, number=number)
            frames.append((frame, _camera_pose(f, known)))
        except Findings as error:
            wrong += error.items
    if wrong:
        raise Findings(wrong)
    return frames


def _camera_pose(files: FrameFiles, known: CableKnown) -> RigidTransform:
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


def _most_common(results: Sequence[NoEstimate]) -> NoEstimate:
    reason = Counter(result.reason for result in results).most_common(1)[0][0]
    return next(result for result in results if result.reason == reason)


def _file_names(files: FrameFiles) -> dict[str, str]:
    return {"rgb": shown(files.rgb)} | ({} if files.depth is None else {"depth": shown(files.depth)})


def _result_fields(result: Estimate | NoEstimate) -> dict[str, Any]:
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


def _clip_fields(technique: Technique, frame_result: FrameResult) -> dict[str, Any]:
    """The pose of the stow clip's seat by the clip's tag, which only the technique `fiducial` reads."""
    from regrasp.perception.pose.fiducial import Fiducial  # late: it brings the compiler

    assert isinstance(technique, Fiducial)
    seat = technique.seat(frame_result.frame, frame_result.world_from_camera)
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


def _draw(
    path: Path, frame_result: FrameResult, result: Estimate | NoEstimate, known: CableKnown, technique: str
) -> None:
    """The result on the frame's picture."""
    from regrasp.app.tasks.cable.draw import draw_pose  # late: few ask for a picture, and the compiler comes with it
    from regrasp.perception.camera.registration import expected_errors, register

    camera_pose = frame_result.world_from_camera
    if technique == "fused":  # it corrects the camera's pose first
        errors = expected_errors(known, frame_result.frame.camera)
        camera_pose = register(frame_result.frame, camera_pose, known.boxes, errors).world_from_camera
    found = (result, camera_pose.inv()) if isinstance(result, Estimate) else None
    size = (known.cable.connector.radius, known.cable.connector.length)
    image = draw_pose(frame_result.frame.rgb, frame_result.frame.intrinsics, found, *size, _caption(technique, result))
    write_picture(path, image)


def _caption(technique: str, result: Estimate | NoEstimate) -> list[str]:
    """The result as lines of text, for the picture."""
    if isinstance(result, NoEstimate):
        return [f"{technique}: not found, {result.reason}", result.message]
    deviation = float(np.sqrt(np.linalg.eigvalsh(result.covariance[:3, :3])[-1]))
    across = np.linalg.svd(result.axis[None])[2][1:]
    axis_deviation = float(np.sqrt(np.linalg.eigvalsh(across @ result.covariance[3:, 3:] @ across.T)[-1]))
    visible = "whole" if result.whole else f"{1e3 * result.extent:.0f} mm of it seen"
    return [
        f"{technique}: found, {visible}; {'the arrow points to the tip' if result.sign_seen else TIP_NOT_TOLD}",
        f"position {_numbers(result.position, 4)} m, +-{1e3 * deviation:.1f} mm",
        f"axis {_numbers(result.axis, 3)}, +-{np.rad2deg(axis_deviation):.1f} deg",
    ]


def _numbers(values: NDArray[np.float64], digits: int) -> str:
    return " ".join(f"{value:.{digits}f}" for value in values)
