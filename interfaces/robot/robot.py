"""A robot: what its file says, and the kinematic chain, limits and body that follow from its URDF."""

import xml.etree.ElementTree as ET
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import zip_longest
from pathlib import Path
from typing import Annotated, Any, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field
from pydantic.json_schema import SkipJsonSchema

from regrasp.interfaces.arrays import FloatArray, Mask
from regrasp.interfaces.fields import Color, JointAngle, Model
from regrasp.interfaces.quote import nearest, quoted
from regrasp.interfaces.robot import urdf
from regrasp.interfaces.robot.chain import Chain
from regrasp.interfaces.robot.inertia import LinkInertias, link_inertias
from regrasp.interfaces.robot.linkage import Linkage
from regrasp.interfaces.robot.parallel_jaw import ParallelJaw
from regrasp.interfaces.robot.parts import (
    Attached,
    Calibration,
    Cover,
    Footprint,
    Gripper,
    Joint,
    LinkageGripper,
    LinkName,
    ParallelGripper,
    Placed,
    Rail,
    Source,
    Sphere,
)
from regrasp.interfaces.robot.urdf import DECIMALS, RobotError, UrdfJoint, UrdfTree, snapped
from regrasp.interfaces.robot.urdf_validation import DRIVEN

BEAM, CARRIAGE = "rail_beam", "rail_carriage"  # links of a rail
_CARRIAGE_MASS, _CARRIAGE_INERTIA = 10.0, 0.1  # kg, kg m2; choice: a drive as strong as a rail's moves it anyhow
# kg and kg m2 of links without inertia: frames, to which PyBullet would give 1 kg and 1 kg m2
_FRAME_MASS, _FRAME_INERTIA = 1e-3, 1e-6


