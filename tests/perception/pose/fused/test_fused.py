import colorsys
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from raycast import BLACK, PURPLE, REAR_POSE, RED, Ball, Block, Cylinder, Sensor
from scene import LEFTWARDS, PLACE, Thing, blocks, plug, really, seen

from regrasp.interfaces.cable.cell import CableKnown
from regrasp.interfaces.frame import RgbdFrame
from regrasp.perception.camera.registration import FIXED_CAMERA_ERRORS
from regrasp.perception.pose.estimate import Estimate, NoEstimate
from regrasp.perception.pose.fused.fused import Fused, FusedParameters
from regrasp.perception.pose.segmentation import NotSeen

Vector = NDArray[np.float64]
DOWN = np.array([0.0, 0.0, -1.0])
CHI2_95_OF_3 = 7.81


@pytest.fixture(scope="session")
def fused(known: CableKnown) -> Fused:
    return Fused(known)


@pytest.fixture(scope="session")
def panels(known: CableKnown) -> list[Thing]:
    return blocks(known.boxes)


def drawn(panels: list[Thing], seed: int, *others: Thing) -> tuple[RgbdFrame, Vector, Vector]:
    """A frame of a connector anywhere by a camera with the cell's errors; the true centre and axis."""
    rng = np.random.default_rng(seed)
    center, axis = rng.uniform([0.26, -0.15, 0.20], [0.42, 0.25, 0.45]), rng.normal(size=3)
    axis /= np.linalg.norm(axis)
    camera = really(REAR_POSE, FIXED_CAMERA_ERRORS, rng)
    sensor = Sensor(scale=rng.normal(0.0, FIXED_CAMERA_ERRORS.scale))
    return seen([*panels, *plug(center, axis), *others], center, sensor, seed, camera), center, axis


def off(result: Estimate | NoEstimate, center: Vector = PLACE, axis: Vector = LEFTWARDS) -> tuple[float, float]:
    """Metres, and degrees between the axes with their signs."""
    assert isinstance(result, Estimate), result
    angle = np.rad2deg(np.arccos(np.clip(result.axis @ axis, -1.0, 1.0)))
    return float(np.linalg.norm(result.position - center)), float(angle)


def screen(share: float, left: bool) -> Block:
    """A board before a connector at `PLACE` that hides a share of its length, from its left or right end."""
    way = 1.0 if left else -1.0
    eye = np.asarray(REAR_POSE.translation)
    edge = eye + 0.85 * (PLACE + way * 0.09 * (0.5 - share) * LEFTWARDS - eye)
    low, high = sorted((edge[1], edge[1] + way * 0.15))
    return Block(np.array([edge[0], low, edge[2] - 0.2]), np.array([edge[0] + 0.03, high, edge[2] + 0.2]), PURPLE)


def test_anywhere_in_sight_it_is_found_to_millimetres(fused: Fused, panels: list[Thing]) -> None:
    errors = []
    for seed in range(25):
        frame, center, axis = drawn(panels, seed)
        errors.append(off(fused.estimate(frame, REAR_POSE, axis=axis), center, axis))
    position, angle = np.array(errors).T
    assert np.mean(position) < 0.002
    assert np.max(position) < 0.006
    assert np.median(angle) < 1.0
    assert np.max(angle) < 8.0


@pytest.mark.parametrize("share", [0.3, 0.5, 0.7])
@pytest.mark.parametrize("left", [True, False])
def test_a_half_hidden_one_is_not_drawn_to_its_visible_part(
    fused: Fused, panels: list[Thing], share: float, left: bool
) -> None:
    errors = []
    for seed in range(6):
        frame = seen([*panels, *plug(), screen(share, left)], seed=seed)
        errors.append(off(fused.estimate(frame, REAR_POSE)))
    position, angle = np.median(errors, axis=0)
    assert (position < 0.008, angle < 4.0) == (True, True), (position, angle)


def test_the_cable_tells_the_ends_apart_against_the_hint(fused: Fused, panels: list[Thing]) -> None:
    for axis in (LEFTWARDS, -LEFTWARDS, DOWN, np.array([-0.3, 0.5, 0.8]) / np.sqrt(0.98)):
        frame = seen([*panels, *plug(axis=axis)])
        assert off(fused.estimate(frame, REAR_POSE, axis=-axis), axis=axis)[1] < 5.0


