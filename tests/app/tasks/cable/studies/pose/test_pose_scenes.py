import dataclasses

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform

from regrasp.app.files.findings import Findings
from regrasp.app.tasks.cable.studies.pose.scenes import (
    CONFIGURATIONS,
    HEADLINE,
    SceneParameters,
    StudyScene,
    connector_pose,
    frames,
    study_cell,
)
from regrasp.interfaces.cable.cell import CableCell
from regrasp.interfaces.cell import FixedMount
from regrasp.perception.pose.estimate import Estimate
from regrasp.perception.pose.technique import make_technique

SMALL = [f"known.cameras.{i}.{key}={size}" for i in (0, 1) for key, size in (("width", 212), ("height", 120))]
NO_ERRORS = [
    f"hidden.errors.{name}=0"
    for name in ("camera_position", "camera_angle_deg", "depth_scale", "depth_subpixel", "depth_fixed_share")
]
FRONT = np.sqrt(3) / 2  # of the radius by which the median of the visible surface stands before the axis


@pytest.fixture(scope="module")
def small() -> CableCell:
    return study_cell(overrides=SMALL)


def rear(cell: CableCell) -> RigidTransform:
    mount = cell.known.camera("rear").mount
    assert isinstance(mount, FixedMount)
    return mount.world_from_camera


def turned(pose: RigidTransform, camera: RigidTransform) -> tuple[float, float, float]:
    """Degrees of the axis out of the image plane, above the horizon, and off the ray to the camera."""
    axis = pose.rotation.apply([1.0, 0.0, 0.0])
    ray = pose.translation - camera.translation
    level = ray * [1.0, 1.0, 0.0] / np.linalg.norm(ray[:2])
    up = np.arcsin(axis[2])
    toward = np.arcsin(np.clip(-axis @ level / np.cos(up), -1, 1)) if abs(axis[2]) < 0.98 else 0.0
    off = np.arccos(np.clip(-axis @ ray / np.linalg.norm(ray), -1, 1))
    toward_deg, up_deg, off_deg = np.rad2deg([toward, up, off]).tolist()
    return toward_deg, up_deg, off_deg


@pytest.mark.parametrize(
    ("name", "toward", "up"), [("1", 35, 0), ("2", 0, 0), ("3", 25, 30), ("5", 0, 90), ("6", 25, 30), ("9", 25, 30)]
)
def test_poses_are_as_asked_and_jittered(small: CableCell, name: str, toward: float, up: float) -> None:
    camera = rear(small)
    poses = [connector_pose(CONFIGURATIONS[name], camera.translation, seed) for seed in range(30)]
    for pose in poses:
        found = turned(pose, camera)
        assert abs(found[0] - toward) < 6.0  # 5 of jitter; it counts for more where the axis is raised
        assert abs(found[1] - up) < 5.1
        distance = float(np.linalg.norm(pose.translation - camera.translation))
        assert abs(distance - 0.75) < np.sqrt(3) * SceneParameters.position_jitter
    assert len({tuple(pose.translation) for pose in poses}) == 30


def test_the_fourth_lies_within_15_degrees_of_the_viewing_ray(small: CableCell) -> None:
    camera = rear(small)
    off = [turned(connector_pose(CONFIGURATIONS["4"], camera.translation, seed), camera)[2] for seed in range(50)]
    assert max(off) < 15.0


def test_the_tags_side_faces_the_camera_but_for_the_fifth(small: CableCell) -> None:
    camera = rear(small)
    for name, configuration in CONFIGURATIONS.items():
        pose = connector_pose(configuration, camera.translation, 3)
        facing = float(pose.rotation.apply([0.0, 1.0, 0.0]) @ (camera.translation - pose.translation))
        assert (facing > 0) == (name != "5")


def test_a_hidden_one_is_the_third_behind_a_piece(small: CableCell) -> None:
    camera = rear(small).translation
    third = connector_pose(CONFIGURATIONS["3"], camera, 4).as_matrix()
    for name in ("6", "9", "8 shadow"):
        np.testing.assert_array_equal(connector_pose(CONFIGURATIONS[name], camera, 4).as_matrix(), third)


