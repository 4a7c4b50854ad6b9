"""Frames that no camera should give, for every technique.

The answer is a named reason, a ValueError, or a pose whose covariance holds the truth.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from raycast import REAR_POSE, RED
from scene import LEFTWARDS, PLACE, REAR, blocks, plug, seen

from regrasp.app.files.resources import shipped
from regrasp.app.tasks.cable.cells import cable_cell
from regrasp.app.tasks.cable.studies.pose.trial import CELL_OF_TECHNIQUE
from regrasp.interfaces.cable.cell import CableKnown
from regrasp.interfaces.frame import RgbdFrame
from regrasp.perception.pose.detector import Detector
from regrasp.perception.pose.estimate import Estimate, NoEstimate
from regrasp.perception.pose.rgbd import Rgbd
from regrasp.perception.pose.technique import TECHNIQUES, Technique, make_technique

CHI2_999_OF_3 = 16.27
Random = np.random.Generator
Colors = Callable[[NDArray[np.uint8], Random], NDArray[np.uint8]]
Depths = Callable[[NDArray[np.float32], Random], NDArray[np.float32]]


def flat(color: tuple[float, float, float]) -> Colors:
    return lambda rgb, _: np.full_like(rgb, np.round(255 * np.array(color)))


def all_of(value: float) -> Depths:
    return lambda depth, _: np.full_like(depth, value)


def some_of(value: float) -> Depths:
    return lambda depth, rng: np.where(rng.random(depth.shape) < rng.random(), np.float32(value), depth)


COLORS: dict[str, Colors] = {
    "as it is": lambda rgb, _: rgb,
    "black": flat((0.0, 0.0, 0.0)),
    "saturated": flat((1.0, 1.0, 1.0)),
    "the connector's": flat(RED),
    "noise": lambda rgb, rng: rng.integers(0, 256, rgb.shape, np.uint8),
    "half black": lambda rgb, rng: np.where(
        np.arange(rgb.shape[1])[:, None] < rng.integers(rgb.shape[1]), rgb, np.uint8(0)
    ),
    "mirrored": lambda rgb, _: rgb[:, ::-1].copy(),
    "red and blue exchanged": lambda rgb, _: rgb[..., ::-1].copy(),
}
DEPTHS: dict[str, Depths] = {
    "as it is": lambda depth, _: depth,
    **{f"all {value}": all_of(value) for value in (0.0, np.nan, np.inf, -np.inf, -1.0, 1e-6, 1e30)},
    **{f"some {value}": some_of(value) for value in (0.0, np.nan, np.inf, -np.inf, -1.0, 1e-6, 1e30)},
    "noise": lambda depth, rng: rng.uniform(0.0, 2.0, depth.shape).astype(np.float32),
    "millimetres": lambda depth, _: depth * np.float32(1000.0),
}


# In these the thesis's techniques take other things for the connector; the pose study counts such mistakes.
MISLEADING = ("noise", "mirrored")


@pytest.fixture(scope="session")
def whole(known: CableKnown) -> RgbdFrame:
    """A good frame."""
    return seen([*blocks(known.boxes), *plug()])


@pytest.fixture(scope="session", params=TECHNIQUES)
def technique(request: pytest.FixtureRequest) -> Technique:
    """Each in a cell that it can work in."""
    return make_technique(
        request.param, cable_cell(shipped("cell")[CELL_OF_TECHNIQUE.get(request.param, "thesis")]).known
    )


def consistent(result: Estimate | NoEstimate) -> bool:
    """Whether a pose, if there is one, holds the truth within its 99.9 % ellipsoid."""
    if isinstance(result, NoEstimate):
        return result.message != ""
    off = result.position - PLACE
    finite = bool(np.all(np.isfinite(result.covariance)) and np.all(np.isfinite(result.axis)))
    return finite and bool(off @ np.linalg.solve(result.covariance[:3, :3], off) < CHI2_999_OF_3)


@settings(max_examples=80)
@given(colors=st.sampled_from(list(COLORS)), depths=st.sampled_from(list(DEPTHS)), seed=st.integers(0, 2**32 - 1))
def test_a_spoilt_frame_gives_a_reason_or_a_consistent_pose(
    technique: Technique, whole: RgbdFrame, colors: str, depths: str, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    spoilt = replace(whole, rgb=COLORS[colors](whole.rgb, rng), depth=DEPTHS[depths](whole.depth, rng))
    result = technique.estimate(spoilt, REAR_POSE, axis=LEFTWARDS)
    assert consistent(result) or (isinstance(technique, Rgbd | Detector) and colors in MISLEADING), result


@pytest.mark.parametrize("colors", ["black", "saturated"])
def test_a_picture_without_its_colour_says_so(technique: Technique, whole: RgbdFrame, colors: str) -> None:
    spoilt = replace(whole, rgb=COLORS[colors](whole.rgb, np.random.default_rng(0)))
    assert isinstance(technique.estimate(spoilt, REAR_POSE), NoEstimate)


@pytest.mark.parametrize("depths", ["all 0.0", "all nan", "all inf", "all -1.0"])
def test_no_depth_at_all_gives_a_reason_or_a_consistent_pose(
    technique: Technique, whole: RgbdFrame, depths: str
) -> None:
    spoilt = replace(whole, depth=DEPTHS[depths](whole.depth, np.random.default_rng(0)))
    assert consistent(technique.estimate(spoilt, REAR_POSE))


@pytest.mark.parametrize(
    "change",
    [
        {"intrinsics": replace(REAR, width=640)},
        {"intrinsics": replace(REAR, width=REAR.height, height=REAR.width)},
        {"depth": np.zeros((REAR.height, REAR.width))},
        {"depth": np.zeros((REAR.height, REAR.width), np.uint16)},
        {"depth": np.zeros((REAR.height, REAR.width, 1), np.float32)},
        {"rgb": np.zeros((REAR.height, REAR.width), np.uint8)},
        {"rgb": np.zeros((REAR.height, REAR.width, 4), np.uint8)},
        {"rgb": np.zeros((REAR.height, REAR.width, 3))},
    ],
)
def test_images_that_do_not_fit_name_shape_and_type(whole: RgbdFrame, change: dict[str, object]) -> None:
    with pytest.raises(
        ValueError, match=r"(rgb|depth) is \(.*\) (uint8|uint16|float32|float64), .* ask for \(.*\) (uint8|float32)"
    ):
        replace(whole, **change)  # type: ignore[arg-type]
