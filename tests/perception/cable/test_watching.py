from dataclasses import replace

import numpy as np
import pytest
from fake_services import Clock, FakePerception, seen, unseen

from regrasp.interfaces.cable.cell import CableKnown
from regrasp.interfaces.cable.sight import Estimate, NoEstimate, Sightings
from regrasp.interfaces.devices import TICK
from regrasp.interfaces.request import Request

PLACE = np.array([0.35, 0.1, 0.2])


@pytest.fixture
def eyes(known: CableKnown) -> FakePerception:
    eyes = FakePerception(Clock(1.0), known)
    eyes.shows = lambda camera, stamp: seen(stamp, PLACE, camera)
    return eyes


def done(eyes: FakePerception, task: Request[Sightings]) -> Sightings:
    """Its answer, after as many ticks as it takes."""
    while not task.poll():
        eyes.clock.t += TICK
    return task.answer


def stamps(sightings: Sightings) -> list[float]:
    return [round(e.stamp, 6) for e in sightings.estimates]


def test_each_frame_counts_once_from_the_first_moment_on(eyes: FakePerception) -> None:
    task = eyes.watch("rear", 0.4)
    assert eyes.looks == []
    assert stamps(done(eyes, task)) == pytest.approx([k / 15 for k in range(15, 22)], abs=1e-6)
    assert eyes.looks == pytest.approx([1.0 + TICK * k for k in range(1, 9)])  # a look a tick, none at once
    assert eyes.clock.t == pytest.approx(1.4)


def test_a_frame_of_the_first_moment_may_be_left_out(eyes: FakePerception) -> None:
    eyes.clock.t = 2.0
    later = [k / 15 for k in range(31, 37)]
    assert stamps(done(eyes, eyes.watch("rear", 0.4, later=True))) == pytest.approx(later, abs=1e-6)


def test_frames_from_before_the_arm_has_settled_do_not_count(eyes: FakePerception) -> None:
    assert min(stamps(done(eyes, eyes.watch("wrist", 0.4, settle=0.1)))) >= 1.1
    assert eyes.clock.t == pytest.approx(1.5)


@pytest.mark.parametrize(("trouble", "mapped"), [({}, 1), ({"wrist": "the wrist camera is frozen"}, 0)])
def test_the_obstacles_are_mapped_once_when_the_camera_is_trusted(
    eyes: FakePerception, trouble: dict[str, str], mapped: int
) -> None:
    eyes.troubles = trouble
    taken: list[float] = []
    done(eyes, eyes.watch("wrist", 1.0, on_mapped=lambda: taken.append(eyes.clock.t)))
    assert len(taken) == mapped


def test_what_may_be_the_connector_is_kept_with_its_middle(eyes: FakePerception) -> None:
    def shows(_camera: str, stamp: float) -> Estimate | NoEstimate:
        place = np.add(PLACE, [0.0, 0.0, 1.0]) if stamp > 1.3 else PLACE
        return replace(unseen(stamp), weak_detection=place)

    eyes.shows = shows
    looked = done(eyes, eyes.watch("rear", 0.4))
    assert looked.estimates == []
    assert len(looked.weak_detections) == 7
    assert looked.glimpse == pytest.approx(PLACE)
