"""Behaviour-tree autonomy that anyone can run, test and measure: the interface for Python programs.

docs/python.md shows it at work. What is not named in `__all__` may change without notice.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Mapping, Sequence
from numbers import Integral
from pathlib import Path
from threading import Lock
from typing import TYPE_CHECKING, Any, Literal, Protocol

if TYPE_CHECKING:  # at run time `__getattr__` brings these when they are asked for: `import regrasp` costs nothing
    from scipy.spatial.transform import RigidTransform

    from regrasp.app.files.findings import Finding as Finding
    from regrasp.app.files.findings import Findings as Findings
    from regrasp.app.records.reader import RunRecord as RunRecord
    from regrasp.app.records.record import OnEvent, Progress
    from regrasp.app.records.result import Result as Result
    from regrasp.app.scenario.load import Scenario as Scenario
    from regrasp.interfaces.cell import Cell as Cell
    from regrasp.interfaces.frame import Intrinsics as Intrinsics
    from regrasp.interfaces.frame import RgbdFrame as RgbdFrame
    from regrasp.perception.pose.estimate import Estimate as Estimate
    from regrasp.perception.pose.estimate import NoEstimate as NoEstimate

# NumPy and SciPy read this when they are imported. Our matrices are small: threads that share one out spin for longer
# than it takes, and runs side by side share the cores anyway.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

_TYPES = {
    "Cell": "regrasp.interfaces.cell",
    "Estimate": "regrasp.perception.pose.estimate",
    "Finding": "regrasp.app.files.findings",
    "Findings": "regrasp.app.files.findings",
    "Intrinsics": "regrasp.interfaces.frame",
    "NoEstimate": "regrasp.perception.pose.estimate",
    "Result": "regrasp.app.records.result",
    "RgbdFrame": "regrasp.interfaces.frame",
    "RunRecord": "regrasp.app.records.reader",
    "Scenario": "regrasp.app.scenario.load",
}
__all__ = [
    "Cell",
    "Estimate",
    "Finding",
    "Findings",
    "Interrupted",
    "Intrinsics",
    "NoEstimate",
    "Result",
    "RgbdFrame",
    "RunRecord",
    "Scenario",
    "estimate_pose",
    "load_cases",
    "load_cell",
    "load_frame",
    "load_scenario",
    "read_record",
    "run",
]


class Interrupted(KeyboardInterrupt):
    """Ctrl-C ended a run. The run's record is complete, and `result` says how far the run came."""

    def __init__(self, result: Result) -> None:
        super().__init__(result.outcome)
        self.result = result


class StopRequest(Protocol):
    """Asks a run to stop, as a `threading.Event` does."""

    def is_set(self) -> bool:
        """Whether the run shall stop."""


_running = Lock()  # py_trees keeps one blackboard a process


def load_scenario(scenario: str | Path, overrides: Sequence[str] = (), case: str | None = None) -> Scenario:
    """Read and check one case of a scenario, with the cell and the tree that it names.

    Args:
        scenario: the name of a shipped scenario, or the path of a .yaml file.
        overrides: assignments such as "gravity=earth" or "cell.known.cable.length=0.5", as `--set` takes them.
        case: the name of the case, such as "gravity=earth"; by default the case of the first values of `vary`.

    Raises:
        Findings: something in the files or the overrides is wrong; `items` names all of it with file and line.
        TypeError: an argument is of another type.
    """
    from regrasp.app.scenario.load import load_scenario

    if not (case is None or isinstance(case, str)):
        raise TypeError(f"case is {case!r}; expected a case's name, such as 'gravity=earth'")
    return load_scenario(_name(scenario), _texts(overrides), case)


def load_cases(scenario: str | Path, overrides: Sequence[str] = ()) -> list[Scenario]:
    """Read and check every case of a scenario; arguments and errors as in `load_scenario`."""
    from regrasp.app.scenario.load import cases

    return cases(_name(scenario), _texts(overrides))


