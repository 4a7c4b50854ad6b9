"""URDF files: read from URDF or xacro, put together, and the frames of their links.

https://wiki.ros.org/urdf/XML
"""

import re
import xml.etree.ElementTree as ET
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.quote import quoted
from regrasp.interfaces.robot.parts import Placed, Source
from regrasp.interfaces.robot.urdf_validation import problem_of

_DIRECTION = 1e-9  # an entry of a rotation that is nearer to -1, 0 or 1 is that: URDFs write 1.5707963 for pi / 2
DECIMALS = 12  # of lengths in m: far below what any arm can do, so that sums of decimals come out as decimals


class RobotError(ValueError):
    """What a robot file says cannot be; `path` is where it says so."""

    def __init__(self, path: tuple[str | int, ...], message: str) -> None:
        super().__init__(message)
        self.path = path


@dataclass(frozen=True, eq=False)
class UrdfJoint:
    """A joint of a URDF. `parent_from_child` (4, 4) holds at zero; `axis` (3,) is a unit vector in the child."""

    name: str
    kind: str
    parent: str
    child: str
    parent_from_child: FloatArray
    axis: FloatArray
    limits: Mapping[str, float]  # lower, upper, velocity, effort, as far as they are given
    mimic: tuple[str, float, float] | None  # joint, multiplier and offset

    def moved(self, value: float) -> FloatArray:
        """parent_from_child (4, 4) with the joint at `value` rad or m."""
        if self.kind == "fixed" or value == 0.0:  # most of the joints of a gripper
            return self.parent_from_child.copy()
        motion = np.eye(4)
        if self.kind == "prismatic":
            motion[:3, 3] = value * self.axis
        else:
            motion[:3, :3] = rotation_about(self.axis, value)
        return np.asarray(self.parent_from_child @ motion)


class UrdfTree:
    """The links and joints of a URDF."""

    def __init__(self, root: ET.Element) -> None:
        self.links = [str(link.get("name")) for link in root.findall("link")]
        self.joints = {joint.name: joint for joint in map(_joint, root.findall("joint"))}
        self._above = {joint.child: joint for joint in self.joints.values()}

    @property
    def roots(self) -> list[str]:
        """The links that no joint carries."""
        return [link for link in self.links if link not in self._above]

    def way_to(self, link: str) -> list[UrdfJoint]:
        """The joints from the root to a link, the root's first. Raises KeyError if there is no such link."""
        if link not in self.links:
            raise KeyError(link)
        way = []
        while link in self._above:
            way.append(self._above[link])
            link = way[-1].parent
        return way[::-1]

    def frame(self, link: str, positions: Mapping[str, float] | None = None) -> FloatArray:
        """root_from_link (4, 4) with the joints at these positions, 0 where none is given."""
        pose = np.eye(4)
        for joint in self.way_to(link):
            pose = pose @ joint.moved((positions or {}).get(joint.name, 0.0))
        return pose


def read_urdf(source: Source, folder: Path) -> ET.Element:
    """The root element of a source, whose mesh files are absolute paths. `folder` holds the robot file.

    Raises RobotError: there is no such package or file, or it is no URDF.
    """
    return ET.fromstring(_text(source.model_dump_json(), folder))


@cache
def _text(source_json: str, folder: Path) -> str:
    source = Source.model_validate_json(source_json)
    base = folder if source.package is None else _package(source.package)
    path = base / source.path
    if not path.is_file():
        where = f"the package {source.package}" if source.package else "the robot file's folder"
        raise RobotError(("path",), f"{where} has no file {quoted(source.path)}; write its path from there")
    try:
        root = ET.fromstring(_bound(_expanded(path, source.arguments)))
    except ET.ParseError as error:
        message = f"{path}:{error.position[0]}: no XML: {error}; mend it there, or name a URDF file"
        raise RobotError(("path",), message) from None
    if problem := problem_of(root):
        raise RobotError(("path",), f"{path}: {problem}")
    for mesh in root.iter("mesh"):
        mesh.set("filename", str(_mesh_file(mesh.get("filename", ""), path, base, source)))
    return ET.tostring(root, encoding="unicode")


