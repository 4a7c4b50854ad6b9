"""Which arm takes the lost connector, with which grasp, and what is felt on the way."""

import numpy as np
import pytest
from fake_devices import Rig
from scipy.spatial.transform import RigidTransform, Rotation

from regrasp.interfaces.cable.cell import CableKnown
from regrasp.motion.cable.tether import course_length
from regrasp.motion.robots.contact_guard import Touch

ACROSS = Rotation.from_euler("z", 90, degrees=True)  # the connector's axis along world y


@pytest.fixture
def rig(known: CableKnown) -> Rig:
    return Rig(known)


def lying(*place: float) -> RigidTransform:
    return RigidTransform.from_components(place, ACROSS)


def hands(rig: Rig, connector: RigidTransform) -> list[str]:
    request = rig.motion.hands_for(connector)
    rig.run(request)
    return request.answer


def test_the_cells_hand_takes_what_both_arms_can_take_well(rig: Rig) -> None:
    assert hands(rig, lying(0.36, 0.0, 0.30))[0] == rig.known.cable.hand


def test_the_other_arm_takes_what_is_far_from_the_hand(rig: Rig) -> None:
    assert hands(rig, lying(0.15, 0.60, 0.30)) == ["left"]


def test_without_any_grasp_the_hand_stays_the_hand(rig: Rig) -> None:
    assert hands(rig, lying(1.5, 0.0, 0.3)) == [rig.motion.hand]


def test_the_course_of_a_straight_cable_is_as_long_as_the_way(known: CableKnown) -> None:
    anchor, course = known.cable.anchor
    for way in (0.2, 0.4):
        center = anchor + (way + 0.5 * known.cable.connector.length) * np.asarray(course)
        turn, _ = Rotation.align_vectors([course], [[1.0, 0.0, 0.0]])
        pose = RigidTransform.from_components(center, turn).as_matrix()
        assert course_length(known, pose) == pytest.approx(way, abs=1e-6)


def test_what_was_felt_is_on_the_map_until_it_is_forgotten(rig: Rig) -> None:
    motion = rig.motion
    assert not motion.forget_felt()
    q = np.array([0.4, -0.6, 0.6, 0.0, 0.3, 0.0])
    place = motion.feel("right", Touch(0.0, q, np.array([0.5, 0, 0, 0, 0, 0]), np.array([-2.0, 0, 0, 0, 0, 0])))
    grid = motion.all_mapped()
    assert grid is not None
    assert grid.at(place[None])[0] < 0.03
    assert motion.forget_felt()
    assert motion.all_mapped() is None


def test_nothing_is_felt_in_the_place_of_a_sleeping_arm(rig: Rig) -> None:
    motion = rig.motion
    asleep = np.array(rig.known.arm("right").sleep)
    motion.feel("right", Touch(0.0, asleep, np.array([0.5, 0, 0, 0, 0, 0]), np.array([-2.0, 0, 0, 0, 0, 0])))
    rig.arms["right"].at = np.array([0.4, -0.6, 0.6, 0.0, 0.3, 0.0])
    rig.run(motion.sleep("right"))
    assert motion.joints("right") == pytest.approx(asleep, abs=0.01)
