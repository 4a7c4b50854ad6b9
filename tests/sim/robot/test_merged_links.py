"""Fixed links merged into their parents: the same body with fewer links."""

import xml.etree.ElementTree as ET

import numpy as np
import pytest

from regrasp.interfaces.robot.urdf import UrdfTree
from regrasp.sim.robot.merge import merge_fixed_links

# Two halves of a bar of 0.4 x 0.1 x 0.1 m and 2 kg along x, the second turned by a right angle about z, so that its
# own long axis is y; a hand turns on the second.
HALF = """<inertial><origin xyz="{at}" rpy="0 0 0"/><mass value="1"/>
    <inertia ixx="{ixx}" iyy="{iyy}" izz="{izz}" ixy="0" ixz="0" iyz="0"/></inertial>
  <collision><origin xyz="{at}" rpy="0 0 0"/><geometry><box size="{size}"/></geometry></collision>"""
THIN, LONG = (0.1**2 + 0.1**2) / 12, (0.2**2 + 0.1**2) / 12
BAR = f"""<robot name="bar">
  <link name="near">{HALF.format(at="0.1 0 0", ixx=THIN, iyy=LONG, izz=LONG, size="0.2 0.1 0.1")}</link>
  <link name="far">{HALF.format(at="0 0 0", ixx=LONG, iyy=THIN, izz=LONG, size="0.1 0.2 0.1")}</link>
  <link name="hand">{HALF.format(at="0 0 0", ixx=THIN, iyy=THIN, izz=THIN, size="0.1 0.1 0.1")}</link>
  <joint name="glue" type="fixed"><origin xyz="0.3 0 0" rpy="0 0 {np.pi / 2}"/>
    <parent link="near"/><child link="far"/></joint>
  <joint name="turn" type="revolute"><origin xyz="0 -0.1 0" rpy="0 0 0"/><axis xyz="0 0 1"/>
    <limit lower="-1" upper="1" effort="1" velocity="1"/><parent link="far"/><child link="hand"/></joint>
</robot>"""


def test_two_halves_of_a_bar_are_the_bar() -> None:
    root = ET.fromstring(BAR)
    merge_fixed_links(root, keep=())
    assert [link.get("name") for link in root.findall("link")] == ["near", "hand"]
    inertial = root.findall("link")[0].find("inertial")
    assert inertial is not None
    mass, origin, inertia = (inertial.find(tag) for tag in ("mass", "origin", "inertia"))
    assert mass is not None
    assert origin is not None
    assert inertia is not None
    assert float(mass.get("value", "")) == pytest.approx(2.0)
    assert [float(x) for x in origin.get("xyz", "").split()] == pytest.approx([0.2, 0.0, 0.0], abs=1e-12)
    across = 2.0 * (0.4**2 + 0.1**2) / 12
    expected = {"ixx": 2.0 * (0.1**2 + 0.1**2) / 12, "iyy": across, "izz": across, "ixy": 0.0, "ixz": 0.0, "iyz": 0.0}
    assert {name: float(value) for name, value in inertia.items()} == pytest.approx(expected, abs=1e-12)


def test_what_hangs_on_a_merged_link_stays_where_it_was() -> None:
    before, root = UrdfTree(ET.fromstring(BAR)).frame("hand"), ET.fromstring(BAR)
    merge_fixed_links(root, keep=())
    assert UrdfTree(root).frame("hand") == pytest.approx(before, abs=1e-12)
    boxes = [shape.find("origin") for shape in root.findall("link")[0].findall("collision")]
    places = [[float(x) for x in origin.get("xyz", "").split()] for origin in boxes if origin is not None]
    assert places == [pytest.approx([0.1, 0.0, 0.0]), pytest.approx([0.3, 0.0, 0.0])]


def test_a_link_that_is_asked_for_by_name_is_kept() -> None:
    root = ET.fromstring(BAR)
    merge_fixed_links(root, keep={"far"})
    assert [link.get("name") for link in root.findall("link")] == ["near", "far", "hand"]


def test_links_without_mass_are_merged_too() -> None:
    root = ET.fromstring(BAR.replace('<mass value="1"/>', '<mass value="0"/>'))
    merge_fixed_links(root, keep=())
    origin = root.find("link/inertial/origin")
    assert origin is not None
    assert [float(x) for x in origin.get("xyz", "").split()] == pytest.approx([0.1, 0.0, 0.0])