def test_the_hint_decides_where_the_cable_is_hidden(fused: Fused, panels: list[Thing]) -> None:
    frame = seen([*panels, *plug(), screen(0.3, left=False)])
    for hint in (LEFTWARDS, -LEFTWARDS):
        assert off(fused.estimate(frame, REAR_POSE, axis=hint), axis=hint)[1] < 5.0


PLATE = np.array([0.002, 0.045, 0.03])
SQUARE = np.array([0.01, 0.045, 0.01])
LOOK_ALIKES: dict[str, list[Thing]] = {
    "no cable": [Cylinder(PLACE, DOWN)],  # upright: its depth shadow hides neither end
    "a box": [Block(PLACE - SQUARE, PLACE + SQUARE, RED)],
    "a cube": [Block(PLACE - 0.02, PLACE + 0.02, RED)],
    "a plate": [Block(PLACE - PLATE, PLACE + PLATE, RED)],
    "a ball": [Ball(PLACE, 0.02)],
    "a large ball": [Ball(PLACE, 0.045)],
    "a short rod": [
        Cylinder(PLACE, LEFTWARDS, 0.05),
        Cylinder(PLACE - 0.075 * LEFTWARDS, LEFTWARDS, 0.1, 0.0035, BLACK),
    ],
    "a long rod": [Cylinder(PLACE, LEFTWARDS, 0.16)],
    "a thin rod": [Cylinder(PLACE, LEFTWARDS, 0.09, 0.005)],
    "a thick rod": [Cylinder(PLACE, LEFTWARDS, 0.09, 0.02)],
    "a red cable": [Cylinder(PLACE, LEFTWARDS, 0.5, 0.0035)],
    "a red floor": [Block(np.array([0.2, -0.4, 0.1]), np.array([0.5, 0.5, 0.29]), RED)],
}


@pytest.mark.parametrize("name", LOOK_ALIKES)
def test_what_only_has_its_colour_is_refused(fused: Fused, panels: list[Thing], name: str) -> None:
    for seed in range(4):
        result = fused.estimate(seen([*panels, *LOOK_ALIKES[name]], seed=seed), REAR_POSE)
        assert isinstance(result, NoEstimate)
        assert result.reason is NotSeen.NOT_ITS_SHAPE


def test_a_bit_of_it_will_do_where_it_is_expected(fused: Fused, panels: list[Thing]) -> None:
    for seed in range(4):
        frame = seen([*panels, *plug(), screen(0.8, left=False)], seed=seed)  # no cable, and 18 mm of the tip
        assert isinstance(fused.estimate(frame, REAR_POSE), NoEstimate)
        assert off(fused.estimate(frame, REAR_POSE, near=PLACE + 0.01))[0] < 0.045


def test_a_bit_of_something_without_a_cable_is_refused(fused: Fused, panels: list[Thing]) -> None:
    lid = Block(PLACE - np.array([0.05, 0.1, 0.11]), PLACE + np.array([-0.03, 0.1, 0.006]), PURPLE)
    for seed in range(4):
        result = fused.estimate(seen([*panels, Ball(PLACE, 0.0115), lid], seed=seed), REAR_POSE)
        assert isinstance(result, NoEstimate)


def test_a_flat_piece_on_a_panel_is_refused(fused: Fused, panels: list[Thing], known: CableKnown) -> None:
    back = next(box for box in known.boxes if box.name == "back_panel")
    face = back.center[0] - back.size[0] / 2
    sticker = Block(np.array([face - 0.0005, 0.0, 0.3]), np.array([face, 0.08, 0.33]), RED)
    plug_before = Cylinder(np.array([face - 0.02, 0.04, 0.30]), LEFTWARDS, 0.12, 0.012, BLACK)
    at = np.array([face, 0.04, 0.33])
    for seed in range(4):
        result = fused.estimate(seen([*panels, sticker, plug_before], at, seed=seed), REAR_POSE)
        assert isinstance(result, NoEstimate)