class Robot(Model):
    """Contents of a robot file. `folder` is where it lies; the reader sets it."""

    title: str
    urdf: Source
    base_link: LinkName
    joints: Annotated[tuple[Joint, ...], Field(min_length=1, max_length=12)]
    tool: Placed  # x along the fingers, y the direction in which they close
    mount: Placed | None = None  # where a camera is fixed: x is where it looks, z its up
    gripper: Gripper
    attached: Attached | None = None
    rail: Rail | None = None
    sleep: tuple[JointAngle, ...]
    calibration: Calibration
    footprint: Footprint
    # By link, in its frame. Only a file to which spheres are yet to be fitted has none; no cell takes it.
    spheres: dict[LinkName, tuple[Sphere, ...]] = Field(default_factory=dict)
    # Pairs of links that can meet; links not named together are kept apart by the joints' limits.
    self_collision: tuple[tuple[LinkName, LinkName], ...] = ()
    cover: Cover = Cover()
    still: tuple[LinkName, ...] = ()  # links that turn on the spot, which nothing around can meet
    # Links that touch nothing in the world: PyBullet takes their hulls, which fill what is open between the fingers.
    untouchable: tuple[LinkName, ...] = ()
    paint: Color | None = None  # in place of the URDF's colours and textures
    draw: Literal["visual", "collision"] = "visual"  # which of the URDF's meshes are drawn
    folder: SkipJsonSchema[str] = ""  # no key for a person to write

    def element(self) -> ET.Element:
        """The whole URDF: arm, gripper and rail; mesh files are absolute paths. A new tree each time.

        Raises RobotError: a source cannot be read, or the parts do not fit together.
        """
        root = _at("urdf", self.urdf, self.folder)
        if self.attached is not None:
            _attach(root, self.attached, self.folder)
        if self.rail is not None:
            _add_rail(root, self.rail, self.base_link)
        for link in root.findall("link"):
            if link.find("inertial") is None:
                urdf.add_inertia(link, _FRAME_MASS, _FRAME_INERTIA)
        return root

    @cached_property
    def tree(self) -> UrdfTree:
        """Links and joints of `element`."""
        return UrdfTree(self.element())

    @property
    def joint_names(self) -> tuple[str, ...]:
        """The names of all driven joints, the rail's first."""
        return (*([self.rail.name] if self.rail else []), *(joint.name for joint in self.joints))

    @property
    def urdf_joints(self) -> tuple[str, ...]:
        """Their names in the URDF."""
        return (*([self.rail.name] if self.rail else []), *(joint.in_urdf for joint in self.joints))

    @property
    def root(self) -> str:
        """The link that stands still."""
        return self.base_link if self.rail is None else BEAM

    @cached_property
    def signs(self) -> FloatArray:
        """1 or -1 (n,): what turns our joint positions into those of the URDF."""
        return np.array([*([1.0] if self.rail else []), *(float(joint.sign) for joint in self.joints)])

    @cached_property
    def asleep(self) -> FloatArray:
        """The sleep pose (n,)."""
        return np.array(self.sleep, float)

    @cached_property
    def chain(self) -> Chain:
        """The joints from the base to the tool.

        Raises RobotError: the tool's link or a joint is not in the URDF, or the URDF has other joints on the way.
        """
        joints = self._joints_to_tool()
        zero = np.array([self._root_frame() @ self.tree.frame(joint.child) for joint in joints])
        steps = np.diff(zero[:, :3, 3], axis=0, prepend=np.zeros((1, 3)))
        origins: FloatArray = np.asarray(np.round(steps, DECIMALS) + 0.0, float)
        axes = np.array([pose[:3, :3] @ joint.axis for pose, joint in zip(zero, joints, strict=True)])
        slides = np.array([joint.kind == "prismatic" for joint in joints])
        last_from_tool = self._in_body(self.tool, "tool")[1]
        lower, upper, speeds, accelerations, torques = self._limits(joints)
        return Chain(
            names=self.joint_names,
            origins=origins,
            axes=_unit(axes * self.signs[:, None]),
            slides=slides,
            lower=lower,
            upper=upper,
            speeds=speeds,
            accelerations=accelerations,
            torques=torques,
            levers=self._given_levers(_levers(origins, last_from_tool, slides)),
            last_from_tool=last_from_tool,
        )

    @cached_property
    def inertias(self) -> LinkInertias:
        """What the chain's links weigh, with the jaw half open."""
        jaw = self.gripper_positions(0.5 * self.gripper.opening)
        return link_inertias(self.element(), len(self.chain) + 1, lambda link: self._placed(link, np.eye(4), jaw))

    @cached_property
    def mounted(self) -> tuple[int, FloatArray]:
        """The chain's link that carries a camera, and link_from_mount (4, 4). Raises RobotError without a mount."""
        return self._in_body(self.camera_mount, "mount")

    @property
    def camera_mount(self) -> Placed:
        """`mount`. Raises RobotError if there is none."""
        if self.mount is None:
            raise RobotError(("mount",), f"the robot {self.title} has no mount for a camera; give it one")
        return self.mount

    def model_copy(self, *, update: Mapping[str, Any] | None = None, deep: bool = False) -> Self:
        """A copy in which what follows from the file is worked out anew."""
        made = super().model_copy(update=update, deep=deep)
        for name in made.__dict__.keys() - type(self).model_fields.keys():
            del made.__dict__[name]
        return made

    def __repr__(self) -> str:
        return f"Robot({self.title!r}, {len(self.joint_names)} joints)"

    def __hash__(self) -> int:
        return hash((self.title, self.urdf.path, self.joint_names, self.folder))

    @cached_property
    def body(self) -> "Body":
        """Its spheres in the chain's links."""
        return Body.of(self)

    def link_place(self, link: str, opening: float | None = None) -> tuple[int, FloatArray]:
        """The chain's link that moves a link of the URDF, and chain_link_from_link (4, 4).

        The jaw stands `opening` m open (default: fully). Raises RobotError if the URDF has no such link.
        """
        jaw = self.gripper_positions(self.gripper.opening if opening is None else opening)
        return self._placed(link, np.eye(4), jaw)

    def gripper_positions(self, opening: float) -> dict[str, float]:
        """Positions of the URDF's gripper joints with the pads `opening` m apart."""
        gripper = self.gripper
        if isinstance(gripper, LinkageGripper):
            return self.linkage.positions(opening)
        return self.parallel_jaw.positions(opening)

    def pad_places(self, opening: float) -> FloatArray:
        """The pads' middles (2, 3), m, in the URDF's root with the arm's joints at zero and this opening, m."""
        gripper, positions = self.gripper, self.gripper_positions(opening)
        if isinstance(gripper, LinkageGripper):
            return np.array([self.tree.frame(link, positions)[:3, 3] for link in gripper.pads])
        pads = zip(gripper.pads.links, self.parallel_jaw.pads, strict=True)
        return np.array([(self.tree.frame(link, positions) @ pose)[:3, 3] for link, pose in pads])

    def pads_in_tool(self, opening: float) -> FloatArray:
        """The pads' middles (2, 3), m, in the tool's frame, at this opening, m."""
        tool = self.tree.frame(self.tool.link) @ urdf.pose_of(self.tool.xyz, self.tool.rpy)
        return (self.pad_places(opening) - tool[:3, 3]) @ tool[:3, :3]

    @cached_property
    def parallel_jaw(self) -> ParallelJaw:
        """How the jaw of a parallel gripper opens."""
        assert isinstance(self.gripper, ParallelGripper)
        return ParallelJaw.of(self.tree, self.gripper, self.tool)

    @cached_property
    def linkage(self) -> Linkage:
        """How the jaw of a linkage gripper opens."""
        assert isinstance(self.gripper, LinkageGripper)
        return Linkage.of(self.tree, self.gripper)

    def _in_body(self, frame: Placed, key: str) -> tuple[int, FloatArray]:
        try:
            return self._placed(frame.link, urdf.pose_of(frame.xyz, frame.rpy), {})
        except RobotError as error:
            raise RobotError((key, "link"), str(error)) from None

    def _placed(self, link: str, link_from_frame: FloatArray, jaw: Mapping[str, float]) -> tuple[int, FloatArray]:
        try:
            way = self.tree.way_to(link)
        except KeyError:
            raise RobotError((), f"the URDF has no link {quoted(link)}; {nearest(link, self.tree.links)}") from None
        driven, pose, index, origin = set(self.urdf_joints), self._root_frame(), 0, np.zeros(3)
        for joint in way:
            pose = pose @ joint.moved(jaw.get(joint.name, 0.0))
            if joint.name in driven:
                index, origin = self.urdf_joints.index(joint.name) + 1, pose[:3, 3].copy()
        pose = pose @ link_from_frame
        pose[:3, :3] = snapped(pose[:3, :3])
        pose[:3, 3] = np.round(pose[:3, 3] - origin, DECIMALS) + 0.0
        return index, pose

    def _root_frame(self) -> FloatArray:
        """base_from_root (4, 4) at zero: what lies between the URDF's root and the base does not count."""
        return np.asarray(np.linalg.inv(self.tree.frame(self.base_link)))

    def _joints_to_tool(self) -> list[UrdfJoint]:
        tree = self.tree
        for i, joint in enumerate(self.joints):
            if joint.in_urdf not in tree.joints:
                right = nearest(joint.in_urdf, [name for name, known in tree.joints.items() if known.kind != "fixed"])
                path = ("joints", i, "urdf" if joint.urdf else "name")
                raise RobotError(path, f"the URDF has no joint {quoted(joint.in_urdf)}; {right}")
            if (kind := tree.joints[joint.in_urdf].kind) not in DRIVEN:
                message = f"the URDF's joint {quoted(joint.in_urdf)} is {kind}; driven ones are {', '.join(DRIVEN)}"
                raise RobotError(("joints", i), message)
        for key, link in (("tool", self.tool.link), ("base_link", self.base_link)):
            if link not in tree.links:
                here: tuple[str, ...] = (key, "link") if key == "tool" else (key,)
                raise RobotError(here, f"the URDF has no link {quoted(link)}; {nearest(link, tree.links)}")
        way = [joint for joint in tree.way_to(self.tool.link) if joint.kind != "fixed"]
        self._compare_joints([joint.name for joint in way])
        return way

    def _compare_joints(self, there: list[str]) -> None:
        """Raise RobotError for the first joint that is another than on the URDF's way to the tool."""
        given, on_rail = [*self.urdf_joints], int(self.rail is not None)
        if there == given:
            return
        n = next(i for i, (a, b) in enumerate(zip_longest(there, given)) if a != b)
        path: tuple[str | int, ...] = ("joints", n - on_rail) if n < len(given) else ("joints",)
        if n == len(given):
            wrong = f"{there[n]} is missing at the end"
        elif given[n] not in there:
            wrong = f"{given[n]} does not move the tool"
        elif n == len(there):
            wrong = f"{given[n]} stands twice"
        else:
            wrong = f"{there[n]} {'comes' if there[n] in given else 'is missing'} before {given[n]}"
        in_order = ", ".join(there[on_rail:]) or "none"
        raise RobotError(path, f"{wrong}; the URDF's joints from the base to the tool are {in_order}")

    def _limits(self, joints: list[UrdfJoint]) -> FloatArray:
        """Lower and upper limits, speeds, accelerations and torques (5, n)."""
        rows = [] if self.rail is None else [_rail_limits(self.rail)]
        for i, (joint, known) in enumerate(zip(self.joints, joints[len(rows) :], strict=True)):
            rows.append(_limits(i, joint, known))
        return np.array(rows).T

    def _given_levers(self, levers: FloatArray) -> FloatArray:
        given = [*([None] if self.rail else []), *(joint.lever for joint in self.joints)]
        return np.array([own if own else lever for own, lever in zip(given, levers, strict=True)])


