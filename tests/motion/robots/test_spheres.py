from pathlib import Path

import numpy as np
import pytest
import rtbdata
import trimesh
from robots import VX300S
from scipy.spatial.transform import Rotation

BODY = VX300S.body
MESHES = Path(rtbdata.__file__).parent / "xacro/trossen_descriptions/meshes/meshes_vx300s"

# Mesh, link, and the mesh's pose in the link's frame as in rtb-data's URDF; the finger stands 0.057 m out.
UPRIGHT = Rotation.from_euler("z", 90, degrees=True)
FLIPPED = Rotation.from_euler("x", 180, degrees=True)
PARTS = [
    ("3-UA", 2, UPRIGHT, [0.0, 0.0, 0.0]),
    ("4-UF", 3, FLIPPED, [0.0, 0.0, 0.0]),
    ("5-LF", 4, FLIPPED, [0.0, 0.0, 0.0]),
    ("6-Wrist", 5, UPRIGHT, [0.0, 0.0, 0.0]),
    ("7-Gripper", 6, UPRIGHT, [-0.02, 0.0, 0.0]),
    ("9-Gripper-Bar", 6, UPRIGHT, [-0.02017, 0.0, 0.0]),
    ("10-Finger", 6, Rotation.from_euler("xyz", [-90, 0, -90], degrees=True), [0.0283, -0.0005, 0.0]),
]


def test_spheres_are_small_at_the_finger_tips() -> None:
    """A connector 3 cm in front of a panel can be gripped at the tool's centre with the gripper square to the panel."""
    fingers = BODY.spheres[BODY.links == 6]
    assert float((fingers[:, 0] + fingers[:, 3]).max()) < VX300S.tool.xyz[0] + 0.03


def test_left_and_right_finger_mirror_each_other() -> None:
    tips = BODY.spheres[(BODY.links == 6) & (BODY.spheres[:, 0] > 0.07)]
    mirrored = tips * [1, -1, 1, 1]
    assert {tuple(row) for row in tips} == {tuple(row) for row in mirrored}


@pytest.mark.parametrize(("name", "link", "turn", "origin"), PARTS)
def test_spheres_cover_the_mesh(name: str, link: int, turn: Rotation, origin: list[float]) -> None:
    mesh = trimesh.load_mesh(MESHES / f"VXSA-300-M-{name}.stl")
    points, _ = trimesh.sample.sample_surface(mesh, 3000, seed=0)
    points = turn.apply(np.asarray(points) * 1e-3) + origin
    own = BODY.spheres[link == BODY.links]
    outside = (np.linalg.norm(points[:, None] - own[None, :, :3], axis=2) - own[:, 3]).min(axis=1)
    assert float(outside.max()) < (0.005 if name == "9-Gripper-Bar" else 0.003)
