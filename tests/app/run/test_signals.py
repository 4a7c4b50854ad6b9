"""Signals and pictures in a record: they are right, and asking for them changes no log."""

import json
from pathlib import Path

import cv2
import numpy as np
import pytest

import regrasp
from regrasp.app.files.findings import Findings
from regrasp.app.records.signals import FILE, read_signals

LOGS = ("events.jsonl", "ticks.jsonl")
SECONDS = 7.0  # the connector is grasped, drawn out and carried


@pytest.fixture(scope="module")
def records(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Records of the same run, with pictures and without."""
    folder = tmp_path_factory.mktemp("records")
    scenario = regrasp.load_scenario("no_obstacle", [f"limits.sim_seconds={SECONDS}"])
    for name in ("with", "without"):
        regrasp.run(scenario, seed=4, out=folder / name, pictures=name == "with")
    return folder


def test_asking_for_pictures_changes_no_log(records: Path) -> None:
    for name in (*LOGS, FILE):
        assert (records / "with" / name).read_bytes() == (records / "without" / name).read_bytes()
    assert not (records / "without/pictures").exists()


def test_pictures_show_what_the_cameras_saw_at_events(records: Path) -> None:
    pictures = sorted((records / "with/pictures").glob("*.jpg"))
    assert {path.name.split("-")[1] for path in pictures} == {"rear", "wrist"}
    assert sum(path.stat().st_size for path in pictures) < 3e6
    seconds = [float(path.name.split("-")[0]) for path in pictures]
    events = {round(event.t, 2) for event in regrasp.read_record(records / "with").events}
    at_events = [s for s, path in zip(seconds, pictures, strict=True) if "no_event" not in path.name]
    assert {*at_events} <= {round(t, 2) for t in events}
    assert max(np.diff(sorted({*seconds, 0.0, SECONDS}))) < 2.2
    for path in pictures:
        image = cv2.imread(str(path))
        assert image is not None
        assert np.std(np.asarray(image)) > 10


def test_what_was_found_in_a_picture_lies_on_it(records: Path) -> None:
    folder = records / "with/pictures"
    rows = [json.loads(line) for line in (folder / "outlines.jsonl").read_text().splitlines()]
    assert rows
    for row in rows:
        assert row["found"] == "connector, as estimated"
        image = cv2.imread(str(folder / row["picture"]))
        assert image is not None
        inside = cv2.fillPoly(
            np.zeros(image.shape[:2], np.uint8), [np.array(row["outline"]).round().astype(np.int32)], 1
        )
        blue, _, red = image[inside > 0].mean(axis=0)
        assert red > 2 * blue, "the connector is red"


def test_the_rows_are_the_ticks_and_say_what_is_so(records: Path) -> None:
    record = regrasp.read_record(records / "with")
    signals = record.signals()
    assert signals is not None
    n = len(signals["t"])
    np.testing.assert_allclose(signals["t"], 0.05 * np.arange(n), atol=1e-4)
    assert signals["t"][-1] == pytest.approx(SECONDS, abs=0.06)
    assert (records / "with" / FILE).stat().st_size < 1e6 * SECONDS / 60
    for signal in signals.described:
        assert signals[signal.name].shape == ((n,) if signal.width == 1 else (n, signal.width))
    for arm in ("left", "right"):
        tool, true = (signals[f"{arm}.{name}"].reshape(-1, 3, 4) for name in ("tool", "tool_true"))
        np.testing.assert_allclose(tool[:, :, 3], true[:, :, 3], atol=0.02)  # the arm is inexact
        np.testing.assert_allclose(
            true[:, :, :3] @ true[:, :, :3].swapaxes(1, 2), np.tile(np.eye(3), (n, 1, 1)), atol=1e-5
        )
        assert np.abs(signals[f"{arm}.joints"] - signals[f"{arm}.joints_true"]).max() < 0.05
    connector = signals["connector_true"].reshape(-1, 3, 4)
    assert np.linalg.norm(connector[-1, :, 3] - connector[0, :, 3]) > 0.02  # it was drawn out
    held = signals["connector_held_true"] > 0.5
    assert not held[0]
    assert held[-1]
    at = signals["right.tool_true"].reshape(-1, 3, 4)[held, :, 3]
    assert np.linalg.norm(connector[held, :, 3] - at, axis=1).max() < 0.05
    assert signals["right.force_true"][held].max() > 20.0  # N, both pads
    assert signals["left.force_true"].max() == 0.0
    assert signals["right.gap_true"][held][-1] == pytest.approx(0.02, abs=0.002)


def test_estimates_and_their_covariance(records: Path) -> None:
    signals = regrasp.read_record(records / "with").signals()
    assert signals is not None
    seen = ~np.isnan(signals["connector.seen_at"])
    assert not seen[0]
    assert seen.any()
    error = (signals["connector"] - signals["connector_true"]).reshape(-1, 3, 4)[seen, :, 3]
    assert np.median(np.linalg.norm(error, axis=1)) < 0.03
    diagonal = signals["connector.covariance"][seen][:, [0, 6, 11, 15, 18, 20]]
    assert (diagonal > 0).all()


def test_a_file_that_was_cut_off_is_read_as_far_as_it_goes(records: Path, tmp_path: Path) -> None:
    data = (records / "with" / FILE).read_bytes()
    (tmp_path / FILE).write_bytes(data[:-7])
    whole, cut = read_signals(records / "with" / FILE), read_signals(tmp_path / FILE)
    assert len(cut["t"]) == len(whole["t"]) - 1


@pytest.mark.parametrize(
    ("data", "told"),
    [
        (b"", "no signals of a run"),
        (b"[]\n", "no signals of a run"),
        (b'{"schema": 1, "rate": 20, "signals": []}\n', "signals without columns"),
        (b'{"schema": 1, "rate": 20, "signals": [{"name": "t"}]}\n', "no signals of a run"),
        (b'{"schema": 2, "rate": 20, "signals": [{"name": "t", "unit": "s", "width": 1, "about": ""}]}\n', "newer"),
        (b"\xff\xfe\x00" * 100, "no signals of a run"),
    ],
)
def test_other_files(tmp_path: Path, data: bytes, told: str) -> None:
    (tmp_path / FILE).write_bytes(data)
    with pytest.raises(Findings, match=told):
        read_signals(tmp_path / FILE)
