"""The URDF that the world loads for a robot: that of its file, with rubber pads, a camera on its mount, and paint."""

import copy
import xml.etree.ElementTree as ET

import numpy as np

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.fields import Color
from regrasp.interfaces.robot import urdf
from regrasp.interfaces.robot.parallel_jaw import ParallelJaw
from regrasp.interfaces.robot.parts import Gripper, Pads, ParallelGripper
from regrasp.interfaces.robot.robot import Robot
from regrasp.sim.robot.merge import merge_fixed_links

CAMERA_SIZE = (0.025, 0.090, 0.025)  # m; body of the D435i
CAMERA_COLOR: Color = (0.75, 0.75, 0.75)
BRACKET = (0.008, 0.030)  # m; thickness and width of the camera's bracket, which is visible and has no collision shape
BRACKET_COLOR: Color = (0.30, 0.30, 0.31)
PAD_COLOR: Color = (0.12, 0.12, 0.12)
_MASS, _INERTIA = 0.005, 1e-6  # kg and kg m2 of a pad and of the camera; choice: next to nothing


def robot_urdf(robot: Robot, camera_offset: tuple[float, float, float] | None) -> str:
    """The URDF text.

    Pads that are added are the links `left_pad` and `right_pad`. `camera_offset` (m, in the robot's mount) adds a
    camera; None leaves it out.
    """
    root = robot.element()
    _let_through(root, robot.untouchable)
    if robot.draw == "collision":
        _draw_collision_shapes(root)
    if robot.paint is not None:
        _paint(root, robot.paint)
    if isinstance(robot.gripper, ParallelGripper):
        _add_pads(root, robot.gripper.pads, robot.parallel_jaw)
    if camera_offset is not None:
        _add_camera(root, robot, camera_offset)
    # what the world asks for by its name, and what takes its colour from its link
    named = {robot.tool.link, *pad_links(robot.gripper), *robot.untouchable, "camera_body"}
    merge_fixed_links(root, named if robot.mount is None else {*named, robot.mount.link})
    ET.indent(root)
    return ET.tostring(root, encoding="unicode")


def pad_links(gripper: Gripper) -> tuple[str, str]:
    """The links of the left and the right pad."""
    return ("left_pad", "right_pad") if isinstance(gripper, ParallelGripper) else gripper.pads


def _add_pads(root: ET.Element, pads: Pads, jaw: ParallelJaw) -> None:
    size = (pads.length, pads.thickness, pads.height)
    for name, link, pose in zip(("left_pad", "right_pad"), pads.links, jaw.pads, strict=True):
        place, rpy = tuple(pose[:3, 3].tolist()), urdf.rpy_of(pose[:3, :3])
        _add_box(root, name, link, place, size, PAD_COLOR, rpy)


def _add_camera(root: ET.Element, robot: Robot, offset: tuple[float, float, float]) -> None:
    """The optical centre is at the front of the camera's body; a bracket joins it to the mount."""
    mount = robot.camera_mount
    pose = urdf.pose_of(mount.xyz, mount.rpy)
    behind = (offset[0] - CAMERA_SIZE[0] / 2 - 0.004, *offset[1:])
    place = pose[:3, :3] @ behind + pose[:3, 3]
    turn, rpy = pose[:3, :3], (0.0, 0.0, 0.0)
    if not set(np.unique(turn)) <= {-1.0, 0.0, 1.0}:  # a box cannot be turned by exchanging its edges
        turn, rpy = np.eye(3), mount.rpy
    body = _add_box(
        root, "camera_body", mount.link, tuple(place.tolist()), _turned_box(turn, CAMERA_SIZE), CAMERA_COLOR, rpy
    )
    span = offset[2]
    middle = tuple((turn @ (0.0, 0.0, -span / 2)).tolist())
    _add_visual(body, _turned_box(turn, (*BRACKET, span)), BRACKET_COLOR, middle)


def _turned_box(turn: FloatArray, size: tuple[float, ...]) -> tuple[float, ...]:
    """The edges of a box that is turned by whole right angles."""
    return tuple((np.abs(turn) @ size).tolist())


def _let_through(root: ET.Element, links: tuple[str, ...]) -> None:
    """Take away what the links collide with; what they look like stays."""
    for link in root.findall("link"):
        if link.get("name") in links:
            for shape in link.findall("collision"):
                shape.tag = "visual" if not link.findall("visual") else shape.tag
                if shape.tag == "collision":
                    link.remove(shape)


def _draw_collision_shapes(root: ET.Element) -> None:
    for link in root.findall("link"):
        shapes = link.findall("collision")
        if not any(shape.find("geometry/mesh") is not None for shape in shapes):  # nothing, or only rough balls
            continue
        for visual in link.findall("visual"):
            link.remove(visual)
        for shape in shapes:
            drawn = copy.deepcopy(shape)
            drawn.tag = "visual"
            link.append(drawn)


def _paint(root: ET.Element, color: Color) -> None:
    """Give all that is drawn this colour, in place of textures and colours of the URDF."""
    for material in root.findall("material"):
        name = material.get("name", "")
        material.clear()
        material.set("name", name)
        ET.SubElement(material, "color", rgba=urdf.numbers((*color, 1.0)))
    named = {material.get("name") for material in root.findall("material")}
    for n, visual in enumerate(root.iter("visual")):
        material_of = visual.find("material")
        if material_of is not None and material_of.get("name") in named:
            continue
        if material_of is not None:
            visual.remove(material_of)
        _color(visual, f"paint_{n}", color)


def _add_box(
    root: ET.Element,
    name: str,
    parent: str,
    position: tuple[float, ...],
    size: tuple[float, ...],
    color: Color,
    rpy: tuple[float, ...] = (0.0, 0.0, 0.0),
) -> ET.Element:
    """Add a box, as a link of its own, fixed on the link `parent`; return its link."""
    link = ET.SubElement(root, "link", name=name)
    _add_visual(link, size, color, (0.0, 0.0, 0.0))
    ET.SubElement(ET.SubElement(ET.SubElement(link, "collision"), "geometry"), "box", size=urdf.numbers(size))
    urdf.add_inertia(link, _MASS, _INERTIA)
    urdf.add_joint(root, f"{name}_joint", "fixed", parent, name, position, rpy)
    return link


def _add_visual(link: ET.Element, size: tuple[float, ...], color: Color, position: tuple[float, ...]) -> None:
    """Add a visual box at `position` in the link."""
    (visual,) = urdf.add_box(link, ("visual",), size, position)
    _color(visual, f"{link.get('name')}_color_{len(link)}", color)


def _color(visual: ET.Element, name: str, color: Color) -> None:
    material = ET.SubElement(visual, "material", name=name)
    ET.SubElement(material, "color", rgba=urdf.numbers((*color, 1.0)))
