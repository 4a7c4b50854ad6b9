"""`import regrasp`: what it promises, and what it costs."""

import signal
import subprocess
import sys
import threading
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import regrasp

TREE = """\
<root main_tree_to_execute="Main"><BehaviorTree ID="Main"><SafeStop name="rest"/></BehaviorTree></root>
"""


@pytest.fixture(scope="module")
def resting(tmp_path_factory: pytest.TempPathFactory) -> regrasp.Scenario:
    """A scenario in which the arms only come to rest: half a simulated second."""
    folder = tmp_path_factory.mktemp("resting")
    (folder / "tree.xml").write_text(TREE)
    (folder / "rest.yaml").write_text(
        "description: rest\ncell: thesis\ntree: tree.xml\ngravity: zero\nexpect: {outcome: failure}\n"
    )
    return regrasp.load_scenario(folder / "rest.yaml")


def test_all_that_is_promised_is_there() -> None:
    assert dir(regrasp) == sorted(regrasp.__all__)
    assert all(getattr(regrasp, name).__doc__ for name in regrasp.__all__)


def test_what_is_not_there_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="no attribute 'fly'"):
        regrasp.fly  # noqa: B018


def test_the_import_alone_brings_nothing() -> None:
    program = "import sys, regrasp; print(sum(m.split('.')[0] in ('numpy', 'pydantic', 'scipy') for m in sys.modules))"
    assert subprocess.run([sys.executable, "-c", program], capture_output=True, text=True).stdout == "0\n"


def test_a_run_calls_back_and_leaves_a_record(resting: regrasp.Scenario, tmp_path: Path) -> None:
    ticks: list[tuple[float, str]] = []
    events: list[Any] = []
    result = regrasp.run(
        resting, seed=3, out=tmp_path / "run", on_tick=lambda *tick: ticks.append(tick), on_event=events.append
    )
    assert (result.outcome, result.succeeded, result.seed) == ("failure", True, 3)
    assert {leaf for _, leaf in ticks[:-1]} == {"rest"}
    assert [event["event"] for event in events][:: len(events) - 1] == ["begin", "end"]
    record = regrasp.read_record(tmp_path / "run")
    assert record.result is not None
    assert (record.result.outcome, len(record.events)) == ("failure", len(events))


def test_a_run_is_stopped_from_another_thread(resting: regrasp.Scenario) -> None:
    stop, began = threading.Event(), threading.Event()

    def ask() -> None:
        began.wait()
        stop.set()

    threading.Thread(target=ask, daemon=True).start()

    def wait_for_it(_seconds: float, _leaf: str) -> None:
        began.set()
        stop.wait()

    result = regrasp.run(resting, on_tick=wait_for_it, stop=stop)
    assert (result.outcome, result.succeeded) == ("interrupted", False)
    assert result.sim_seconds < 0.5


def test_ctrl_c_goes_on_to_the_caller_with_the_record_complete(resting: regrasp.Scenario, tmp_path: Path) -> None:
    with pytest.raises(regrasp.Interrupted) as raised:
        regrasp.run(resting, out=tmp_path / "run", on_tick=lambda _t, _leaf: signal.raise_signal(signal.SIGINT))
    assert raised.value.result.outcome == "interrupted"
    assert regrasp.read_record(tmp_path / "run").result == raised.value.result


@pytest.mark.parametrize("callback", ["on_tick", "on_event"])
def test_what_a_callback_raises_comes_out(resting: regrasp.Scenario, tmp_path: Path, callback: str) -> None:
    def broken(*_: object) -> None:
        raise ValueError("my own mistake")

    with pytest.raises(ValueError, match="my own mistake"):
        regrasp.run(resting, out=tmp_path / "run", **{callback: broken})  # type: ignore[arg-type]
    record = regrasp.read_record(tmp_path / "run")
    assert record.result is not None
    assert record.result.outcome == "interrupted"  # no leaf is blamed


def test_a_film_wants_a_folder(resting: regrasp.Scenario) -> None:
    with pytest.raises(ValueError, match="name a folder with out"):
        regrasp.run(resting, video=True)


