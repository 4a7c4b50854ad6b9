import numpy as np
from scipy.spatial.transform import RigidTransform

from regrasp.interfaces.cable.sight import TrackState
from regrasp.perception.pose.estimate import Estimate, NoEstimate
from regrasp.perception.pose.segmentation import NotSeen
from regrasp.perception.tracking.track import ConnectorTrack

PLACE = np.array([0.4, 0.0, 0.3])
RATE = 15


def estimate(stamp: float, position: np.ndarray = PLACE, camera: str = "rear") -> Estimate:
    pose = RigidTransform.from_translation(position)
    return Estimate(stamp, camera, position, np.array([0.0, 1.0, 0.0]), pose, np.eye(6), 1000, 1200, 0.09, True)


def watched(seconds: float, noise: float = 1e-4) -> ConnectorTrack:
    track, rng = ConnectorTrack(), np.random.default_rng(4)
    for i in range(round(seconds * RATE) + 1):
        t = i / RATE
        track.feed(estimate(t, PLACE + rng.normal(0, noise, 3)))
    return track


def test_a_connector_never_seen_does_not_exist() -> None:
    track = ConnectorTrack()
    track.feed(NoEstimate(0.0, "rear", NotSeen.NO_COLOR, "no pixel has the connector's colour"))
    health = track.check(0.1)
    assert (health.exists, health.ok, track.state(0.1)[0]) == (False, False, TrackState.UNKNOWN)
    assert "no pixel" in health.reason
    assert track.position(0.1) is None


def test_a_watched_connector_passes_the_three_checks() -> None:
    track = watched(2.0)
    assert track.check(2.03).ok
    assert track.state(2.03)[0] is TrackState.VISIBLE


def test_it_goes_stale_after_the_limit() -> None:
    track = watched(2.0)
    assert track.check(2.49).fresh
    health = track.check(2.51)
    assert (health.exists, health.fresh) == (True, False)
    assert track.state(2.51)[0] is TrackState.LOST
    assert "0.51 s ago" in health.reason


def test_estimates_that_never_change_are_not_live() -> None:
    health = watched(2.0, noise=0.0).check(2.0)
    assert (health.fresh, health.live) == (True, False)


def test_a_repeated_image_does_not_keep_the_track_fresh() -> None:
    track = watched(1.0)
    for _ in range(20):
        track.feed(estimate(1.0))
    assert not track.check(2.0).fresh


def test_two_cameras_that_disagree_are_not_motion() -> None:
    track = ConnectorTrack()
    for i in range(16):
        track.feed(estimate(i / RATE, camera="rear"))
        track.feed(estimate(i / RATE, PLACE + 0.01, camera="wrist"))
    assert not track.check(1.0).live


def test_what_the_holding_hand_hides_is_not_lost() -> None:
    track = watched(1.0)
    tool = np.add(PLACE, [-0.03, 0.0, 0.0])
    track.set_holding_tool(tool)
    later = np.add(tool, [0.0, 0.2, 0.0])
    track.set_holding_tool(later)  # carried on, unseen
    state, sentence = track.state(3.0)
    assert state is TrackState.HIDDEN_BY_HAND
    assert "hides" in sentence
    np.testing.assert_array_equal(track.position(3.0), later)
    track.set_holding_tool(None)  # the fingers feel nothing any more
    assert track.state(3.0)[0] is TrackState.LOST


def test_a_hand_elsewhere_hides_nothing() -> None:
    track = watched(1.0)
    track.set_holding_tool(np.add(PLACE, [0.0, -0.4, 0.0]))
    assert track.state(3.0)[0] is TrackState.LOST


def test_seen_away_from_the_hand_and_then_lost_is_lost() -> None:
    track = watched(1.0)
    track.set_holding_tool(PLACE)
    track.feed(estimate(1.1, np.add(PLACE, [0.0, 0.0, -0.3])))
    assert track.state(3.0)[0] is TrackState.LOST
