from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from robots import VX300S
from scipy.spatial.transform import RigidTransform

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cable.cell import CableKnown
from regrasp.interfaces.cell import Box
from regrasp.motion.robots.kinematics import ArmKinematics
from regrasp.motion.scene.collision import ArmBody, CollisionModel
from regrasp.motion.scene.distance_grid import DistanceGrid

HOME = np.array([0.0, -0.8, 0.8, 0.0, 0.5, 0.0])
FORWARD = np.zeros(6)
KIN = ArmKinematics(VX300S, RigidTransform.identity())
SPHERES = VX300S.body.spheres  # rows of x, y, z and radius, m
SPHERE_LINKS = VX300S.body.links
BLOCK = Box(name="block", center=(0.45, 0.1, 0.35), size=(0.2, 0.06, 0.3))

joints = st.tuples(*(st.floats(float(a), float(b)) for a, b in zip(KIN.lower, KIN.upper, strict=True))).map(np.array)


def brute_force(kin: ArmKinematics, q: FloatArray, box: Box) -> float:
    """Least distance from the moving links' spheres to points laid densely over the box's surface."""
    spheres = CollisionModel(kin, []).spheres(q)[SPHERE_LINKS >= 2]
    axes = [np.linspace(c - s / 2, c + s / 2, 1 + round(s / 0.01)) for c, s in zip(box.center, box.size, strict=True)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    gaps = np.linalg.norm(spheres[:, None, :3] - points[None], axis=2) - spheres[:, None, 3]
    return float(gaps.min())


@settings(max_examples=60)
@given(joints)
def test_distance_to_a_box_is_that_of_brute_force(q: FloatArray) -> None:
    model = CollisionModel(KIN, [BLOCK])
    truth = brute_force(KIN, q, BLOCK)  # up to half a cell's diagonal too large, and wrong inside the box
    clearance = min(model.clearance(q), CollisionModel(KIN, []).clearance(q))
    if truth > 0.01 and CollisionModel(KIN, []).clearance(q) > truth:
        assert truth - 0.009 <= clearance <= truth + 1e-9
    if truth < 0:
        assert not model.free(q, 0.0)


def test_free_sees_each_sphere_of_an_arm_touched_alone() -> None:
    body = ArmBody(camera_offset=(0, 0, 0.06), carried=np.array([[0.02, 0, 0, 0.01]]))
    model = CollisionModel(KIN, [], body)
    links = np.array([*SPHERE_LINKS, 5, 5, 5, 6])
    for x, y, z, radius in model.spheres(HOME)[links >= 2]:
        for way in np.vstack([np.eye(3), -np.eye(3)]):
            center = np.array([x, y, z]) + way * (radius + 0.003)
            touching = np.append(center, 0.003 + 1e-6)[None]
            assert not CollisionModel(KIN, [], body, other_arm=touching).free(HOME, 0.0)


@settings(max_examples=60)
@given(joints, st.floats(0.0, 0.05))
def test_free_agrees_with_clearance(q: FloatArray, margin: float) -> None:
    other = CollisionModel(ArmKinematics(VX300S, RigidTransform.from_translation([0.0, 0.35, 0.0])), []).spheres(HOME)
    grid = DistanceGrid.from_points(np.array([[0.3, -0.2, 0.3]]), np.full(3, -1.0), np.full(3, 1.0), 0.02)
    model = CollisionModel(KIN, [BLOCK], body=ArmBody(camera_offset=(0, 0, 0.06)), other_arm=other, grid=grid)
    distance, what = model.nearest(q)
    if distance < 0:
        assert not model.free(q, 0.0)
    elif what == "itself":  # no margin is asked of the arm's own links
        assert model.free(q, min(margin, distance))
    else:
        assert model.free(q, margin) == (distance >= margin)


def test_the_sleeping_arms_of_the_thesis_cell_touch_nothing(known: CableKnown, boxes: Sequence[Box]) -> None:
    arms = {str(a.name): ArmKinematics(a.robot, a.world_from_base) for a in known.arms}
    sleep = {str(a.name): np.array(a.sleep) for a in known.arms}
    for name, other in (("left", "right"), ("right", "left")):
        others = CollisionModel(arms[other], []).spheres(sleep[other])
        camera = (0.0, 0.0, 0.06) if name == "left" else None
        model = CollisionModel(arms[name], boxes, body=ArmBody(camera), other_arm=others)
        assert model.free(sleep[name], 0.02), model.nearest(sleep[name])


def test_nearest_names_what_is_in_the_way() -> None:
    assert CollisionModel(KIN, [BLOCK]).nearest(np.array([0.2, 0, 0, 0, 0, 0]))[1] == "block"
    down = np.array([0.0, 0.8, 0.3, 0.0, 0.3, 0.0])
    floor = Box(name="floor", center=(0, 0, -0.02), size=(2, 2, 0.04))
    distance, what = CollisionModel(KIN, [floor]).nearest(down)
    assert (distance < 0, what) == (True, "floor")
    folded = np.array([0.0, -1.85, 1.6, 0.0, 2.2, 0.0])
    assert CollisionModel(KIN, []).nearest(folded)[1] == "itself"
    assert not CollisionModel(KIN, []).free(folded, 0.0)


def test_joint_limits_are_not_free() -> None:
    assert CollisionModel(KIN, []).free(HOME, 0.0)
    assert not CollisionModel(KIN, []).free(HOME + np.array([0, 2.2, 0, 0, 0, 0]), 0.0)


def test_another_arm_in_the_way() -> None:
    neighbour = ArmKinematics(VX300S, RigidTransform.from_translation([0.0, 0.3556, 0.0]))
    turned = np.array([-0.9, 0.0, 0.0, 0.0, 0.0, 0.0])
    others = CollisionModel(neighbour, []).spheres(turned)
    model = CollisionModel(KIN, [], other_arm=others)
    towards = np.array([0.9, 0.0, 0.0, 0.0, 0.0, 0.0])
    assert model.nearest(towards)[1] == "other arm"
    assert not model.free(towards, 0.0)
    assert model.free(np.array([-0.9, 0.0, 0.0, 0.0, 0.0, 0.0]), 0.05)


def test_seen_surface_blocks_within_the_grids_error() -> None:
    tips = CollisionModel(KIN, []).spheres(FORWARD)
    front = tips[np.argmax(tips[:, 0] + tips[:, 3])]
    for distance, free in ((0.0, False), (0.05, True)):
        point = front[:3] + np.array([front[3] + distance, 0.0, 0.0])
        grid = DistanceGrid.from_points(point[None], np.full(3, -1.0), np.full(3, 1.0), 0.02)
        assert CollisionModel(KIN, [], grid=grid).free(FORWARD, 0.01) is free


def test_a_carried_thing_counts() -> None:
    wall = Box(name="wall", center=(0.70, 0, 0.4), size=(0.02, 0.5, 0.5))
    stick = np.array([[0.14, 0.0, 0.0, 0.01]])  # ahead of the tool centre at x = 0.55
    assert CollisionModel(KIN, [wall]).free(FORWARD, 0.01)
    assert not CollisionModel(KIN, [wall], body=ArmBody(carried=stick)).free(FORWARD, 0.01)


def test_edge_sees_what_lies_between_its_free_ends() -> None:
    model = CollisionModel(KIN, [Box(name="post", center=(0.5, 0.0, 0.42), size=(0.03, 0.03, 0.2))])
    a, b = np.array([-0.7, 0, 0, 0, 0, 0]), np.array([0.7, 0, 0, 0, 0, 0])
    assert model.free(a, 0.01)
    assert model.free(b, 0.01)
    assert not model.edge_free(a, b, 0.01)
    assert not model.path_free(np.array([a, b]), 0.01)
    assert model.edge_free(a, a - 0.1, 0.01)


def test_spheres_move_with_their_links() -> None:
    q = np.array([0.4, -0.3, 0.2, 0.5, -0.6, 0.7])
    frames = KIN.link_frames(q)
    expected = [frames[k] @ np.append(s[:3], 1.0) for k, s in zip(SPHERE_LINKS, SPHERES, strict=True)]
    assert CollisionModel(KIN, []).spheres(q)[:, :3] == pytest.approx(np.array(expected)[:, :3])