@pytest.mark.parametrize("name", ["6", "9", "7 shadow"])
def test_so_much_is_hidden_by_the_true_mask(small: CableCell, name: str) -> None:
    with StudyScene(small, name, 2) as scene:
        wanted = scene.configuration.hidden
        assert abs(scene.truth.occluded_share("rear") - wanted) < 0.01
        fine = scene.world.cameras["rear"].spec.model_copy(update={"width": 1696, "height": 960}).intrinsics
        shown = scene.world.visuals.snapshot()
        gone = shown.copy()
        gone[[item.body == scene.world.fixed_bodies["obstacle tall"] for item in scene.world.visuals.items], :, 3] = 5.0
        seen, free = (_red(scene, poses, fine) for poses in (shown, gone))
        assert 1 - seen.size / free.size == pytest.approx(wanted, abs=0.02)  # in another count of pixels
        left_stays = seen.min() - free.min() < free.max() - seen.max()
        assert left_stays == scene.configuration.shadow


def _red(scene: StudyScene, poses: np.ndarray, camera: object) -> np.ndarray:
    """The columns of the connector's pixels."""
    ids = scene.world.cameras["rear"].segmentation(poses, camera)  # type: ignore[arg-type]
    cable = scene.world.objects.cable
    item = next(i.id for i in scene.world.visuals.items if (i.body, i.link) == (cable.body, cable.connector_link))
    return np.nonzero(ids == item)[1]


def test_nothing_is_hidden_without_a_piece(small: CableCell) -> None:
    with StudyScene(small, "3", 2) as scene:
        assert scene.truth.occluded_share("rear") == 0.0


@pytest.mark.parametrize("name", ["2", "4", "5"])
def test_the_stand_holds_the_cable_where_it_was_asked(small: CableCell, name: str) -> None:
    with StudyScene(small, name, 1) as scene:
        asked = connector_pose(CONFIGURATIONS[name], rear(small).translation, 1)
        scene.world.advance(1.0)
        off = asked.inv() * scene.truth.connector_pose()
        assert scene.truth.plugged()
        assert float(np.linalg.norm(off.translation)) < 5e-4
        assert float(np.rad2deg(off.rotation.magnitude())) < 0.5


def test_frames_come_alike_again_and_differ_by_their_noise(small: CableCell) -> None:
    first, camera, truth = frames("3", 5, 3, small)
    again, _, same = frames("3", 5, 3, small)
    for a, b in zip(first, again, strict=True):
        np.testing.assert_array_equal(a.depth, b.depth)
        np.testing.assert_array_equal(a.rgb, b.rgb)
    np.testing.assert_array_equal(truth.as_matrix(), same.as_matrix())
    np.testing.assert_array_equal(camera.as_matrix(), rear(small).as_matrix())
    assert not np.array_equal(first[0].depth, first[1].depth)
    assert np.diff([f.stamp for f in first]) == pytest.approx([1 / 15, 1 / 15])


def test_a_still_frame_is_the_cameras_own(small: CableCell) -> None:
    with StudyScene(small, "1", 0) as scene:
        still = next(scene.frames(1))
        scene.world.advance(1 / 15)
        scene.world.advance(0.04)
        taken = scene.world.cameras["rear"].latest()
        assert taken is not None
        assert taken.number == still.number
        # The cable still swings by micrometres.
        assert np.mean(taken.rgb != still.rgb) < 0.01
        assert np.mean(taken.depth != still.depth) < 0.05


def test_the_thesiss_technique_without_errors_sees_the_front_and_is_drawn_to_what_is_visible() -> None:
    cell = study_cell(overrides=NO_ERRORS)
    front: list[float] = []
    hidden: list[float] = []
    for name in HEADLINE:
        if name == "4":
            continue  # the end's face is seen, not the side
        seen, camera, truth = frames(name, 0, 1, cell)
        found = make_technique("rgbd", cell.known).estimate(seen[0], camera)
        assert isinstance(found, Estimate)
        axis = truth.rotation.apply([1.0, 0.0, 0.0])
        toward = np.cross(np.cross(axis, camera.translation - truth.translation), axis)
        surface = truth.translation + FRONT * cell.known.cable.connector.radius * toward / np.linalg.norm(toward)
        away = float(np.linalg.norm(found.position - surface))
        (hidden if CONFIGURATIONS[name].hidden else front).append(away)
    assert np.mean(front) < 0.006
    assert hidden == sorted(hidden)
    assert 0.02 < hidden[-1] < 0.04  # the thesis: 35.7 mm with 70 % hidden


def test_a_wrong_override_is_a_finding() -> None:
    with pytest.raises(Findings, match="key"):
        study_cell(overrides=["no key"])


def test_a_share_that_cannot_be_hidden_is_said(small: CableCell, monkeypatch: pytest.MonkeyPatch) -> None:
    whole = dataclasses.replace(CONFIGURATIONS["9"], hidden=1.5)
    monkeypatch.setitem(CONFIGURATIONS, "9", whole)
    with pytest.raises(RuntimeError, match="no place"):
        StudyScene(small, "9", 0)
