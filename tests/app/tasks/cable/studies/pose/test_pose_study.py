import csv
import json
from pathlib import Path

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform
from typer.testing import CliRunner

from regrasp.app.cli.commands import app
from regrasp.app.tasks.cable.studies.pose.coverage import run_coverage
from regrasp.app.tasks.cable.studies.pose.negatives import Negative, NegativeParameters, negative_frames
from regrasp.app.tasks.cable.studies.pose.plots import write_plots
from regrasp.app.tasks.cable.studies.pose.scenes import study_cell
from regrasp.app.tasks.cable.studies.pose.study import THESIS, run_pose, technique_figures
from regrasp.app.tasks.cable.studies.pose.trial import Setup, Trial
from regrasp.interfaces.cable.cell import CableKnown
from regrasp.interfaces.cell import FixedMount
from regrasp.interfaces.frame import RgbdFrame
from regrasp.perception.camera.model import project
from regrasp.perception.pose.estimate import Estimate, NoEstimate
from regrasp.perception.pose.segmentation import NotSeen
from regrasp.perception.pose.technique import Technique, make_technique

SMALL = [f"known.cameras.{i}.{key}={size}" for i in (0, 1) for key, size in (("width", 212), ("height", 120))]
Vector = NDArray[np.float64]


class Blind:
    """Finds nothing."""

    def estimate(
        self,
        frame: RgbdFrame,
        world_from_camera: RigidTransform,
        *,
        axis: Vector | None = None,
        near: Vector | None = None,
    ) -> Estimate | NoEstimate:
        return NoEstimate(frame.stamp, frame.camera, NotSeen.NO_COLOR, "blind")


def maker(name: str, known: CableKnown) -> Technique:
    return Blind() if name == "blind" else make_technique("rgbd", known)


