import numpy as np
import pytest

from regrasp.interfaces.frame import Intrinsics, RgbdFrame
from regrasp.perception.camera.health import CameraHealth, CameraHealthParameters

RATE = 15
MAX_AGE, REPEATS = CameraHealthParameters().max_frame_age, CameraHealthParameters().max_repeats


def frame(number: int, *, light: int = 100, measured: float = 0.8, still: bool = False) -> RgbdFrame:
    """A frame of a wall with fresh depth noise, unless it is `still`."""
    rng = np.random.default_rng(0 if still else number)
    depth = rng.normal(0.8, 0.003, (48, 64)).astype(np.float32)
    depth[:, : round(64 * (1 - measured))] = 0.0
    rgb = np.full((48, 64, 3), light, np.uint8)
    return RgbdFrame("rear", number, number / RATE, rgb, depth, Intrinsics.from_fov(64, 48, 1.1))


def fed(*frames: RgbdFrame) -> CameraHealth:
    health = CameraHealth("rear")
    for one in frames:
        health.feed(one)
    return health


def test_sound_frames_are_trusted() -> None:
    assert fed(*(frame(n) for n in range(1, 20))).trouble(20 / RATE) is None


@pytest.mark.parametrize(
    ("bad", "said"),
    [({"light": 2}, "is dark: mean 2.0 of 255"), ({"measured": 0.0}, "measures depth on 0 % of its pixels")],
)
def test_one_bad_frame_is_enough_and_a_sound_one_mends_it(bad: dict[str, float], said: str) -> None:
    health = fed(frame(1), frame(2, **bad))  # type: ignore[arg-type]
    assert said in (health.trouble(2 / RATE) or "")
    health.feed(frame(3))
    assert health.trouble(3 / RATE) is None


def test_a_picture_that_repeats_under_fresh_stamps_is_frozen() -> None:
    health = fed(*(frame(n, still=True) for n in range(1, REPEATS + 1)))
    assert health.trouble(0.3) is None
    health.feed(frame(REPEATS + 1, still=True))
    assert "is frozen: 3 frames" in (health.trouble(0.3) or "")


def test_one_frame_read_often_is_not_frozen() -> None:
    assert fed(*[frame(1)] * 10).trouble(0.1) is None


@pytest.mark.parametrize(("age", "late"), [(0.9 * MAX_AGE, False), (1.1 * MAX_AGE, True)])
def test_a_stream_that_stands_still_is_late(age: float, late: bool) -> None:
    assert bool(fed(frame(1)).trouble(1 / RATE + age)) == late


def test_a_camera_that_never_gave_a_frame_is_late() -> None:
    assert CameraHealth("rear").trouble(0.1) is None
    assert "no new frame" in (CameraHealth("rear").trouble(1.0) or "")
