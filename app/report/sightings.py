"""Where in a camera's picture lies what the robot believed to see: estimates of poses, and positions told by events."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from regrasp.app.files.findings import Findings
from regrasp.app.files.resources import read_text
from regrasp.app.records.reader import Event, RunRecord
from regrasp.app.records.signals import Signals
from regrasp.app.report.curves import CHI2_95, positions
from regrasp.app.task import find
from regrasp.interfaces.arrays import FloatArray

if TYPE_CHECKING:
    from regrasp.interfaces.cell import CameraSpec, Cell
    from regrasp.interfaces.robot.chain import Chain

NEWEST = 0.1  # s: an event this near to a picture told of what is in it
STALE = 2.0  # s: an older estimate is not drawn
MAX_RADIUS = 0.3  # of a picture's width; a larger region says no more


@dataclass(frozen=True)
class Sighting:
    """A point in a picture, as fractions of its width and height, with the 95 % region's radius of the width."""

    x: float
    y: float
    radius: float
    name: str


class Sightings:
    """What the robot knew, drawn into its cameras' pictures by the poses that it knows of them."""

    def __init__(self, record: RunRecord, signals: Signals | None) -> None:
        self._record, self._signals = record, signals
        self._events = [event for event in record.events if _position(event) is not None]

    def at(self, t: float, camera: str) -> Iterator[Sighting]:
        """The points in the picture of that camera at second `t`."""
        points = [*self._points(t)]
        if not points or self._cell is None:
            return
        spec = next((one for one in self._cell.known.cameras if one.name == camera), None)
        camera_from_world = None if spec is None else self._camera_from_world(self._cell, spec, t)
        if spec is None or camera_from_world is None:
            return
        for name, point, spread in points:
            if (seen := _projected(spec, camera_from_world, point, spread)) is not None:
                yield Sighting(*seen, name)

    def _points(self, t: float) -> Iterator[tuple[str, FloatArray, float]]:
        """Name, position (3,) in m, and radius in m of the 95 % region (0: not known)."""
        yield from self._estimates(t)
        for event in self._events:
            if abs(event.t - t) <= NEWEST:
                point = _position(event)
                assert point is not None
                yield event.event, point, 0.0

    def _estimates(self, t: float) -> Iterator[tuple[str, FloatArray, float]]:
        signals = self._signals
        row = None if signals is None else _row(signals, t)
        if signals is None or row is None:
            return
        for name in signals:
            seen_at = signals.get(f"{name}.seen_at")
            if seen_at is None or not 0.0 <= t - float(seen_at[row]) <= STALE:
                continue
            covariance = signals.get(f"{name}.covariance")
            spread = (
                0.0
                if covariance is None
                else float(np.sqrt(CHI2_95 * max(float(covariance[row][[0, 6, 11]].max()), 0)))
            )
            yield f"{name}, seen at {seen_at[row]:.2f} s", positions(signals[name][row : row + 1])[0], spread

    @cached_property
    def _cell(self) -> "Cell | None":
        """The cell of the record, of its task; None if it cannot be read.

        The record has it in full, as written by a program, so that it is read without what people's files need.
        """
        import yaml
        from pydantic import ValidationError

        record = self._record
        task = record.result.task if record.result else str(record.begin.get("task", ""))
        try:
            text = read_text(record.folder / "cell.yaml")
            if "&" in text:  # references could stand for more than any memory holds; a program writes none
                return None
            loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)  # ten times as fast, where it is there
            return find.task_named(task).cell().model_validate(yaml.load(text, Loader=loader))
        except (Findings, yaml.YAMLError, ValidationError, RecursionError):
            return None

    def _camera_from_world(self, cell: "Cell", spec: "CameraSpec", t: float) -> FloatArray | None:
        """The pose (4, 4) by which the robot places a picture that it got at second `t`; None if it is not known."""
        from regrasp.interfaces.cell import FixedMount

        if isinstance(spec.mount, FixedMount):
            return np.asarray(spec.mount.world_from_camera.inv().as_matrix())
        arm, signals = spec.mount.arm, self._signals
        exposed = t - cell.known.latencies.image
        known = signals is not None and f"{arm}.tool" in signals and f"{arm}.joints" in signals
        row = None if signals is None or not known else _row(signals, exposed)
        if signals is None or row is None:
            return None
        robot = cell.known.arm(arm).robot
        link, link_from_mount = robot.mounted
        world_from_link = _frame(signals[f"{arm}.tool"][row]) @ np.linalg.inv(robot.chain.last_from_tool)
        for joint in reversed(range(link, len(robot.chain))):
            moved = joint_motion(robot.chain, joint, float(np.atleast_1d(signals[f"{arm}.joints"][row])[joint]))
            world_from_link = world_from_link @ np.linalg.inv(moved)
        mount_from_camera = spec.mount.mount_from_camera.as_matrix()
        return np.asarray(np.linalg.inv(world_from_link @ link_from_mount @ mount_from_camera))


def joint_motion(chain: "Chain", joint: int, position: float) -> FloatArray:
    """Pose (4, 4) of the link after a joint in the one before it, at a position in rad or m.

    Not by `ArmKinematics`, whose compiled solvers take a second to import.
    """
    from scipy.spatial.transform import Rotation

    moved = np.eye(4)
    moved[:3, 3] = chain.origins[joint]
    if chain.slides[joint]:
        moved[:3, 3] += position * chain.axes[joint]
    else:
        moved[:3, :3] = Rotation.from_rotvec(position * chain.axes[joint]).as_matrix()
    return moved


def _frame(numbers: FloatArray) -> FloatArray:
    """The pose (4, 4) of a signal's twelve numbers."""
    return np.vstack([np.asarray(numbers, float).reshape(3, 4), (0.0, 0.0, 0.0, 1.0)])


def _row(signals: Signals, t: float) -> int | None:
    """The row of the last tick up to second `t`."""
    row = int(np.searchsorted(signals["t"], t + 1e-3, side="right")) - 1
    return row if row >= 0 else None


def _projected(
    spec: "CameraSpec", camera_from_world: FloatArray, point: FloatArray, spread: float
) -> tuple[float, float, float] | None:
    """Where a point lies in the picture, and how large a radius in m around it is, as fractions of its size."""
    x, y, z = camera_from_world[:3, :3] @ point + camera_from_world[:3, 3]
    if z < 0.02:
        return None
    lens = spec.intrinsics
    across, down = (lens.fx * x / z + lens.cx) / lens.width, (lens.fy * y / z + lens.cy) / lens.height
    if not (0.0 <= across <= 1.0 and 0.0 <= down <= 1.0):
        return None
    radius = lens.fx * spread / z / lens.width
    return round(float(across), 4), round(float(down), 4), round(float(min(radius, MAX_RADIUS)), 4)


def _position(event: Event) -> FloatArray | None:
    """The place in the world that an event tells; None if it tells none."""
    value = event.values.get("position")
    if not isinstance(value, list) or len(value) != 3 or not all(isinstance(one, (int, float)) for one in value):
        return None
    return np.array(value, float)
