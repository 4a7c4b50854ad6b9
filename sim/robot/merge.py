"""Links that are fixed to one another as one link of a URDF: each costs PyBullet's step 5 us."""

import xml.etree.ElementTree as ET
from collections.abc import Collection

import numpy as np

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.robot import urdf


def merge_fixed_links(root: ET.Element, keep: Collection[str]) -> None:
    """Merge each link that a fixed joint joins to its parent into that parent, but for the links `keep`.

    The parent takes its shapes, its mass and its moment of inertia, and the joints of what hangs on it. Every link must
    have an `inertial`.
    """
    links = {str(link.get("name")): link for link in root.findall("link")}
    for joint in root.findall("joint"):
        child = _name(joint, "child")
        if joint.get("type") != "fixed" or child in keep:
            continue
        parent, parent_from_child = _name(joint, "parent"), _origin(joint)
        _add_mass(links[parent], links[child], parent_from_child)
        for shape in (*links[child].findall("visual"), *links[child].findall("collision")):
            _set_origin(shape, parent_from_child @ _origin(shape))
            links[parent].append(shape)
        for other in root.findall("joint"):
            if _name(other, "parent") == child:
                _part(other, "parent").set("link", parent)
                _set_origin(other, parent_from_child @ _origin(other))
        root.remove(joint)
        root.remove(links[child])


def _add_mass(link: ET.Element, other: ET.Element, link_from_other: FloatArray) -> None:
    """Add the mass and the moment of inertia of another link, fixed at a pose (4, 4), to those of a link.

    Both about the common centre of mass, by the parallel axis theorem.
    """
    parts = _mass(link, np.eye(4)), _mass(other, link_from_other)
    mass = parts[0][0] + parts[1][0]
    center = (parts[0][0] * parts[0][1] + parts[1][0] * parts[1][1]) / mass if mass > 0.0 else parts[0][1]
    about = np.zeros((3, 3))
    for m, c, inertia in parts:
        off = c - center
        about += inertia + m * (off @ off * np.eye(3) - np.outer(off, off))
    inertial = _part(link, "inertial")
    inertial.clear()
    ET.SubElement(inertial, "origin", xyz=urdf.numbers(tuple(center.tolist())), rpy="0 0 0")
    ET.SubElement(inertial, "mass", value=repr(mass))
    entries = {f"i{'xyz'[i]}{'xyz'[j]}": repr(float(about[i, j])) for i in range(3) for j in range(i, 3)}
    ET.SubElement(inertial, "inertia", entries)


def _mass(link: ET.Element, pose: FloatArray) -> tuple[float, FloatArray, FloatArray]:
    """Mass (kg), centre (3,) m and moment of inertia (3, 3) kg m2 about it of a link at a pose (4, 4)."""
    inertial = _part(link, "inertial")
    at, entries = pose @ _origin(inertial), _part(inertial, "inertia")
    own = np.zeros((3, 3))
    for i in range(3):
        for j in range(i, 3):
            own[i, j] = own[j, i] = float(entries.get(f"i{'xyz'[i]}{'xyz'[j]}", "0"))
    return float(_part(inertial, "mass").get("value", "0")), at[:3, 3], at[:3, :3] @ own @ at[:3, :3].T


def _part(element: ET.Element, tag: str) -> ET.Element:
    found = element.find(tag)
    assert found is not None, f"{element.get('name')} has no {tag}"
    return found


def _name(joint: ET.Element, tag: str) -> str:
    return str(_part(joint, tag).get("link"))


def _origin(element: ET.Element) -> FloatArray:
    """The pose (4, 4) of an element that may have an `origin`."""
    origin = element.find("origin")
    if origin is None:
        return np.eye(4)
    x, y, z = map(float, origin.get("xyz", "0 0 0").split())
    roll, pitch, yaw = map(float, origin.get("rpy", "0 0 0").split())
    return urdf.pose_of((x, y, z), (roll, pitch, yaw))


def _set_origin(element: ET.Element, pose: FloatArray) -> None:
    origin = element.find("origin")
    if origin is None:
        origin = ET.Element("origin")
        element.insert(0, origin)
    origin.set("xyz", urdf.numbers(tuple(pose[:3, 3].tolist())))
    origin.set("rpy", urdf.numbers(urdf.rpy_of(pose[:3, :3])))