def run(
    scenario: str | Path | Scenario,
    *,
    seed: int | None = None,
    out: str | Path | None = None,
    video: bool = False,
    pictures: bool = False,
    gui: bool = False,
    renderer: Literal["software", "moderngl"] = "software",
    on_tick: Progress | None = None,
    on_event: OnEvent | None = None,
    stop: StopRequest | None = None,
) -> Result:
    """Run a scenario to its end, in this process, which does one run at a time.

    Args:
        scenario: a loaded one, or what `load_scenario` takes.
        seed: draws every error, noise and jitter; by default the scenario's.
        out: the folder for the record, which is made; None keeps no record.
        video: film the run into the record.
        pictures: keep the cameras' frames at events in the record, as JPEG.
        gui: show PyBullet's window.
        renderer: what draws the cameras' pictures: compiled loops, or OpenGL (moderngl), for a graphics card.
        on_tick: called after each tick of the tree with the simulated second and the active leaf's name, "" for none.
        on_event: called with each event of the run, a mapping as in events.jsonl.
        stop: a `threading.Event` or the like. Once it is set, the run ends after the tick with the outcome
            "interrupted".

    Raises:
        Findings: the scenario is wrong, or the folder cannot take a record.
        Interrupted: Ctrl-C; the record is complete. While the world is still being built, a plain KeyboardInterrupt.
        RuntimeError: another run is under way in this process.
        TypeError, ValueError: another argument is wrong.
        Exception: what a callback raised, once the record is complete.
    """
    from regrasp.app.interrupts import late_imports
    from regrasp.app.records.folders import run_folder_findings

    loaded = load_scenario(scenario) if isinstance(scenario, (str, Path)) else scenario
    folder = None if out is None else Path(out)
    _check_run(loaded, seed, renderer, on_tick, on_event, stop)
    if (video or pictures) and folder is None:
        raise ValueError("video and pictures go into the record; name a folder with out")
    if folder is not None and (found := run_folder_findings(folder)):
        from regrasp.app.files.findings import Findings

        raise Findings(found)
    if gui and not has_display():
        raise ValueError("gui needs a display, and DISPLAY is not set; film with video")
    with late_imports():
        from regrasp.app.run.episode import run_episode  # brings the planner, the compiler and the physics: seconds
        from regrasp.app.run.observers import Observers

    callbacks = _Callbacks(on_tick, on_event, stop)
    if not _running.acquire(blocking=False):
        raise RuntimeError("a run is under way in this process; start another process for a second one")
    try:
        result = run_episode(
            loaded,
            folder,
            seed=loaded.file.seed if seed is None else int(seed),
            video=video,
            pictures=pictures,
            gui=gui,
            renderer=renderer,
            observers=Observers(tick=callbacks.tick, event=callbacks.event),
        )
    finally:
        _running.release()
        if callbacks.error is not None:
            raise callbacks.error
    if result.outcome in ("interrupted", "wall_limit") and not callbacks.stopped():
        raise Interrupted(result)
    return result


class _Callbacks:
    """A caller's callbacks. What one raises is kept in `error` and ends the run as Ctrl-C does: it blames no leaf."""

    def __init__(self, on_tick: Progress | None, on_event: OnEvent | None, stop: StopRequest | None) -> None:
        self._on_tick, self._on_event, self._stop = on_tick, on_event, stop
        self.error: Exception | None = None

    def stopped(self) -> bool:
        """Whether the caller has asked for the end."""
        return self._stop is not None and self._stop.is_set()

    def tick(self, seconds: float, leaf: str) -> None:
        """After each tick of the tree."""
        self._call(self._on_tick, seconds, leaf)
        if self.stopped():
            raise KeyboardInterrupt

    def event(self, event: Mapping[str, Any]) -> None:
        """With each event of the run."""
        self._call(self._on_event, event)

    def _call(self, callback: Callable[..., None] | None, *values: Any) -> None:
        if callback is None or self.error is not None:
            return
        try:
            callback(*values)
        except Exception as error:
            self.error = error
            raise KeyboardInterrupt from error


def has_display() -> bool:
    """Whether PyBullet's window can be shown here."""
    return sys.platform != "linux" or bool(os.environ.get("DISPLAY"))


def _check_run(scenario: Any, seed: Any, renderer: Any, on_tick: Any, on_event: Any, stop: Any) -> None:
    """Raises TypeError or ValueError for arguments of `run` that would fail later, or not at all."""
    from regrasp.app.scenario.load import Scenario
    from regrasp.interfaces.seed import MAX_SEED

    if not isinstance(scenario, Scenario):
        raise TypeError(f"scenario is {scenario!r}; expected a name, a path or what load_scenario returns")
    whole = isinstance(seed, Integral) and seed is not True and seed is not False
    if seed is not None and not (whole and 0 <= seed <= MAX_SEED):
        raise ValueError(f"seed is {seed!r}; expected a whole number from 0 to {MAX_SEED}")
    if renderer not in ("software", "moderngl"):
        raise ValueError(f"renderer is {renderer!r}; expected software or moderngl")
    for name, callback in {"on_tick": on_tick, "on_event": on_event}.items():
        if not (callback is None or callable(callback)):
            raise TypeError(f"{name} is {callback!r}; expected a function")
    if not (stop is None or callable(getattr(stop, "is_set", None))):
        raise TypeError(f"stop is {stop!r}; expected a threading.Event")