@dataclass(frozen=True, eq=False)
class Body:
    """A robot's spheres: their chain links (n,), and centre and radius (n, 4), m, there, with the jaw fully open.

    `parts` (n,) number the links of the URDF that they are on.
    """

    links: NDArray[np.int64]
    parts: NDArray[np.int64]
    spheres: FloatArray
    fingers: FloatArray  # (n, 3) unit vectors along which spheres move as the jaw opens; 0 for those that do not
    pairs: NDArray[np.int64]  # (m, 2) rows of spheres that can meet
    first_moving: int  # the first chain link that something around can meet
    robot: Robot

    @classmethod
    def of(cls, robot: Robot) -> "Body":
        """Raises RobotError: a link of the spheres or of the pairs is not in the URDF."""
        links: list[int] = []
        spheres, fingers, rows = [], [], {}
        open_jaw, ways = robot.gripper_positions(robot.gripper.opening), _finger_ways(robot)
        for name, group in robot.spheres.items():
            index, pose = _found(robot, name, ("spheres", name), open_jaw)
            rows[name] = range(len(links), len(links) + len(group))
            for x, y, z, radius in group:
                center = np.round(pose[:3, :3] @ (x, y, z) + pose[:3, 3], DECIMALS) + 0.0
                links.append(index)
                spheres.append([*center, radius])
                fingers.append(ways.get(name, np.zeros(3)))
        for n, names in enumerate(robot.self_collision):
            for side, name in enumerate(names):
                if name not in rows:
                    message = f"{quoted(name)} has no spheres; {nearest(name, list(rows))}"
                    raise RobotError(("self_collision", n, side), message)
        pairs = [(i, j) for a, b in robot.self_collision for i in rows[a] for j in rows[b]]
        still = {_found(robot, name, ("still", n), open_jaw)[0] for n, name in enumerate(robot.still)}
        return cls(
            np.array(links, np.int64),
            np.repeat(np.arange(len(rows)), [len(group) for group in rows.values()]),
            np.array(spheres, float).reshape(-1, 4),
            np.array(fingers, float).reshape(-1, 3),
            np.array(pairs, np.int64).reshape(-1, 2),
            max(still | {0}) + 1,  # the first link stands still whatever the file says
            robot,
        )

    def at(self, opening: float) -> FloatArray:
        """`spheres` (n, 4) with the pads `opening` m apart."""
        moved = self.spheres.copy()
        if isinstance(self.robot.gripper, LinkageGripper):
            self._place_linkage(moved, opening)
        else:
            moved[:, :3] -= self.fingers * (0.5 * (self.robot.gripper.opening - opening))
        return moved

    def _place_linkage(self, moved: FloatArray, opening: float) -> None:
        robot, row = self.robot, 0
        jaw, movable = robot.gripper_positions(opening), set(robot.linkage.followers)
        for name, group in robot.spheres.items():
            if movable & {joint.name for joint in robot.tree.way_to(name)}:
                pose = robot._placed(name, np.eye(4), jaw)[1]
                local = np.array(group)[:, :3]
                moved[row : row + len(group), :3] = local @ pose[:3, :3].T + pose[:3, 3]
            row += len(group)