def _package(name: str) -> Path:
    """The folder of an installed package, found without running it: any module may be named."""
    first, *inside = name.split(".")
    try:
        spec = find_spec(first) if name.isascii() and all(map(str.isidentifier, (first, *inside))) else None
    except ValueError:  # such as __main__, which has none
        spec = None
    if spec is None:
        message = f"no package {quoted(name)} is installed; pip install it, or name another"
        raise RobotError(("package",), message)
    folders = [Path(place, *inside) for place in spec.submodule_search_locations or ()]
    found = next((folder for folder in folders if folder.is_dir()), None)
    if found is None:
        raise RobotError(("package",), f"{quoted(name)} is no package with files; name one that has the URDF")
    return found


def _expanded(path: Path, arguments: Mapping[str, str]) -> str:
    if path.suffix != ".xacro":
        try:
            return path.read_text(encoding="utf-8-sig")
        except UnicodeDecodeError:
            raise RobotError(("path",), f"{path} is no text; name a URDF file") from None
    import xacro

    try:
        return str(xacro.process_file(str(path), mappings=dict(arguments)).toxml())
    except Exception as error:  # whatever xacro raises for a file or an argument that it does not like
        raise RobotError(("path",), f"xacro cannot read {path}: {error}") from None


def _bound(text: str) -> str:
    """The text without the prefixes that it declares nowhere, such as `drake:`; XML parsers refuse them."""
    declared = {*re.findall(r"xmlns:([\w.-]+)\s*=", text), "xml", "xmlns"}
    used = set(re.findall(r"<([\w.-]+):", text)) | set(re.findall(r"\s([\w.-]+):[\w.-]+\s*=\s*[\"']", text))
    for prefix in used - declared:
        text = re.sub(rf"(</?|\s){re.escape(prefix)}:", rf"\g<1>{prefix}_", text)
    return text


def _mesh_file(name: str, urdf: Path, base: Path, source: Source) -> Path:
    if not name.startswith("package://"):
        return urdf.parent / name.removeprefix("file://")
    package, _, rest = name.removeprefix("package://").partition("/")
    if package not in source.ros_packages:
        message = f"the URDF's meshes are in the ROS package {package}, which ros_packages does not place"
        folder = _ros_folder(package, rest, urdf, base)
        inside = f"the package {source.package}" if source.package else "the robot file's folder"
        right = f"{{{package}: {folder}}}" if folder else f"{{{package}: FOLDER}}, with its path in {inside}"
        raise RobotError(("ros_packages",), f"{message}; write ros_packages: {right}")
    return base / source.ros_packages[package] / rest


def _ros_folder(package: str, rest: str, urdf: Path, base: Path) -> str | None:
    """The path from `base` of the folder of this name beside or above the URDF that has the file `rest`, if any has."""
    for above in urdf.parents:
        if not above.is_relative_to(base):
            break
        for folder in (above / package, *([above] if above.name == package else [])):
            if (folder / rest).is_file():
                return folder.relative_to(base).as_posix()
    return None


def prefixed(root: ET.Element, prefix: str) -> ET.Element:
    """The same tree with a prefix before the names of all links and joints."""
    for element in root.iter():
        if element.tag in ("link", "joint") and element.get("name"):
            element.set("name", prefix + str(element.get("name")))
        for key in ("link", "joint"):
            if element.tag in ("parent", "child", "mimic") and element.get(key):
                element.set(key, prefix + str(element.get(key)))
    return root


def attach(root: ET.Element, part: ET.Element, at: Placed, name: str) -> None:
    """Fix the root link of `part` to a link of `root` by a joint of that name."""
    first = UrdfTree(part).roots[0]
    root.extend(element for element in part if element.tag in ("link", "joint", "material"))
    add_joint(root, name, "fixed", at.link, first, at.xyz, at.rpy)


def add_joint(
    root: ET.Element,
    name: str,
    kind: str,
    parent: str,
    child: str,
    xyz: tuple[float, ...] = (0.0, 0.0, 0.0),
    rpy: tuple[float, ...] = (0.0, 0.0, 0.0),
) -> ET.Element:
    """Add a joint; returns it."""
    joint = ET.SubElement(root, "joint", name=name, type=kind)
    ET.SubElement(joint, "parent", link=parent)
    ET.SubElement(joint, "child", link=child)
    ET.SubElement(joint, "origin", xyz=numbers(xyz), rpy=numbers(rpy))
    return joint