@pytest.mark.slow
def test_a_study_of_one_scene(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    setup = Setup(study_cell(overrides=SMALL), ["rgbd", "blind"], maker=maker)
    code = run_pose([setup], range(1, 2), 1, tmp_path, configurations=["2"], both=True)
    assert code == 0
    found = json.loads((tmp_path / "pose.json").read_text())
    rgbd, blind = found["techniques"]["rgbd"], found["techniques"]["blind"]
    assert (rgbd["identified"], blind["identified"]) == ([1, 1], [0, 1])
    assert list(rgbd["by_configuration"]) == ["2"]
    assert (rgbd["grasped"][1], blind["grasped"]) == (1, [0, 1])
    assert 0.0 < rgbd["mean_error_m"] < 0.04
    assert rgbd["std_m"] is None  # of one
    assert blind["mean_error_m"] is None
    assert rgbd["median_axis_error_deg"] < 30
    assert rgbd["false_identifications"][0] > 0  # colour is all that it knows
    assert blind["false_identifications"] == [0, NegativeParameters.frames]
    assert found["thesis"]["rgbd"]["grasped"] == [20, 27]

    rows = list(csv.DictReader((tmp_path / "pose.csv").open()))
    techniques = ["rgbd", "blind", "rgbd, both cameras", "blind, both cameras"]
    assert [(r["technique"], r["configuration"], r["seed"]) for r in rows] == [(name, "2", "1") for name in techniques]
    assert found["techniques"]["rgbd, both cameras"]["grasped"][1] == 1
    assert rows[1]["why"] == "blind"
    assert float(rows[0]["error_m"]) == rgbd["mean_error_m"]
    for name in ("errors.png", "shares.png"):
        assert np.std(np.asarray(cv2.imread(str(tmp_path / name)))) > 5  # something is drawn

    out, err = capfd.readouterr()
    assert "74.1 %" in out
    assert "[3/3]" in err


def test_figures_of_a_technique() -> None:
    trials = [
        Trial("a", "1", 0, True, error_m=0.002, axis_error_deg=1.0, way_round=True, grasped=True, unintended_force=7.0),
        Trial("a", "9", 0, True, error_m=0.004, axis_error_deg=3.0, way_round=False, grasped=False),
        Trial("a", "9 shadow", 0, False, grasped=False),
        Trial("b", "1", 0, False),
    ]
    found = technique_figures("a", [*trials, Negative("a", 0, 10, 3), Negative("b", 0, 10, 0)])
    assert (found["identified"], found["grasped"], found["way_round"]) == ([2, 2], [1, 2], [1, 2])
    assert (found["mean_error_m"], found["median_axis_error_deg"]) == pytest.approx((0.003, 2.0))
    assert found["std_m"] == pytest.approx(0.001 * 2**0.5)
    assert (found["unintended_contacts"], found["false_identifications"]) == ([1, 1], [3, 10])
    assert found["by_configuration"]["9 shadow"]["identified"] == [0, 1]  # the other side's are apart
    assert technique_figures("b", trials)["grasped"] == [0, 0]


def test_negatives_show_no_connector_but_much_of_its_colour() -> None:
    cell = study_cell()
    frames = list(negative_frames(cell, 3))
    again = list(negative_frames(cell, 3))
    assert len(frames) == NegativeParameters.frames
    for a, b in zip(frames, again, strict=True):
        np.testing.assert_array_equal(a.rgb, b.rgb)
        np.testing.assert_array_equal(a.depth, b.depth)
    assert len({f.number for f in frames}) == NegativeParameters.frames
    reddish = [int(np.count_nonzero((f.rgb[..., 0] > 80) & (f.rgb[..., 1] < 40))) for f in frames]
    assert sum(count > 200 for count in reddish) >= 5
    rear = cell.known.camera("rear").mount
    assert isinstance(rear, FixedMount)
    plug = cell.known.cable.socket("back_4").world_from_plug(cell.known.cable.connector.length).translation
    u, v = project(rear.world_from_camera.inv().apply(plug)[None], frames[0].intrinsics)[0].round().astype(int)
    assert np.median([f.rgb[v, u, 0] for f in frames]) < 60  # black where it would be red, were it there


@pytest.mark.parametrize(
    ("seed", "number"),
    [
        (545, 7),  # a sticker that a cable crosses fitted one that leans through the panel, its middle behind it
        (563, 4),  # a ball between the left arm's parts shows an edge that may be an end, and no side
    ],
)
def test_a_part_of_something_else_is_not_taken_for_it(seed: int, number: int) -> None:
    cell = study_cell()
    rear = cell.known.camera("rear").mount
    assert isinstance(rear, FixedMount)
    frame = list(negative_frames(cell, seed))[number]
    assert isinstance(make_technique("fused", cell.known).estimate(frame, rear.world_from_camera), NoEstimate)


def test_coverage_of_two_seeds(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    setup = Setup(study_cell(overrides=SMALL), ["rgbd", "blind"], maker=maker)
    assert run_coverage([setup], range(1, 3), 1, tmp_path) == 0
    found = json.loads((tmp_path / "coverage.json").read_text())["techniques"]
    assert found["rgbd"]["estimates"] == [20, 20]
    assert found["rgbd"]["position"][1] == found["rgbd"]["axis"][1] == 20
    assert list(found["rgbd"]["by_configuration"]) == ["2", "3"]
    assert found["blind"]["estimates"] == [0, 20]
    assert "0/20" in capfd.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["pose", "--techniques", "rgdb"], "--techniques: no 'rgdb'; did you mean 'rgbd'?"),
        (["pose", "--configurations", "3,x"], "--configurations: no 'x'; there are 1, 2, 3, 4"),
        (["pose", "--cell", "thesys"], "no cell named 'thesys'; did you mean 'thesis'?"),
        (["pose", "--techniques", "fiducial", "--cell", "thesis"], "--cell: fiducial cannot work in it: "),
        (["pose", "--seeds", "3:3"], "'3:3' is no range of seeds"),
        (["coverage", "--techniques", ""], "--techniques: no ''"),
    ],
)
def test_bad_input_is_one_line(arguments: list[str], told: str) -> None:
    result = CliRunner().invoke(app, ["study", *arguments])
    assert result.exit_code == 2
    assert told in result.stderr
    assert len(result.stderr.splitlines()) == 1


@pytest.mark.slow
def test_a_folder_with_other_things_is_refused_and_left_alone(tmp_path: Path) -> None:
    (tmp_path / "pose.json").write_text("{}")
    result = CliRunner().invoke(app, ["study", "pose", "--out", str(tmp_path)])
    assert (result.exit_code, "holds other things (pose.json)" in result.stderr) == (2, True)
    assert [(path.name, path.read_text()) for path in tmp_path.iterdir()] == [("pose.json", "{}")]


@pytest.mark.filterwarnings("error")
def test_plots_of_any_techniques_say_what_the_marks_are(tmp_path: Path) -> None:
    for names in (["fused"], ["fused", "rgbd"]):
        trials = [Trial(name, "1", 0, True, error_m=0.002, grasped=True) for name in names]
        write_plots(tmp_path, trials, names, THESIS)
        assert np.std(np.asarray(cv2.imread(str(tmp_path / "shares.png")))) > 5