def _found(robot: Robot, link: str, path: tuple[str | int, ...], jaw: Mapping[str, float]) -> tuple[int, FloatArray]:
    try:
        return robot._placed(link, np.eye(4), jaw)
    except RobotError as error:
        raise RobotError(path, str(error)) from None


def _finger_ways(robot: Robot) -> dict[str, FloatArray]:
    """In which direction (3,) of the last chain link each finger's link moves as a parallel jaw opens."""
    if isinstance(robot.gripper, LinkageGripper):
        return {}
    ways, jaw = {}, robot.parallel_jaw
    for link in (link for link in robot.spheres if link in robot.tree.links):
        above = [joint.name for joint in robot.tree.way_to(link)]
        for joint, sign in zip(jaw.joints, jaw.signs, strict=True):
            if joint.name in above:
                ways[link] = sign * (robot.link_place(joint.child)[1][:3, :3] @ joint.axis)
    return ways


def _at(key: str, source: Source, folder: str) -> ET.Element:
    try:
        return urdf.read_urdf(source, Path(folder))
    except RobotError as error:
        inside: tuple[str, ...] = ("urdf",) if key == "urdf" else (key, "urdf")
        raise RobotError((*inside, *error.path), str(error)) from None


def _attach(root: ET.Element, attached: Attached, folder: str) -> None:
    tree, part = UrdfTree(root), urdf.prefixed(_at("attached", attached.urdf, folder), attached.prefix)
    if attached.at.link not in tree.links:
        message = f"the URDF has no link {quoted(attached.at.link)}; {nearest(attached.at.link, tree.links)}"
        raise RobotError(("attached", "at", "link"), message)
    added = UrdfTree(part)
    if both := {*tree.links, *tree.joints} & {*added.links, *added.joints}:
        message = f"{quoted(min(both))} is a name in both URDFs; give the gripper's names another prefix"
        raise RobotError(("attached", "prefix"), message)
    urdf.attach(root, part, attached.at, "gripper_mount")


