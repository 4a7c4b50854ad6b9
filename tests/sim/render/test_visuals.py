from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pybullet as p
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import RigidTransform, Rotation

from regrasp.interfaces.frame import Intrinsics
from regrasp.sim.render.picture import Z_FAR, Z_NEAR, LightState
from regrasp.sim.render.software import SoftwareRenderer
from regrasp.sim.render.visuals import Visuals

OFFSET_URDF = """<robot name="offset">
<link name="base">
 <inertial><origin xyz="0.1 -0.2 0.3" rpy="0.4 0.3 -0.2"/><mass value="1"/>
  <inertia ixx="1" iyy="2" izz="3" ixy="0" ixz="0" iyz="0"/></inertial>
 <visual><origin xyz="0.1 0.05 0.1" rpy="0.2 0 0.5"/><geometry><box size="0.3 0.2 0.1"/></geometry></visual>
</link>
<link name="tip">
 <inertial><origin xyz="-0.1 0.2 0.1" rpy="0.1 -0.7 0.2"/><mass value="1"/>
  <inertia ixx="1" iyy="2" izz="3" ixy="0" ixz="0" iyz="0"/></inertial>
 <visual><origin xyz="0 0.1 0.2" rpy="0 0.6 0"/><geometry><capsule radius="0.05" length="0.3"/></geometry></visual>
 <visual><origin xyz="0 -0.1 0.2" rpy="0.6 0 0"/><geometry><cylinder radius="0.05" length="0.2"/></geometry></visual>
</link>
<joint name="turn" type="revolute"><parent link="base"/><child link="tip"/><origin xyz="0 0 0.2" rpy="0 0.3 0"/>
 <axis xyz="0 1 0"/><limit lower="-3" upper="3" effort="1" velocity="1"/></joint>
</robot>"""


@pytest.fixture
def client() -> Iterator[int]:
    number = p.connect(p.DIRECT)
    yield number
    p.disconnect(number)


def test_offset_inertial_frames_look_as_bullet_itself_draws_them(client: int, tmp_path: Path) -> None:
    (tmp_path / "offset.urdf").write_text(OFFSET_URDF)
    body = p.loadURDF(str(tmp_path / "offset.urdf"), [0.2, 0.1, -0.1], [0.1, 0.2, 0.3, 0.9], physicsClientId=client)
    p.resetJointState(body, 0, 0.7, physicsClientId=client)
    visuals = Visuals(client)
    k = Intrinsics.from_fov(320, 240, 1.2)
    camera = RigidTransform.from_components([0.2, 0.1, -1.5], Rotation.identity())
    _, _, _, buffer, seen = p.getCameraImage(
        k.width,
        k.height,
        _view(camera),
        _projection(k),
        renderer=p.ER_TINY_RENDERER,
        flags=p.ER_SEGMENTATION_MASK_OBJECT_AND_LINKINDEX,
        physicsClientId=client,
    )
    truth = Z_FAR * Z_NEAR / (Z_FAR - (Z_FAR - Z_NEAR) * np.asarray(buffer, float).reshape(k.height, k.width))
    mine = SoftwareRenderer(visuals).render(visuals.snapshot(), camera, k, LightState((0, 0, 1), 0.5, 0.5))
    ids = np.asarray(seen).reshape(k.height, k.width)
    assert set(np.unique(ids)) == {-1, body, body + (1 << 24)}
    assert (mine.ids == ids).mean() > 0.999
    both = (mine.ids == ids) & (ids >= 0)
    off = np.abs(mine.depth - truth)
    assert off[both & (ids == body)].max() < 1e-3  # the box
    assert np.median(off[both & (ids != body)]) < 1e-3  # Bullet's own round things have other facets


def _view(world_from_camera: RigidTransform) -> list[float]:
    """OpenGL's view matrix (y up, z backwards), column by column."""
    flip = np.diag([1.0, -1.0, -1.0, 1.0])
    return list((flip @ world_from_camera.inv().as_matrix()).T.ravel())


def _projection(k: Intrinsics) -> list[float]:
    """OpenGL's projection matrix, column by column; Bullet samples a pixel at its lower left corner."""
    third = (1 - 2 * k.cx / k.width, 2 * (k.cy + 1) / k.height - 1, -(Z_FAR + Z_NEAR) / (Z_FAR - Z_NEAR), -1.0)
    fourth = (0.0, 0.0, -2 * Z_FAR * Z_NEAR / (Z_FAR - Z_NEAR), 0.0)
    return [2 * k.fx / k.width, 0.0, 0.0, 0.0, 0.0, 2 * k.fy / k.height, 0.0, 0.0, *third, *fourth]


@given(st.lists(st.floats(-1, 1), min_size=6, max_size=6), st.lists(st.floats(-1, 1), min_size=6, max_size=6))
def test_pose_of_a_base_is_pose_of_body_times_frame_of_shape(body: list[float], shape: list[float]) -> None:
    client = p.connect(p.DIRECT)
    try:
        world_from_body = RigidTransform.from_exp_coords(body)
        body_from_shape = RigidTransform.from_exp_coords(shape)
        visual = p.createVisualShape(
            p.GEOM_SPHERE,
            radius=0.1,
            visualFramePosition=body_from_shape.translation.tolist(),
            visualFrameOrientation=body_from_shape.rotation.as_quat().tolist(),
            physicsClientId=client,
        )
        p.createMultiBody(
            1,
            -1,
            visual,
            world_from_body.translation.tolist(),
            world_from_body.rotation.as_quat().tolist(),
            physicsClientId=client,
        )
        pose = Visuals(client).snapshot()[0]
    finally:
        p.disconnect(client)
    assert np.allclose(pose, (world_from_body * body_from_shape).as_matrix()[:3], atol=1e-6)


def test_transparent_shapes_are_left_out_and_ids_name_body_and_link(client: int, tmp_path: Path) -> None:
    for alpha in (1, 0, 1):
        shape = p.createVisualShape(p.GEOM_SPHERE, radius=0.1, rgbaColor=[1, 0, 0, alpha], physicsClientId=client)
        p.createMultiBody(0, -1, shape, physicsClientId=client)
    (tmp_path / "offset.urdf").write_text(OFFSET_URDF)
    p.loadURDF(str(tmp_path / "offset.urdf"), physicsClientId=client)
    visuals = Visuals(client)
    assert visuals.ids.tolist() == [0, 2, 3, 3 + (1 << 24), 3 + (1 << 24)]
    assert visuals.items[0].color == (1.0, 0.0, 0.0)


def test_snapshot_follows_the_joints_and_keeps_older_ones(client: int, tmp_path: Path) -> None:
    (tmp_path / "offset.urdf").write_text(OFFSET_URDF)
    body = p.loadURDF(str(tmp_path / "offset.urdf"), physicsClientId=client)
    visuals = Visuals(client)
    before = visuals.snapshot()
    kept = before.copy()
    p.resetJointState(body, 0, 1.0, physicsClientId=client)
    after = visuals.snapshot()
    assert np.array_equal(before, kept)
    assert np.array_equal(before[0], after[0])
    turn = Rotation.from_matrix(after[1, :, :3] @ before[1, :, :3].T).magnitude()
    assert turn == pytest.approx(1.0, abs=1e-5)
    with pytest.raises(ValueError, match="read-only"):
        after[0, 0, 0] = 1.0


def test_an_empty_world_has_no_items(client: int) -> None:
    assert Visuals(client).snapshot().shape == (0, 3, 4)
