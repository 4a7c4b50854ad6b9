"""`regrasp perceive` and `regrasp snapshot`, as a user types them, on renders that went through files."""

import json
import os
from pathlib import Path
from typing import Any, NamedTuple

import cv2
import numpy as np
import pytest
import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform
from scipy.stats import chi2
from typer.testing import CliRunner

from regrasp.app.cli.commands import app
from regrasp.app.files.findings import Findings
from regrasp.app.frames.camera_pose_file import write_camera_pose
from regrasp.app.frames.image_files import read_depth
from regrasp.app.frames.snapshot import write_frame
from regrasp.app.run.compose import build_world
from regrasp.app.scenario.load import load_scenario
from regrasp.app.tasks.cable.cells import cable_cell
from regrasp.perception.pose.technique import TECHNIQUES
from regrasp.sim.cable.ground_truth import CableTruth

K = yaml.safe_dump({"width": 64, "height": 48, "fx": 60.0, "fy": 60.0, "cx": 31.5, "cy": 23.5})


class Shots(NamedTuple):
    """A folder with two frames of the rear camera, and the truth of them."""

    folder: Path
    world_from_connector: RigidTransform


@pytest.fixture(scope="module")
def shots(tmp_path_factory: pytest.TempPathFactory) -> Shots:
    scenario = load_scenario("no_obstacle", ["cell=thesis_tags", "seed=3"])
    folder, world = tmp_path_factory.mktemp("shots"), build_world(scenario, 3)
    for i in range(2):
        world.advance(0.1)
        frame = world.cameras["rear"].latest()
        assert frame is not None
        write_frame(folder, frame, f"_{i}")
        np.save(folder / f"depth_{i}.npy", np.where(frame.depth > 0, frame.depth, np.nan))
    write_camera_pose(folder / "pose.yaml", scenario.cell.known.camera("rear").mount.world_from_camera)  # type: ignore[union-attr]
    truth = CableTruth(world).connector_pose()
    world.close()
    return Shots(folder, truth)


def invoke(*args: object) -> Any:
    return CliRunner().invoke(app, ["perceive", *map(str, args)])


def frame_of(shots: Shots, *numbers: int, depth: str = "png") -> list[object]:
    given: list[object] = ["--intrinsics", shots.folder / "intrinsics.yaml"]
    for i in numbers:
        given += ["--rgb", shots.folder / f"rgb_{i}.png"]
        given += ["--depth", shots.folder / f"depth_{i}.{depth}"] if depth else []
    return given


def answer(*args: object) -> dict[str, Any]:
    result = invoke(*args)
    assert result.exit_code == 0, result.output
    return dict(json.loads(result.stdout))


def finding(*args: object) -> str:
    result = invoke(*args)
    assert result.exit_code == 2, result.output
    assert result.stdout == ""
    assert "Traceback" not in result.output
    return str(result.output).strip()


@pytest.mark.parametrize("technique", TECHNIQUES)
def test_every_technique_finds_it_in_the_world(technique: str, shots: Shots) -> None:
    told = answer(*frame_of(shots, 0, 1), "--technique", technique, "--cell", "thesis_tags", "--camera", "rear")
    assert (told["technique"], told["frame"], told["found"]) == (technique, "world", True)
    assert [frame["found"] for frame in told["frames"]] == [True, True]
    pose, covariance = told["pose"], np.array(told["pose"]["covariance"])
    away = shots.world_from_connector.translation - pose["position"]
    assert away @ np.linalg.solve(covariance[:3, :3], away) < chi2.ppf(0.999, 3)
    true = shots.world_from_connector.rotation.apply([1.0, 0.0, 0.0])
    assert abs(true @ pose["axis"]) > 0.9
    assert np.linalg.norm(pose["quaternion"]) == pytest.approx(1.0, abs=1e-5)
    assert covariance.shape == (6, 6)
    assert np.linalg.norm(away) < {"fused": 0.006, "fiducial": 0.02}.get(technique, 0.05)