def _add_rail(root: ET.Element, rail: Rail, base: str) -> None:
    """The beam as the new root, and a carriage on it that carries the base."""
    tree = UrdfTree(root)
    if base not in tree.roots:
        message = f"a rail carries the whole robot; the URDF's first link is {tree.roots[0]}, name that"
        raise RobotError(("base_link",), message)
    if rail.name in tree.joints:
        message = f"the URDF has a joint {quoted(rail.name)}, too; give the rail another name"
        raise RobotError(("rail", "name"), message)
    beam, carriage = (ET.SubElement(root, "link", name=name) for name in (BEAM, CARRIAGE))
    along = "xyz".index(rail.axis)
    size, middle = [rail.beam[0], rail.beam[0], rail.beam[1]], [0.0, 0.0, 0.0]
    size[along] = rail.upper - rail.lower + rail.carriage[along]
    middle[along] = 0.5 * (rail.lower + rail.upper)
    middle[2] = -rail.below - 0.5 * (rail.carriage[2] + rail.beam[1])
    urdf.add_box(beam, ("visual", "collision"), tuple(size), tuple(middle))
    urdf.add_box(carriage, ("visual", "collision"), rail.carriage, (0.0, 0.0, -rail.below))
    urdf.add_inertia(carriage, _CARRIAGE_MASS, _CARRIAGE_INERTIA)
    joint = urdf.add_joint(root, rail.name, "prismatic", BEAM, CARRIAGE)
    ET.SubElement(joint, "axis", xyz=" ".join("1" if axis == along else "0" for axis in range(3)))
    limits = {"lower": rail.lower, "upper": rail.upper, "velocity": rail.speed, "effort": rail.force}
    ET.SubElement(joint, "limit", {key: repr(value) for key, value in limits.items()})
    urdf.add_joint(root, "rail_base", "fixed", CARRIAGE, base)


def _unit(axes: FloatArray) -> FloatArray:
    return np.asarray(snapped(axes / np.linalg.norm(axes, axis=1, keepdims=True)))


def _limits(i: int, joint: Joint, known: UrdfJoint) -> tuple[float, float, float, float, float]:
    given = {"lower": joint.lower, "upper": joint.upper, "velocity": joint.speed, "effort": joint.torque}
    limits = dict(known.limits)
    if joint.sign < 0 and limits.keys() >= {"lower", "upper"}:  # the URDF counts the other way round
        limits |= {"lower": -limits["upper"], "upper": -limits["lower"]}
    values = {key: limits.get(key) if value is None else value for key, value in given.items()}
    words = {"lower": "lower", "upper": "upper", "velocity": "speed", "effort": "torque"}
    for key, value in values.items():
        if value is None:
            message = f"neither the file nor the URDF says {words[key]} of {joint.name}; write {words[key]}: a number"
            raise RobotError(("joints", i), message)
        if key in ("velocity", "effort") and value <= 0:
            message = f"{key} of {joint.in_urdf} is {value:g} in the URDF; write {words[key]}: a number above 0"
            raise RobotError(("joints", i), message)
    lower, upper = float(values["lower"] or 0.0), float(values["upper"] or 0.0)
    if lower >= upper:
        message = f"{joint.name} turns from {lower:g} to {upper:g} by file and URDF; give lower and upper in order"
        raise RobotError(("joints", i, "upper" if joint.lower is None else "lower"), message)
    return lower, upper, float(values["velocity"] or 0.0), joint.acceleration, float(values["effort"] or 0.0)


def _rail_limits(rail: Rail) -> tuple[float, float, float, float, float]:
    return rail.lower, rail.upper, rail.speed, rail.acceleration, rail.force


def _levers(origins: FloatArray, last_from_tool: FloatArray, slides: Mask) -> FloatArray:
    """About how far (n,) m the tool lies from each joint with the arm stretched; 1 for a sliding joint."""
    lengths = np.append(np.linalg.norm(origins[1:], axis=1), np.linalg.norm(last_from_tool[:3, 3]))
    return np.asarray(np.where(slides, 1.0, np.cumsum(lengths[::-1])[::-1]))
