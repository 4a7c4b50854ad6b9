from collections.abc import Sequence
from itertools import islice

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cable.cell import CableKnown
from regrasp.interfaces.cell import Box, WristMount
from regrasp.motion.cable.viewpoints import SpiralParameters, Viewpoint, spiral
from regrasp.motion.robots.kinematics import ArmKinematics
from regrasp.motion.robots.views import ik_view
from regrasp.motion.scene.collision import ArmBody, CollisionModel

DISTANCE = SpiralParameters().distance
START = np.array([0.36, 0.14, 0.25])


def stops(known: CableKnown, start: FloatArray) -> list[Viewpoint]:
    rear = known.camera("rear")
    assert not isinstance(rear.mount, WristMount)
    return list(spiral(start, rear.mount.world_from_camera, rear.intrinsics))


def right_and_up(pose: RigidTransform) -> list[float]:
    """Offset from the start as seen when looking at the back panel."""
    offset = pose.translation - START
    return [round(-float(offset[1]), 6), round(float(offset[2]), 6)]


def test_main_point_is_flat_and_subpoints_go_round_from_the_right_downwards(known: CableKnown) -> None:
    first = stops(known, START)[:9]
    a = 0.125
    ring = [[a, 0], [a, -a], [0, -a], [-a, -a], [-a, 0], [-a, a], [0, a], [a, a]]
    assert [right_and_up(s.world_from_camera) for s in first] == [[0, 0], *ring]
    assert [(s.index, s.main, s.sub) for s in first] == [(i, 0, i) for i in range(9)]
    assert first[0].world_from_camera.rotation.apply([0, 0, 1]) == pytest.approx([1, 0, 0])
    for stop in first:
        assert stop.world_from_camera.translation[0] == pytest.approx(START[0] - DISTANCE)
        assert stop.world_from_camera.rotation.apply([0, -1, 0])[2] > 0.8  # upright


def test_subpoints_turn_by_30_degrees_towards_their_main_point(known: CableKnown) -> None:
    for stop in stops(known, START)[1:9]:
        view = stop.world_from_camera.rotation.apply([0, 0, 1])
        towards = START - stop.world_from_camera.translation
        assert view[0] == pytest.approx(np.cos(np.pi / 6))
        across = towards[1:] / np.linalg.norm(towards[1:])
        assert view[1:] == pytest.approx(np.sin(np.pi / 6) * across)


def test_main_points_spiral_outwards_in_view(known: CableKnown) -> None:
    mains = [right_and_up(s.world_from_camera) for s in stops(known, START) if s.sub == 0]
    b = 0.25
    assert mains[:6] == [[0, 0], [b, 0], [b, -b], [0, -b], [-b, -b], [-b, 0]]
    rear = known.camera("rear")
    assert not isinstance(rear.mount, WristMount)
    for right, up in mains:
        x, y, z = rear.mount.world_from_camera.inv().apply(START + np.array([0, -right, up]))
        assert z > 0
        assert abs(rear.intrinsics.fx * x / z) <= 424
        assert abs(rear.intrinsics.fy * y / z) <= 240
    assert len({tuple(m) for m in mains}) == len(mains)


def test_points_out_of_view_are_skipped_without_a_gap_in_the_count(known: CableKnown) -> None:
    edge = stops(known, np.array([0.36, -0.40, 0.25]))
    assert [s.index for s in edge] == list(range(len(edge)))
    first, second = islice((s.world_from_camera.translation for s in edge if s.sub == 0), 2)
    assert np.linalg.norm(second - first) >= 0.25
    assert second[1] >= -0.41  # the point to the right of the start is out of view


def test_the_left_arm_reaches_most_of_the_first_nine(
    known: CableKnown, boxes: Sequence[Box], left_arm: ArmKinematics, right_arm: ArmKinematics
) -> None:
    mount = known.camera("wrist").mount
    assert isinstance(mount, WristMount)
    others = CollisionModel(right_arm, []).spheres(np.array(known.arm("right").sleep))
    model = CollisionModel(left_arm, boxes, body=ArmBody(camera_offset=mount.offset), other_arm=others)
    reached = 0
    for stop in stops(known, START)[:9]:
        answers = ik_view(left_arm, stop.world_from_camera, mount.mount_from_camera)
        reached += any(model.free(q, 0.01) for q in answers)
    assert reached >= 6
