"""The cable's length tells the connector's end from its tip."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform, Rotation

from regrasp.interfaces.cable.cell import CableKnown
from regrasp.interfaces.cable.sight import Estimate
from regrasp.perception.cable.reach import within_reach


def at_the_end_of_a_straight_cable(known: CableKnown, shorter: float = 0.0) -> Estimate:
    anchor, course = known.cable.anchor
    position = anchor + (known.cable.length - shorter + 0.5 * known.cable.connector.length) * course
    rotation = Rotation.from_matrix(np.column_stack([course, [1.0, 0.0, 0.0], np.cross(course, [1.0, 0.0, 0.0])]))
    pose = RigidTransform.from_components(position, rotation)
    length = known.cable.connector.length
    return Estimate(0.0, "rear", position, course, pose, np.eye(6), 100, 100, length, True)


def turned(estimate: Estimate) -> Estimate:
    pose = estimate.world_from_connector * RigidTransform.from_rotation(Rotation.from_euler("z", np.pi))
    return replace(estimate, axis=-estimate.axis, world_from_connector=pose)


def test_a_pose_whose_cable_end_is_out_of_reach_is_turned_round(known: CableKnown) -> None:
    right = at_the_end_of_a_straight_cable(known)
    found = within_reach(turned(right), known, 0.025)
    assert found.sign_seen
    assert found.axis == pytest.approx(right.axis)
    assert found.world_from_connector.rotation.apply([1.0, 0.0, 0.0]) == pytest.approx(right.axis)
    assert found.position == pytest.approx(right.position)
    assert within_reach(right, known, 0.025).axis == pytest.approx(right.axis)


def test_where_both_ends_are_in_reach_or_none_nothing_is_told(known: CableKnown) -> None:
    for shorter in (0.2, -0.2):
        seen = at_the_end_of_a_straight_cable(known, shorter)
        assert within_reach(seen, known, 0.025) is seen
        assert within_reach(turned(seen), known, 0.025).axis == pytest.approx(-seen.axis)
