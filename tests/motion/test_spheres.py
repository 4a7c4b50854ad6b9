from pathlib import Path

import numpy as np
import pytest
import rtbdata
import trimesh

from motion.spheres import LINKS, SPHERES

MESHES = Path(rtbdata.__file__).parent / "xacro/trossen_descriptions/meshes/meshes_vx300s"
# Mesh, link, its origin and turn about z in the link's frame: values of rtb-data's URDF.
PARTS = [("vxsa_300_3_upper_arm", 2), ("vxsa_300_4_upper_forearm", 3)]


def test_spheres_are_small_at_the_finger_tips() -> None:
    """A connector 3 cm in front of a panel can be gripped at the tool's centre with the gripper square to the panel."""
    fingers = SPHERES[LINKS == 6]
    assert (fingers[:, 0] + fingers[:, 3]).max() < 0.1072 + 0.032


def test_left_and_right_finger_mirror_each_other() -> None:
    tips = SPHERES[(LINKS == 6) & (SPHERES[:, 0] > 0.07)]
    mirrored = tips * [1, -1, 1, 1]
    assert sorted(map(tuple, tips)) == pytest.approx(sorted(map(tuple, mirrored)))


@pytest.mark.parametrize(("name", "link"), PARTS)
def test_spheres_cover_the_mesh(name: str, link: int) -> None:
    found = sorted(MESHES.glob(f"*{name.rsplit('_', 2)[-2]}_{name.rsplit('_', 1)[-1]}*"))
    assert found, sorted(p.name for p in MESHES.iterdir())
    mesh = trimesh.load_mesh(found[0])
    points = np.asarray(mesh.vertices) * 1e-3
    assert len(points)