def test_a_technique_takes_its_parameters(known: CableKnown, panels: list[Thing]) -> None:
    strict = Fused(known, FusedParameters(min_readings=10_000))
    result = strict.estimate(seen([*panels, *plug()]), REAR_POSE)
    assert isinstance(result, NoEstimate)
    assert result.reason is NotSeen.NO_DEPTH
    assert "10000 are needed" in result.message


def test_red_things_beside_it_are_not_mistaken(fused: Fused, panels: list[Thing]) -> None:
    above, right = np.array([0.0, 0.0, 0.09]), np.array([0.0, -0.10, 0.09])
    others: list[Thing] = [Ball(PLACE + above, 0.03), Block(PLACE + right - 0.03, PLACE + right + 0.03, RED)]
    assert off(fused.estimate(seen([*panels, *plug(), *others]), REAR_POSE))[0] < 0.003


def test_of_two_alike_the_one_near_to_the_last_place_is_taken(fused: Fused, panels: list[Thing]) -> None:
    upper = PLACE + np.array([0.02, 0.0, 0.06])
    frame = seen([*panels, *plug(), *plug(upper)])
    for center in (PLACE, upper):
        result = fused.estimate(frame, REAR_POSE, near=center + 0.01)
        assert off(result, center)[0] < 0.004


@pytest.mark.parametrize("hue", [0.0, 0.11, 0.33, 0.7, 0.85])
@pytest.mark.parametrize("cable", [BLACK, (0.9, 0.9, 0.9), (0.2, 0.5, 0.9)])
def test_connectors_and_cables_of_other_colours(
    known: CableKnown, panels: list[Thing], hue: float, cable: tuple[float, float, float]
) -> None:
    color = colorsys.hsv_to_rgb(hue, 0.9, 0.75)
    dyed = Fused(known.with_cable(connector=known.cable.connector.model_copy(update={"color": color})))
    result = dyed.estimate(seen([*panels, *plug(color=color, cable=cable)]), REAR_POSE, axis=-LEFTWARDS)
    position, angle = off(result)
    assert (position < 0.003, angle < 4.0) == (True, True), (position, angle)


def test_the_world_pose_agrees_with_position_and_axis(fused: Fused, panels: list[Thing]) -> None:
    result = fused.estimate(seen([*panels, *plug()]), REAR_POSE)
    assert isinstance(result, Estimate)
    np.testing.assert_allclose(result.world_from_connector.translation, result.position, atol=1e-12)
    np.testing.assert_allclose(result.world_from_connector.rotation.apply([1.0, 0.0, 0.0]), result.axis, atol=1e-9)
    assert result.whole
    assert result.extent == pytest.approx(0.09, abs=0.01)
    assert np.all(np.linalg.eigvalsh(result.covariance) > 0)


FACTORS = (0.5, 0.8, 0.9, 0.95, 1.05, 1.1, 1.25, 2.0)


@pytest.mark.parametrize(("focal", "depth"), [pair for x in FACTORS for pair in ((x, 1.0), (1.0, x), (x, x))])
def test_wrong_intrinsics_or_depths_give_no_wrong_pose_with_small_doubt(
    fused: Fused, panels: list[Thing], focal: float, depth: float
) -> None:
    frame, center, axis = drawn(panels, 7)
    k = frame.intrinsics
    wrong = replace(
        frame, intrinsics=replace(k, fx=focal * k.fx, fy=focal * k.fy), depth=np.float32(depth) * frame.depth
    )
    result = fused.estimate(wrong, REAR_POSE, axis=axis)
    if isinstance(result, Estimate):
        miss = result.position - center
        assert miss @ np.linalg.solve(result.covariance[:3, :3], miss) < CHI2_95_OF_3


def test_the_95_percent_ellipsoid_holds_the_truth(fused: Fused, panels: list[Thing]) -> None:
    inside, found, draws = 0, 0, 300
    for seed in range(1000, 1000 + draws):
        frame, center, axis = drawn(panels, seed)
        result = fused.estimate(frame, REAR_POSE, axis=axis)
        if isinstance(result, Estimate):
            found += 1
            miss = result.position - center
            inside += bool(miss @ np.linalg.solve(result.covariance[:3, :3], miss) < CHI2_95_OF_3)
    assert found >= 0.98 * draws  # the picture's rim cuts one now and then
    assert 0.88 * found <= inside <= 0.995 * found
