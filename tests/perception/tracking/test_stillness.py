import numpy as np
import pytest
from numpy.typing import NDArray
from raycast import BLACK, IDEAL, MIDDLE_THIRD, REAR_POSE, WOOD, Block, Cylinder, Sensor, render
from scipy.spatial.transform import RigidTransform

from regrasp.interfaces.frame import Intrinsics, RgbdFrame
from regrasp.perception.tracking.stillness import Stillness, StillnessParameters

RATE = 15
PANEL = Block(np.array([0.508, -3.0, -3.0]), np.array([0.6, 3.0, 3.0]), WOOD)


def over(window: float) -> Stillness:
    return Stillness(StillnessParameters(window=window))


def feed(stillness: Stillness, images: list[NDArray[np.uint8]]) -> list[bool | None]:
    blank = np.zeros(images[0].shape[:2], np.float32)
    k = Intrinsics(images[0].shape[1], images[0].shape[0], 1.0, 1.0, 0.0, 0.0)
    return [stillness.feed(RgbdFrame("rear", i, i / RATE, rgb, blank, k)) for i, rgb in enumerate(images)]


def cable_at(z: float, rear: RigidTransform, camera: Intrinsics, seed: int, sensor: Sensor) -> NDArray[np.uint8]:
    cable = Cylinder(np.array([0.40, -0.1, z]), np.array([0.1, 1.0, 0.1]), 0.5, 0.0035, BLACK)
    return render([PANEL, cable], rear, camera, sensor, seed).rgb


def test_no_verdict_until_the_window_is_full() -> None:
    still = [np.full((48, 64, 3), 120, np.uint8)] * 17
    assert feed(over(1.0), still) == [None] * 15 + [True] * 2


def test_sensor_noise_and_flicker_are_not_motion() -> None:
    rng = np.random.default_rng(0)
    base = rng.integers(20, 200, (120, 212, 3)).repeat(4, axis=0).repeat(4, axis=1)
    images = []
    for i in range(18):
        light = 1.0 + 0.1 * np.sin(i)
        images.append(np.clip(base * light + rng.normal(0, 2.0, base.shape), 0, 255).astype(np.uint8))
    assert set(feed(over(1.0), images)[15:]) == {True}


@pytest.mark.parametrize("sensor", [IDEAL, Sensor(gray_noise=2.0)], ids=["clean", "noisy"])
def test_a_swinging_cable_is_seen_and_then_its_rest(sensor: Sensor) -> None:
    # 2 mm of swing at 0.8 Hz for 1.6 s, then rest; the end itself is not in the picture
    heights = [0.25 + 0.002 * np.sin(2 * np.pi * 0.8 * i / RATE) if i < 24 else 0.25 for i in range(44)]
    verdicts = feed(over(1.0), [cable_at(z, REAR_POSE, MIDDLE_THIRD, i, sensor) for i, z in enumerate(heights)])
    assert verdicts[15:24] == [False] * 9  # also at the turning points
    assert verdicts[40:] == [True] * 4


def test_a_slow_creep_is_motion() -> None:
    images = [cable_at(0.25 - 0.003 * i / RATE, REAR_POSE, MIDDLE_THIRD, i, IDEAL) for i in range(16)]
    assert feed(over(1.0), images)[-1] is False


def test_the_same_frame_again_adds_nothing_and_reset_forgets() -> None:
    stillness = over(0.2)
    image = np.full((48, 64, 3), 90, np.uint8)
    frame = RgbdFrame("rear", 0, 1.0, image, np.zeros((48, 64), np.float32), Intrinsics(64, 48, 1.0, 1.0, 0.0, 0.0))
    assert [stillness.feed(frame) for _ in range(5)] == [None] * 5
    assert feed(over(0.2), [image] * 4)[-1] is True
    stillness.reset()
    assert feed(stillness, [image] * 2) == [None, None]