def test_without_a_place_of_the_camera_the_pose_is_in_its_frame(shots: Shots) -> None:
    here = answer(*frame_of(shots, 0))
    there = answer(*frame_of(shots, 0), "--camera-pose", shots.folder / "pose.yaml")
    assert (here["frame"], there["frame"]) == ("camera", "world")
    named = answer(*frame_of(shots, 0), "--camera", "rear")
    assert there["pose"]["position"] == pytest.approx(named["pose"]["position"], abs=1e-3)
    assert here["pose"]["position"][2] == pytest.approx(0.84, abs=0.04)
    assert np.sqrt(here["pose"]["covariance"][2][2]) > 0.008  # nothing tells the scale of the depth
    tag = ["--technique", "fiducial", "--cell", "thesis_tags"]
    here, there = (answer(*frame_of(shots, 0), *tag, *place) for place in ([], ["--camera", "rear"]))
    spreads = [np.trace(np.array(pose["pose"]["covariance"])[:3, :3]) for pose in (here, there)]
    assert spreads[0] < spreads[1] - 2 * 0.002**2  # where the camera stands in the world is known to millimetres


def test_files_of_other_kinds_say_the_same(shots: Shots, tmp_path: Path) -> None:
    png = answer(*frame_of(shots, 0), "--camera", "rear")
    npy = answer(*frame_of(shots, 0, depth="npy"), "--camera", "rear")
    assert npy["pose"]["position"] == pytest.approx(png["pose"]["position"], abs=1e-4)
    k = yaml.safe_load((shots.folder / "intrinsics.yaml").read_text())
    (tmp_path / "k.json").write_text(json.dumps({key: k[key] for key in ("width", "height", "fx", "fy", "cx", "cy")}))
    tenths = cv2.imread(str(shots.folder / "depth_0.png"), cv2.IMREAD_UNCHANGED)
    assert tenths is not None
    cv2.imwrite(str(tmp_path / "d.png"), (10 * tenths.astype(np.uint32)).clip(0, 65535).astype(np.uint16))
    rgb = cv2.imread(str(shots.folder / "rgb_0.png"))
    assert rgb is not None
    cv2.imwrite(str(tmp_path / "c.jpg"), rgb, [cv2.IMWRITE_JPEG_QUALITY, 98])
    files = ["--rgb", tmp_path / "c.jpg", "--depth", tmp_path / "d.png", "--intrinsics", tmp_path / "k.json"]
    other = answer(*files, "--depth-unit", "0.0001", "--camera", "rear")
    assert other["pose"]["position"] == pytest.approx(png["pose"]["position"], abs=0.004)


def test_depth_of_wider_whole_numbers_counts_the_same(shots: Shots, tmp_path: Path) -> None:
    png = answer(*frame_of(shots, 0))
    millimetres = cv2.imread(str(shots.folder / "depth_0.png"), cv2.IMREAD_UNCHANGED)
    assert millimetres is not None
    for kind in (">u2", "i2", "i4"):
        np.save(tmp_path / "d.npy", millimetres.astype(kind))
        files = ["--rgb", shots.folder / "rgb_0.png", "--intrinsics", shots.folder / "intrinsics.yaml"]
        assert answer(*files, "--depth", tmp_path / "d.npy")["pose"] == png["pose"]


def test_a_picture_lies_as_the_imager_gave_it(shots: Shots, tmp_path: Path) -> None:
    rgb = cv2.imread(str(shots.folder / "rgb_0.png"))
    assert rgb is not None
    jpeg = cv2.imencode(".jpg", rgb, [cv2.IMWRITE_JPEG_QUALITY, 98])[1].tobytes()
    upside_down = b"\xff\xe1\x00\x22Exif\0\0II*\0\x08\0\0\0\x01\0\x12\x01\x03\0\x01\0\0\0\x03\0\0\0\0\0\0\0"
    (tmp_path / "plain.jpg").write_bytes(jpeg)
    (tmp_path / "noted.jpg").write_bytes(jpeg[:2] + upside_down + jpeg[2:])
    turned = cv2.imread(str(tmp_path / "noted.jpg"))
    assert turned is not None
    assert np.abs(turned[::-1, ::-1].astype(int) - rgb).mean() < 3  # others obey the note
    rest = ["--depth", shots.folder / "depth_0.png", "--intrinsics", shots.folder / "intrinsics.yaml"]
    plain, noted = (answer("--rgb", tmp_path / f"{name}.jpg", *rest) for name in ("plain", "noted"))
    assert noted["pose"] == plain["pose"]