@pytest.mark.parametrize(
    ("wrong", "sentence"),
    [
        ({"seed": -1}, "seed is -1; expected a whole number from 0"),
        ({"seed": True}, "seed is True; expected a whole number"),
        ({"seed": "x"}, "seed is 'x'; expected a whole number"),
        ({"renderer": "vulkan"}, "renderer is 'vulkan'; expected software or moderngl"),
        ({"on_tick": 3}, "on_tick is 3; expected a function"),
        ({"stop": True}, "stop is True; expected a threading.Event"),
    ],
)
def test_a_wrong_argument_is_told_before_anything_is_made(
    resting: regrasp.Scenario, tmp_path: Path, wrong: dict[str, Any], sentence: str
) -> None:
    with pytest.raises((TypeError, ValueError), match=sentence):
        regrasp.run(resting, out=tmp_path / "run", **wrong)
    assert not (tmp_path / "run").exists()


def test_a_folder_that_cannot_take_a_record_is_told(resting: regrasp.Scenario, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("mine")
    with pytest.raises(regrasp.Findings, match="is no folder; name another place"):
        regrasp.run(resting, out=tmp_path / "file" / "run")
    with pytest.raises(regrasp.Findings, match="file"):
        regrasp.run(resting, out=tmp_path / "file")


def test_a_window_wants_a_display(resting: regrasp.Scenario, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("regrasp.has_display", lambda: False)
    with pytest.raises(ValueError, match="gui needs a display"):
        regrasp.run(resting, gui=True)


def test_a_second_run_in_the_same_process_is_refused(resting: regrasp.Scenario) -> None:
    def another(_seconds: float, _leaf: str) -> None:
        regrasp.run(resting)

    with pytest.raises(RuntimeError, match="start another process"):
        regrasp.run(resting, on_tick=another)
    assert regrasp.run(resting).succeeded


def test_wrong_types_are_told() -> None:
    with pytest.raises(TypeError, match=r"overrides is 'gravity=earth'; expected a list of texts"):
        regrasp.load_scenario("no_obstacle", "gravity=earth")
    with pytest.raises(TypeError, match="case is 3"):
        regrasp.load_scenario("no_obstacle", case=3)  # type: ignore[arg-type]
    with pytest.raises(TypeError, match="scenario is None"):
        regrasp.run(None)  # type: ignore[arg-type]


def test_a_pose_is_asked_for_with_right_arguments() -> None:
    camera = regrasp.Intrinsics.from_fov(64, 48, 1.2)
    frame = regrasp.RgbdFrame("mine", 0, 0.0, np.zeros((48, 64, 3), np.uint8), np.zeros((48, 64), np.float32), camera)
    assert isinstance(regrasp.estimate_pose(frame, cell="thesis"), regrasp.NoEstimate)
    with pytest.raises(ValueError, match="no technique 'nope'; there are rgbd, fiducial, detector, fused"):
        regrasp.estimate_pose(frame, technique="nope")  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="tag"):
        regrasp.estimate_pose(frame, technique="fiducial")
    with pytest.raises(TypeError, match="expected one scipy RigidTransform"):
        regrasp.estimate_pose(frame, np.eye(4))  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="less than pi"):
        regrasp.Intrinsics.from_fov(640, 480, 70.0)
    with pytest.raises(ValueError, match="must be positive"):
        regrasp.Intrinsics(640, 480, -600.0, 600.0, 320.0, 240.0)
    with pytest.raises(ValueError, match="depth is a NoneType; expected a numpy array"):
        regrasp.RgbdFrame("mine", 0, 0.0, np.zeros((48, 64, 3), np.uint8), None, camera)  # type: ignore[arg-type]


def test_wrong_values_of_a_cell_are_told() -> None:
    with pytest.raises(regrasp.Findings, match=r"known.cable.connector.length is 'long'"):
        regrasp.load_cell("thesis", ["known.cable.connector.length=long"])
    with pytest.raises(regrasp.Findings, match="did you mean"):
        regrasp.load_cell("thesiss")