def _name(scenario: Any) -> str:
    if not isinstance(scenario, (str, Path)):
        raise TypeError(f"scenario is {scenario!r}; expected a name or a path")
    return str(scenario)


def _texts(overrides: Any) -> Sequence[str]:
    if isinstance(overrides, str) or not all(isinstance(text, str) for text in overrides):
        raise TypeError(f"overrides is {overrides!r}; expected a list of texts, such as ['gravity=earth']")
    return tuple(overrides)


def read_record(folder: str | Path) -> RunRecord:
    """Read and check the folder that a run left: its result, its events, and every change of a node's status.

    Raises:
        Findings: the folder holds no run, or a file in it is broken.
    """
    from regrasp.app.records.reader import read_record

    return read_record(Path(folder))


def load_cell(cell: str | Path = "thesis", overrides: Sequence[str] = ()) -> Cell:
    """Read and check a cell: a shipped one by its name, or a .yaml file by its path.

    `overrides` are assignments such as "known.cable.connector.length=0.08".

    Raises:
        Findings: something in the file or the overrides is wrong.
    """
    from regrasp.app.files.overrides import parse_overrides
    from regrasp.app.files.resources import resolve
    from regrasp.app.scenario.cell_file import load_cell

    assignments, wrong = parse_overrides(_texts(overrides))
    if wrong:
        from regrasp.app.files.findings import Findings

        raise Findings(wrong)
    return load_cell(resolve("cell", str(cell), Path()), assignments)


def load_frame(
    rgb: str | Path, depth: str | Path | None, intrinsics: str | Path, *, depth_unit: float = 0.001
) -> RgbdFrame:
    """Read a colour picture and its depth, with the lens distortion taken out.

    Args:
        rgb: a colour picture (H, W).
        depth: depth aligned to it: a 16-bit PNG that counts `depth_unit` metres, or a .npy file of metres; None for
            none, which the technique `fiducial` alone does without.
        intrinsics: the camera's calibration file, as `regrasp calibrate` writes it.
        depth_unit: metres.

    Raises:
        Findings: a file cannot be read, or they do not fit together.
        ValueError: `depth_unit` is not positive.
    """
    from regrasp.app.frames.frame_files import read_frame

    if not depth_unit > 0:
        raise ValueError(f"depth_unit is {depth_unit!r}; expected metres, more than 0")
    return read_frame(Path(rgb), None if depth is None else Path(depth), Path(intrinsics), unit=depth_unit)


def estimate_pose(
    frame: RgbdFrame,
    world_from_camera: RigidTransform | None = None,
    *,
    technique: Literal["rgbd", "fiducial", "detector", "fused"] = "fused",
    cell: Cell | str | Path = "thesis",
) -> Estimate | NoEstimate:
    """Find the connector in a frame.

    Args:
        frame: colour and aligned depth; see `load_frame`.
        world_from_camera: where the camera stands (x right, y down, z forward). Without it the pose is told in the
            camera's frame, and the cell's floor and panels are not used.
        technique: how; app/tasks/cable/studies/pose/POSE.md compares them.
        cell: says how long, how thick and of which colour the connector is; or what `load_cell` takes.

    Returns:
        A pose with its covariance, or the reason why there is none.

    Raises:
        ValueError: no such technique, or the cell lacks what it needs, such as a tag on the connector.
        TypeError: an argument is of another type.
    """
    from scipy.spatial.transform import RigidTransform

    from regrasp.app.tasks.cable.perceive import without_boxes
    from regrasp.interfaces.cable.cell import CableCell
    from regrasp.perception.pose.technique import make_technique

    loaded = load_cell(cell) if isinstance(cell, (str, Path)) else cell
    if not isinstance(loaded, CableCell):
        raise ValueError("the cell has no section known.cable, which tells of the connector; take the cell thesis")
    known = loaded.known
    if world_from_camera is not None and not (
        isinstance(world_from_camera, RigidTransform) and world_from_camera.single
    ):
        raise TypeError(f"world_from_camera is {world_from_camera!r}; expected one scipy RigidTransform")
    if world_from_camera is None:
        return make_technique(technique, without_boxes(known)).estimate(frame, RigidTransform.identity())
    return make_technique(technique, known).estimate(frame, world_from_camera)


def __getattr__(name: str) -> Any:
    if name in _TYPES:
        from importlib import import_module

        return getattr(import_module(_TYPES[name]), name)
    raise AttributeError(f"module 'regrasp' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)