def test_a_bent_picture_is_made_straight(shots: Shots, tmp_path: Path) -> None:
    k = yaml.safe_load((shots.folder / "intrinsics.yaml").read_text())
    (tmp_path / "k.yaml").write_text(yaml.safe_dump(k | {"distortion": [0.1, 0.0, 0.0, 0.0, 0.0]}))
    straight = answer(*frame_of(shots, 0))["pose"]["position"]
    files = ["--rgb", shots.folder / "rgb_0.png", "--depth", shots.folder / "depth_0.png"]
    bent = answer(*files, "--intrinsics", tmp_path / "k.yaml")["pose"]["position"]
    inward = 1.0 - 0.1 * (straight[0] ** 2 + straight[1] ** 2) / straight[2] ** 2
    assert bent[:2] == pytest.approx([inward * straight[0], inward * straight[1]], abs=0.003)


def test_a_tag_needs_no_depth_and_the_others_do(shots: Shots) -> None:
    files = frame_of(shots, 0, depth="")
    assert answer(*files, "--technique", "fiducial", "--cell", "thesis_tags")["pose"]["sign_seen"]
    assert finding(*files).startswith("--depth: the technique fused needs depth; give --depth FILE")
    assert finding(*files, "--technique", "fiducial").startswith("--cell: the cell's connector has no tag")


def test_the_clips_tag_tells_where_its_seat_is(shots: Shots) -> None:
    tag = ["--technique", "fiducial", "--cell", "thesis_tags", "--camera", "rear"]
    [frame] = answer(*frame_of(shots, 0), *tag)["frames"]
    clip = frame["clip"]
    assert clip["found"], clip
    seat = cable_cell("thesis_tags").known.cable.clip.world_from_seat.translation
    assert clip["pose"]["position"] == pytest.approx(seat.tolist(), abs=0.02)
    assert np.shape(clip["pose"]["covariance"]) == (6, 6)
    assert "clip" not in answer(*frame_of(shots, 0))["frames"][0]


def test_what_is_not_there_is_not_found_and_why_is_told(shots: Shots, tmp_path: Path) -> None:
    result = invoke(*frame_of(shots, 0), "--color", "0,200,40", "--draw", tmp_path / "seen.png")
    assert result.exit_code == 1
    told = json.loads(result.stdout)
    assert told["found"] is False
    assert told["reason"] == "no_color"
    assert "colour" in told["message"]
    assert (tmp_path / "seen.png").exists()
    assert invoke(*frame_of(shots, 0), "--color", "0,200,40", "--draw", tmp_path / "new" / "seen.png").exit_code == 1
    assert (tmp_path / "new" / "seen.png").exists()
    assert json.loads(invoke(*frame_of(shots, 0), "--radius", "0.03").stdout)["reason"] == "not_its_shape"


def test_the_drawing_shows_it_where_it_is(shots: Shots, tmp_path: Path) -> None:
    before = cv2.imread(str(shots.folder / "rgb_0.png"))
    for place in ([], ["--camera", "rear"]):
        answer(*frame_of(shots, 0), *place, "--draw", tmp_path / "seen.png")
        drawn = cv2.imread(str(tmp_path / "seen.png"))
        assert before is not None
        assert drawn is not None
        rows, columns = np.nonzero((drawn[:480] != before).any(axis=2))
        hsv = cv2.cvtColor(before, cv2.COLOR_BGR2HSV)
        red = ((hsv[..., 0] < 8) | (hsv[..., 0] > 172)) & (hsv[..., 1] > 120)
        v, u = np.nonzero(red)
        for drawn_at, red_at in ((rows, v), (columns, u)):
            assert drawn_at.min() - 4 < red_at.min()
            assert red_at.max() < drawn_at.max() + 4
            assert np.ptp(drawn_at) < 80
        assert drawn.shape[0] > 500  # the words stand below


def test_a_drawing_overwrites_nothing_of_the_users(shots: Shots, tmp_path: Path) -> None:
    kept = (shots.folder / "rgb_0.png").read_bytes()
    assert "would overwrite" in finding(*frame_of(shots, 0), "--draw", shots.folder / "rgb_0.png")
    (tmp_path / "link.png").symlink_to(shots.folder / "rgb_0.png")
    assert "would overwrite" in finding(*frame_of(shots, 0), "--draw", tmp_path / "link.png")
    assert (shots.folder / "rgb_0.png").read_bytes() == kept
    assert "end it in .png" in finding(*frame_of(shots, 0), "--draw", tmp_path / "seen.txt")
    assert "is a folder" in finding(*frame_of(shots, 0), "--draw", _made(tmp_path / "folder.png"))


def _made(folder: Path) -> Path:
    folder.mkdir()
    return folder