def add_box(
    link: ET.Element, tags: tuple[str, ...], size: tuple[float, ...], xyz: tuple[float, ...] = (0.0, 0.0, 0.0)
) -> list[ET.Element]:
    """Add a box to a link as `visual` or `collision` or both; returns the elements."""
    made = []
    for tag in tags:
        made.append(ET.SubElement(link, tag))
        ET.SubElement(made[-1], "origin", xyz=numbers(xyz), rpy="0 0 0")
        ET.SubElement(ET.SubElement(made[-1], "geometry"), "box", size=numbers(size))
    return made


def add_inertia(link: ET.Element, mass: float, inertia: float) -> None:
    """Add a mass (kg) at a link's origin, and the same moment of inertia (kg m2) about all axes."""
    inertial = ET.SubElement(link, "inertial")
    ET.SubElement(inertial, "mass", value=repr(mass))
    one = repr(inertia)
    ET.SubElement(inertial, "inertia", ixx=one, iyy=one, izz=one, ixy="0", ixz="0", iyz="0")


def numbers(values: tuple[float, ...]) -> str:
    """Numbers as URDF writes them."""
    return " ".join(map(str, values))


def mesh_files(root: ET.Element) -> Iterator[tuple[str, Path]]:
    """The link's name and the file of every mesh."""
    for link in root.findall("link"):
        for mesh in link.iter("mesh"):
            yield str(link.get("name")), Path(str(mesh.get("filename")))


def rotation_about(axis: FloatArray, angle: float) -> FloatArray:
    """The rotation matrix (3, 3) by `angle` rad about a unit axis (3,), by Rodrigues' formula."""
    from regrasp.interfaces.geometry import rotation_about as rodrigues

    return rodrigues(axis, angle)


def pose_of(xyz: tuple[float, ...], rpy: tuple[float, ...]) -> FloatArray:
    """The pose (4, 4) of a URDF origin: roll about x, then pitch about y, then yaw about z, all fixed axes."""
    (cr, cp, cy), (sr, sp, sy) = np.cos(rpy), np.sin(rpy)
    pose = np.eye(4)
    pose[:3, :3] = [
        [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
        [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
        [-sp, cp * sr, cp * cr],
    ]
    pose[:3, :3] = snapped(pose[:3, :3])
    pose[:3, 3] = xyz
    return pose


def rpy_of(rotation: FloatArray) -> tuple[float, float, float]:
    """The roll, pitch and yaw of a rotation (3, 3), as `pose_of` takes them; yaw is 0 where roll can stand for it."""
    across = float(np.hypot(rotation[0, 0], rotation[1, 0]))
    pitch = np.arctan2(-rotation[2, 0], across)
    if across < _DIRECTION:
        return float(np.arctan2(-rotation[1, 2], rotation[1, 1])) + 0.0, float(pitch), 0.0
    roll, yaw = np.arctan2(rotation[2, 1], rotation[2, 2]), np.arctan2(rotation[1, 0], rotation[0, 0])
    return float(roll) + 0.0, float(pitch) + 0.0, float(yaw) + 0.0


def snapped(rotation: FloatArray) -> FloatArray:
    """The rotation (3, 3), or rows of one, with entries that are nearly -1, 0 or 1 exactly so."""
    whole = np.rint(rotation)
    return np.asarray(np.where(np.abs(rotation - whole) < _DIRECTION, whole + 0.0, rotation))


def _joint(element: ET.Element) -> UrdfJoint:
    def read(tag: str, key: str, default: str) -> tuple[float, ...]:
        found = element.find(tag)
        return tuple(map(float, (default if found is None else found.get(key, default)).split()))

    def name_of(tag: str, key: str) -> Any:
        found = element.find(tag)
        return None if found is None else found.get(key)

    axis = np.array(read("axis", "xyz", "1 0 0"))
    limit, mimic = element.find("limit"), element.find("mimic")
    keys = ("lower", "upper", "velocity", "effort")
    return UrdfJoint(
        name=str(element.get("name")),
        kind=str(element.get("type")),
        parent=str(name_of("parent", "link")),
        child=str(name_of("child", "link")),
        parent_from_child=pose_of(read("origin", "xyz", "0 0 0"), read("origin", "rpy", "0 0 0")),
        axis=axis / max(float(np.linalg.norm(axis)), 1e-12),
        limits={} if limit is None else {key: float(str(limit.get(key))) for key in keys if limit.get(key)},
        mimic=None
        if mimic is None
        else (str(mimic.get("joint")), float(mimic.get("multiplier", "1")), float(mimic.get("offset", "0"))),
    )
