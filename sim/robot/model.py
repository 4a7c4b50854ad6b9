"""URDF of the ViperX 300 S, made from the `rtb-data` package, with rubber pads on the fingers and a wrist camera."""

import xml.etree.ElementTree as ET
from importlib.resources import files

import xacro

from regrasp.interfaces.fields import Color

PACKAGE = "package://trossen_descriptions/"
ROBOT_NAME = "vx300s"
# Dimensions of this robot, in metres.
FINGER_FACE = 0.0135  # measured on rtb-data's meshes: a finger's inner face lies this far behind its joint's position
# The pads sit at the finger tips. Their centre, which is our tool centre, lies this far in front of the fingers' link,
# 0.018 in front of the maker's ee_gripper_link. A finger so ends 0.012 past what it holds, to hold a plug near a panel.
PAD_CENTER_X = 0.0565
PAD_LENGTH = 0.024  # along the fingers
PAD_HEIGHT = 0.034  # of the finger's 0.061; a cylinder gripped over such a length resists a bending moment
CAMERA_SIZE = (0.025, 0.090, 0.025)  # body of the D435i
BRACKET = (0.008, 0.030)  # thickness and width of the camera's bracket, which is visible and has no collision shape
# The real arms are black. Choice: grey, so that no lit part of them is as dark as what is black in a cell.
ARM_COLOR = (0.30, 0.30, 0.31)


def robot_urdf(pad_thickness: float, camera_offset: tuple[float, float, float] | None) -> str:
    """The URDF text.

    The pads, `pad_thickness` m thick, are the links `left_pad` and `right_pad`. `camera_offset` (m, in our wrist link)
    adds a camera; None leaves it out.
    """
    root = files("rtbdata") / "xacro" / "trossen_descriptions"
    document = xacro.process_file(str(root / "urdf" / "vx300s.urdf.xacro"), mappings={"robot_name": ROBOT_NAME})
    # PyBullet cannot parse a one-line URDF.
    text = document.toprettyxml(indent=" ").replace(PACKAGE, f"{root}/")
    robot = ET.fromstring(text)
    _set_color(robot.find("material"))
    for finger, side in (("left", 1.0), ("right", -1.0)):
        # The finger link's origin is at its joint's position: the face is FINGER_FACE nearer to the middle.
        y = -side * (FINGER_FACE + pad_thickness / 2)
        _add_box(
            robot,
            f"{finger}_pad",
            f"{ROBOT_NAME}/{finger}_finger_link",
            (PAD_CENTER_X, y, 0.0),
            (PAD_LENGTH, pad_thickness, PAD_HEIGHT),
            (0.12, 0.12, 0.12),
        )
    if camera_offset is not None:
        # The optical centre is at the front of the body. The URDF's wrist link is ours rotated by pi about x.
        behind = (camera_offset[0] - CAMERA_SIZE[0] / 2 - 0.004, -camera_offset[1], -camera_offset[2])
        body = _add_box(robot, "camera_body", f"{ROBOT_NAME}/wrist_link", behind, CAMERA_SIZE, (0.75, 0.75, 0.75))
        span = camera_offset[2]
        _add_visual(body, (*BRACKET, span), ARM_COLOR, (0.0, 0.0, span / 2))
    ET.indent(robot)
    return ET.tostring(robot, encoding="unicode")


def pad_gap(left: float, right: float, pad_thickness: float) -> float:
    """Distance between the pads in m; `left` and `right` are the finger joints' positions in m."""
    return left - right - 2 * (FINGER_FACE + pad_thickness)


def finger_position(gap: float, pad_thickness: float) -> float:
    """Position of the left finger joint in m at which the pads are `gap` m apart; the right one's is its negative."""
    return gap / 2 + FINGER_FACE + pad_thickness


def _add_box(
    robot: ET.Element,
    name: str,
    parent: str,
    position: tuple[float, float, float],
    size: tuple[float, float, float],
    color: Color,
) -> ET.Element:
    """Add a box, as a link of its own, fixed on the link `parent`; return its link."""
    link = ET.SubElement(robot, "link", name=name)
    _add_visual(link, size, color, (0.0, 0.0, 0.0))
    ET.SubElement(ET.SubElement(ET.SubElement(link, "collision"), "geometry"), "box", size=_numbers(size))
    inertial = ET.SubElement(link, "inertial")
    ET.SubElement(inertial, "mass", value="0.005")
    ET.SubElement(inertial, "inertia", ixx="1e-6", iyy="1e-6", izz="1e-6", ixy="0", ixz="0", iyz="0")
    joint = ET.SubElement(robot, "joint", name=f"{name}_joint", type="fixed")
    ET.SubElement(joint, "parent", link=parent)
    ET.SubElement(joint, "child", link=name)
    ET.SubElement(joint, "origin", xyz=_numbers(position), rpy="0 0 0")
    return link


def _add_visual(
    link: ET.Element,
    size: tuple[float, float, float],
    color: Color,
    position: tuple[float, float, float],
) -> None:
    """Add a visual box at `position` in the link."""
    visual = ET.SubElement(link, "visual")
    ET.SubElement(visual, "origin", xyz=_numbers(position), rpy="0 0 0")
    ET.SubElement(ET.SubElement(visual, "geometry"), "box", size=_numbers(size))
    material = ET.SubElement(visual, "material", name=f"{link.get('name')}_color_{len(link)}")
    ET.SubElement(material, "color", rgba=_numbers((*color, 1.0)))


def _set_color(material: ET.Element | None) -> None:
    """Replace the texture of rtb-data's only material by the arms' colour."""
    if material is None:
        raise ValueError("rtb-data's ViperX model has no material")
    material.clear()
    material.set("name", "interbotix_black")
    ET.SubElement(material, "color", rgba=_numbers((*ARM_COLOR, 1.0)))


def _numbers(values: tuple[float, ...]) -> str:
    return " ".join(map(str, values))