def test_two_cameras_meet_in_the_world_only(shots: Shots, tmp_path: Path) -> None:
    (tmp_path / "other.yaml").write_text((shots.folder / "intrinsics.yaml").read_text())
    both = [*frame_of(shots, 0, 1), "--intrinsics", tmp_path / "other.yaml"]
    assert "--intrinsics: frames of several cameras meet in the world" in finding(*both)
    told = answer(*both, "--camera-pose", shots.folder / "pose.yaml")
    assert [frame["camera"] for frame in told["frames"]] == ["camera 1", "camera 2"]
    assert "moves with an arm" in finding(*frame_of(shots, 0), "--camera", "wrist")
    assert answer(*frame_of(shots, 0), "--camera", "wrist", "--camera-pose", shots.folder / "pose.yaml")["found"]


def test_bad_options_are_findings(shots: Shots) -> None:
    files = frame_of(shots, 0)
    assert "--technique: no technique 'fusd'; did you mean 'fused'?" in finding(*files, "--technique", "fusd")
    assert "--camera: no camera 'read'; did you mean 'rear'?" in finding(*files, "--camera", "read")
    assert "is no colour; write three numbers" in finding(*files, "--color", "red")
    assert "is grey" in finding(*files, "--color", "90,90,90")
    assert "no cell named 'thesi'" in finding(*files, "--cell", "thesi")
    assert "0.09 m long and 0.1 thick" in finding(*files, "--radius", "0.05")
    depths = ["--depth", shots.folder / "depth_1.png"]
    assert "--depth: given 2 times for 1 pictures; give one for each" in finding(*files, *depths)
    assert "is no colour" in finding(*files, "--color", "9" * 5000 + ",0,0")
    assert invoke(*files, "--length", "0").exit_code == 2
    assert invoke("--rgb", "a.png").exit_code == 2


