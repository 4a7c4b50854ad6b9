"""A small robot file beside its URDF: two joints, two sliding fingers, boxes and a mesh."""

from pathlib import Path

import trimesh

URDF = """\
<robot name="toy">
  <link name="base"><collision><geometry><box size="0.2 0.2 0.1"/></geometry></collision></link>
  <link name="upper"><collision><origin xyz="0 0 0.15"/>
    <geometry><mesh filename="upper.stl"/></geometry></collision></link>
  <link name="lower"><collision><origin xyz="0 0 0.1"/>
    <geometry><box size="0.04 0.04 0.2"/></geometry></collision></link>
  <link name="left"><collision><geometry><box size="0.01 0.02 0.04"/></geometry></collision></link>
  <link name="right"><collision><geometry><box size="0.01 0.02 0.04"/></geometry></collision></link>
  <joint name="turn" type="revolute"><parent link="base"/><child link="upper"/><origin xyz="0 0 0.06"/>
    <axis xyz="0 0 1"/><limit lower="-3" upper="3" velocity="2" effort="50"/></joint>
  <joint name="bend" type="revolute"><parent link="upper"/><child link="lower"/><origin xyz="0 0 0.3"/>
    <axis xyz="0 1 0"/><limit lower="-2" upper="2" velocity="2" effort="20"/></joint>
  <joint name="left" type="prismatic"><parent link="lower"/><child link="left"/><origin xyz="0 0 0.22"/>
    <axis xyz="0 1 0"/><limit lower="0" upper="0.05" velocity="1" effort="10"/></joint>
  <joint name="right" type="prismatic"><parent link="lower"/><child link="right"/><origin xyz="0 0 0.22"/>
    <axis xyz="0 1 0"/><limit lower="-0.05" upper="0" velocity="1" effort="10"/></joint>
</robot>
"""
ROBOT = """\
title: Toy
urdf: {path: toy.urdf}
base_link: base
joints:
  - {name: turn, acceleration: 5.0}
  - {name: bend, acceleration: 5.0, lower: -1.5}
tool: {link: lower, xyz: [0.0, 0.0, 0.24], rpy: [0.0, -1.5707963267948966, 0.0]}
gripper:
  type: parallel
  joints: [left, right]
  opening: 0.04
  force: 20.0
  speed: 0.1
  friction: 0.8
  pads: {links: [left, right], face: 0.005, ahead: 0.02, length: 0.02, height: 0.02, thickness: 0.004}
sleep: [0.0, 1.0]
calibration: {poses: [[0.0, 0.0]]}
footprint: {center: [0.0, 0.0, 0.0], size: [0.2, 0.2, 0.1]}
still: [base]
self_collision: []
cover: {excess: 0.06}
spheres:
  upper: [[0, 0, 0.0, 0.06], [0, 0, 0.05, 0.06], [0, 0, 0.1, 0.06], [0, 0, 0.15, 0.06], [0, 0, 0.2, 0.06],
          [0, 0, 0.25, 0.06], [0, 0, 0.3, 0.06]]
  lower: [[0, 0, 0.0, 0.05], [0, 0, 0.05, 0.05], [0, 0, 0.1, 0.05], [0, 0, 0.15, 0.05], [0, 0, 0.2, 0.05]]
  left: [[0, 0, 0, 0.03]]
  right: [[0, 0, 0, 0.03]]
"""


def write_robot(folder: Path, text: str = ROBOT) -> Path:
    """Write the robot's file, its URDF and the mesh of its upper arm; returns the robot's file."""
    trimesh.creation.box(extents=(0.06, 0.06, 0.3)).export(folder / "upper.stl")
    (folder / "toy.urdf").write_text(URDF)
    path = folder / "toy.yaml"
    path.write_text(text)
    return path
