from collections.abc import Callable, Iterator

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform

from regrasp.app.tasks.cable.studies.pose.trial import mean_estimate
from regrasp.interfaces.frame import Intrinsics, RgbdFrame
from regrasp.perception.pose.estimate import Estimate, NoEstimate, pose_covariance
from regrasp.perception.pose.segmentation import NotSeen

RATE = 15.0
CAMERA = Intrinsics(16, 16, 20.0, 20.0, 7.5, 7.5)
EYE = RigidTransform.identity()
TRUTH = RigidTransform.from_translation([0.1, 0.2, 0.7])
X = np.array([1.0, 0.0, 0.0])
Vector = NDArray[np.float64]


class Told:
    """A technique that answers as a function of the seconds says: a place and an axis, or None."""

    def __init__(self, answer: Callable[[float], tuple[Vector, Vector] | None]) -> None:
        self.answer, self.asked = answer, 0

    def estimate(
        self, frame: RgbdFrame, world_from_camera: RigidTransform, *, axis: object = None, near: object = None
    ) -> Estimate | NoEstimate:
        self.asked += 1
        told = self.answer(frame.stamp)
        if told is None:
            return NoEstimate(frame.stamp, "rear", NotSeen.NO_COLOR, "nothing red")
        pose = RigidTransform.from_translation(told[0])
        covariance = pose_covariance(told[1], 0.01, 0.1)
        return Estimate(frame.stamp, "rear", told[0], told[1], pose, covariance, 100, 100, 0.09, True)


def frames() -> Iterator[RgbdFrame]:
    rgb, depth = np.zeros((16, 16, 3), np.uint8), np.ones((16, 16), np.float32)
    for i in range(1000):
        yield RgbdFrame("rear", i, i / RATE, rgb, depth, CAMERA)


def test_the_mean_is_over_three_seconds_from_the_first_estimate() -> None:
    told = Told(lambda t: None if t < 1.99 else (TRUTH.translation + 0.001 * (t > 3.499) * X, X))
    seen = mean_estimate(told, frames(), EYE, TRUTH)
    assert seen.seconds == pytest.approx(2.0)
    assert (len(seen.estimates), told.asked) == (45, 75)
    assert seen.world_from_connector is not None
    np.testing.assert_allclose(seen.world_from_connector.translation - TRUTH.translation, [22e-3 / 45, 0, 0], atol=3e-5)


def test_what_shows_after_five_seconds_is_not_identified() -> None:
    told = Told(lambda t: None if t < 4.999 else (TRUTH.translation, X))
    seen = mean_estimate(told, frames(), EYE, TRUTH)
    assert (seen.world_from_connector, seen.why, told.asked) == (None, "nothing red", 75)
    late = mean_estimate(Told(lambda t: None if t < 4.9 else (TRUTH.translation, X)), frames(), EYE, TRUTH)
    assert len(late.estimates) == 45


def test_something_else_is_not_the_connector() -> None:
    seen = mean_estimate(Told(lambda _: (TRUTH.translation + 0.2 * X, X)), frames(), EYE, TRUTH)
    assert seen.world_from_connector is None
    assert seen.why == "what was identified is 0.20 m from the connector"


def test_an_axis_that_now_and_then_turns_round_keeps_its_line() -> None:
    tilted = np.array([np.cos(0.2), np.sin(0.2), 0.0])
    seen = mean_estimate(Told(lambda t: (TRUTH.translation, -X if t < 0.5 else tilted)), frames(), EYE, TRUTH)
    assert seen.world_from_connector is not None
    axis = seen.world_from_connector.rotation.apply(X)
    assert axis @ X > 0.9  # where most pointed
    assert axis[1] > 0.1