@pytest.fixture
def small(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with small files that are right."""
    monkeypatch.chdir(tmp_path)
    cv2.imwrite("rgb.png", np.full((48, 64, 3), 90, np.uint8))
    cv2.imwrite("depth.png", np.full((48, 64), 800, np.uint16))
    (tmp_path / "k.yaml").write_text(K)
    return tmp_path


SMALL = ("--rgb", "rgb.png", "--depth", "depth.png", "--intrinsics", "k.yaml")


def test_bad_files_are_findings_that_say_what_would_be_right(small: Path) -> None:
    assert invoke(*SMALL).exit_code == 1
    cv2.imwrite("grey.png", np.full((48, 64), 8, np.uint8))
    told = finding("--rgb", "rgb.png", "--depth", "grey.png", "--intrinsics", "k.yaml")
    right = "whole numbers of 16 bits or more, or floats in metres"
    assert told == f"grey.png: is 48 x 64 of type uint8; depth is H x W, {right}"
    assert "is 48 x 64 x 3 of type uint8" in finding("--rgb", "rgb.png", "--depth", "rgb.png", "--intrinsics", "k.yaml")
    cv2.imwrite("wide.png", np.zeros((30, 40), np.uint16))
    told = finding("--rgb", "rgb.png", "--depth", "wide.png", "--intrinsics", "k.yaml")
    assert "wide.png: is 40x30 pixels, k.yaml is for 64x48" in told
    np.save("mm.npy", np.full((48, 64), 800.0))
    told = finding("--rgb", "rgb.png", "--depth", "mm.npy", "--intrinsics", "k.yaml")
    assert "mm.npy: its middle reading is 800 m" in told
    told = finding("--rgb", "gone.png", "--depth", "gone.npy", "--intrinsics", "k.yaml")
    assert "'gone.png' does not exist; name an image file" in told
    assert "is a folder" in finding("--rgb", ".", "--depth", "depth.png", "--intrinsics", "k.yaml")
    names = ("b.yaml", "a.yaml", "c.yaml")
    many = [word for name in names for word in (*SMALL[:4], "--intrinsics", name)]
    assert [line.split(":")[0] for line in finding(*many).splitlines()] == sorted(names)  # all at once
    (small / "k.yaml").write_text(K.replace("fx: 60.0", "fx: .nan"))
    assert finding(*SMALL).startswith("k.yaml:")
    for k1 in ("-5.0", "80.0", "1.0e+300"):
        (small / "k.yaml").write_text(K + f"distortion: [{k1}, 0, 0, 0, 0]\n")
        assert finding(*SMALL).startswith("k.yaml: distortion bends the picture beyond use; write OpenCV's")
    (small / "k.yaml").write_text(K.replace("fx: 60.0", "fx: 0.5"))
    assert "k.yaml: fx, fy are 0.5, 60 pixels; expected 13 to 1280" in finding(*SMALL)
    (small / "k.yaml").write_text(K)
    (small / "pose.yaml").write_text("position: [0, 0, 0]\nquaternion: [0, 0, 0, 0]\n")
    assert "a quaternion x, y, z, w has length 1, this one 0" in finding(*SMALL, "--camera-pose", "pose.yaml")


def test_names_of_files_come_out_as_they_are(small: Path) -> None:
    name = "bild [ 1,  2 ] \u00e4.png"
    (small / "rgb.png").rename(small / name)
    told = json.loads(invoke("--rgb", name, *SMALL[2:]).stdout)
    assert told["frames"][0]["rgb"] == name


@settings(max_examples=25, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    st.sampled_from(["rgb.png", "depth.png", "k.yaml", "depth.npy"]),
    st.binary(max_size=60),
    st.integers(0, 200),
    st.sampled_from(TECHNIQUES),
)
def test_broken_files_never_bring_a_traceback(small: Path, name: str, junk: bytes, at: int, technique: str) -> None:
    np.save(small / "depth.npy", np.full((48, 64), 0.8, np.float32))
    depth = "depth.npy" if name == "depth.npy" else "depth.png"
    whole = (small / name).read_bytes()
    (small / name).write_bytes(whole[:at] + junk + whole[at + len(junk) :])
    args = ["--rgb", "rgb.png", "--depth", depth, "--intrinsics", "k.yaml", "--technique", technique]
    result = invoke(*args, "--cell", "thesis_tags")
    (small / name).write_bytes(whole)
    assert result.exit_code in (1, 2), result.output
    assert result.exception is None or isinstance(result.exception, SystemExit)


@settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    arrays.arrays(
        arrays.scalar_dtypes() | arrays.complex_number_dtypes(),
        st.sampled_from([(48, 64), (48, 64, 1), (64, 48), (), (0,), (0, 0)]),
    ),
    st.sampled_from(["rgbd", "fused"]),
)
def test_any_array_of_depth_is_taken_or_refused(small: Path, depth: NDArray[Any], technique: str) -> None:
    np.save(small / "any.npy", depth)
    cv2.imwrite("red.png", np.full((48, 64, 3), (15, 13, 191), np.uint8))
    result = invoke("--rgb", "red.png", "--depth", "any.npy", "--intrinsics", "k.yaml", "--technique", technique)
    assert result.exception is None or isinstance(result.exception, SystemExit)
    if result.exit_code == 2:
        assert result.output.startswith("any.npy: ")
    elif technique == "fused":
        assert result.exit_code == 1


def test_snapshot_gives_what_perceive_takes(tmp_path: Path) -> None:
    made = CliRunner().invoke(app, ["snapshot", "no_obstacle", "--seed", "5", "--out", str(tmp_path / "frames")])
    assert made.exit_code == 0, made.output
    folder = tmp_path / "frames"
    names = ["camera_pose.yaml", "depth.png", "intrinsics.yaml", "rgb.png"]
    assert sorted(path.name for path in folder.iterdir()) == names
    files = ["--rgb", folder / "rgb.png", "--depth", folder / "depth.png", "--intrinsics", folder / "intrinsics.yaml"]
    assert answer(*files, "--camera-pose", folder / "camera_pose.yaml")["found"]
    kept = {path.name: path.read_bytes() for path in folder.iterdir()}
    again = CliRunner().invoke(app, ["snapshot", "no_obstacle", "--camera", "wrist", "--out", str(folder)])
    assert again.exit_code == 2
    assert "already holds rgb.png, depth.png, intrinsics.yaml, camera_pose.yaml" in again.output
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == kept
    wrong = CliRunner().invoke(app, ["snapshot", "no_obstacle", "--camera", "read", "--out", str(tmp_path)])
    assert wrong.exit_code == 2
    assert "did you mean 'rear'?" in wrong.output


def test_help_names_every_technique() -> None:
    told = invoke("--help").output
    assert all(name in told for name in TECHNIQUES)


def test_a_file_in_a_folder_that_nobody_may_look_into_is_not_there(
    small: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def locked(path: object, **_: object) -> os.stat_result:
        raise PermissionError(13, "Permission denied", path)

    with monkeypatch.context() as patch:
        patch.setattr(os, "stat", locked)
        with pytest.raises(Findings, match=r"'locked/d.npy' does not exist; name an image file"):
            read_depth(Path("locked/d.npy"), 0.001)
