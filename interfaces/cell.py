"""The cell: what its robot is told (`KnownCell`) and what only the world knows (`HiddenWorld`).

Read from a YAML file under `scenarios/cells/`. SI units; world frame on the plane of the two arm bases, midway between
them, x forward to the panels, y left, z up.
"""

from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator, BaseModel, ConfigDict, Field
from scipy.spatial.transform import RigidTransform, Rotation

from regrasp.interfaces.frame import Intrinsics

# Numbers beyond these bounds are slips of the pen, and arithmetic overflows on some of them.
Number = Annotated[float, Field(allow_inf_nan=False, strict=False)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Length = Annotated[float, Field(ge=1e-4, le=10)]  # metres
Force = Annotated[float, Field(ge=1e-3, le=1e4)]  # newtons
Near = Annotated[float, Field(ge=-0.3, le=0.3)]  # metres
Mass = Annotated[float, Field(ge=1e-5, le=100)]  # kilograms, or kilograms a metre
Friction = Annotated[float, Field(ge=1e-3, le=10)]
Seconds = Annotated[float, Field(ge=0, le=10)]
Deviation = Annotated[float, Field(ge=0, le=1)]  # metres
JointAngle = Annotated[float, Field(ge=-7, le=7)]  # radians
Degrees = Annotated[float, Field(ge=-360, le=360)]
Angle = Annotated[float, Field(ge=0, le=180)]  # degrees
Coordinate = Annotated[float, Field(ge=-5, le=5, allow_inf_nan=False)]
Vector = tuple[Coordinate, Coordinate, Coordinate]
Size = tuple[Length, Length, Length]
Fraction = Annotated[float, Field(ge=0, le=1)]
Color = tuple[Fraction, Fraction, Fraction]


def _not_zero(v: Vector) -> Vector:
    if float(np.linalg.norm(v)) < 1e-6:
        raise ValueError("a direction must not be zero")
    return v


Direction = Annotated[Vector, AfterValidator(_not_zero)]


class Model(BaseModel):
    """Base of all file models: unknown keys are errors, values do not change."""

    model_config = ConfigDict(extra="forbid", frozen=True)


def pose_along(position: Vector, axis: Vector) -> RigidTransform:
    """The frame at `position` whose x axis points along `axis` and whose z axis is as close to up as can be."""
    x = np.asarray(axis, float) / np.linalg.norm(axis)
    up = np.array([0.0, 0.0, 1.0]) if abs(x[2]) < 0.99 else np.array([1.0, 0.0, 0.0])
    y = np.cross(up, x)
    y /= np.linalg.norm(y)
    return RigidTransform.from_components(position, Rotation.from_matrix(np.column_stack([x, y, np.cross(x, y)])))


class Box(Model):
    """An axis-aligned box that does not move: centre and full edge lengths."""

    name: str
    center: Vector
    size: Size
    color: Color = (0.6, 0.6, 0.6)


class Socket(Model):
    """A socket: a block with its mouth in the middle of its face opposite to `axis`, along which a plug goes in."""

    name: str
    center: Vector
    size: Size  # metres, (across, along the plug axis, high)
    axis: Direction
    depth: Length  # how far the plug sits in
    pull_out_force: Force  # newtons
    color: Color = (0.1, 0.3, 0.8)

    def world_from_plug(self, connector_length: float) -> RigidTransform:
        """Pose of a plugged connector: origin at its centre, x from cable to tip."""
        axis = np.asarray(self.axis, float) / np.linalg.norm(self.axis)
        centre = np.asarray(self.center) - axis * (0.5 * self.size[1] + 0.5 * connector_length - self.depth)
        return pose_along((float(centre[0]), float(centre[1]), float(centre[2])), self.axis)

    @property
    def world_from_block(self) -> Rotation:
        """Rotation of the block: its x edge is level, its y edge lies on the plug axis and points towards +y."""
        along = np.asarray(self.axis, float) / np.linalg.norm(self.axis)
        if along[1] < 0:
            along = -along  # the same block
        level = float(np.hypot(along[0], along[1]))
        across = np.array([along[1], -along[0], 0.0]) / level if level > 0 else np.array([1.0, 0.0, 0.0])
        return Rotation.from_matrix(np.column_stack([across, along, np.cross(across, along)]))

    def upright_box(self) -> Box:
        """The smallest box along the world's axes that holds the block."""
        size = (np.abs(self.world_from_block.as_matrix()) * self.size).sum(axis=1)
        # Not checked again: the bounds are for what a file says, and a turned block of the largest size needs more.
        return Box.model_construct(name=self.name, center=self.center, size=tuple(size.tolist()), color=self.color)


PLUGGED_INTO = "plugged_into"  # in place of a socket's name: the one that the cell names under this key

TAG_DICTIONARY = "DICT_4X4_50"  # of cv2.aruco; choice: the fewest cells, so the largest ones on a small plate


class Tag(Model):
    """An ArUco tag of `TAG_DICTIONARY` in the middle of a square white plate, fixed on a body.

    In the body's frame it faces +y, and its own x points along x. A printed film of a fraction of a gram that gives way
    to a hand: it is seen and weighs and stops nothing.
    """

    number: Annotated[int, Field(ge=0, le=49)]
    size: Length  # edge of the black square
    plate: Length  # edge of the plate, with the white border that the tag needs
    center: Vector  # of its face, in the body's frame

    @property
    def body_from_tag(self) -> RigidTransform:
        """Pose of the tag (x to its right, y to its top, z towards who looks at it) in the body's frame."""
        return RigidTransform.from_components(self.center, Rotation.from_matrix([[1, 0, 0], [0, 0, 1], [0, -1, 0]]))


class Clip(Model):
    """A snap-in clip that takes the connector's tip half: seat pose of the connector in it, and what it does."""

    seat: Vector  # the connector's centre when stowed
    axis: Direction  # the connector's x axis when stowed
    capture_distance: Length
    capture_angle_deg: Annotated[float, Field(ge=0.1, le=180)]
    hold_force: Force
    bracket: tuple[Box, ...]
    tag: Tag | None = None  # in the seat's frame

    @property
    def world_from_seat(self) -> RigidTransform:
        """Pose of the stowed connector."""
        return pose_along(self.seat, self.axis)


class Connector(Model):
    """The cable's loose end: a cylinder; its frame is at its centre, x from cable to tip."""

    length: Length
    radius: Length
    color: Color
    tag: Tag | None = None


class ArmSpec(Model):
    """A ViperX 300 S on the world plane."""

    name: Literal["left", "right"]
    base: Vector
    sleep: tuple[JointAngle, JointAngle, JointAngle, JointAngle, JointAngle, JointAngle]


class FixedMount(Model):
    """A camera that stands still: it looks along +x, turned left by `yaw_deg` and down by `pitch_down_deg`."""

    position: Vector
    pitch_down_deg: Degrees
    yaw_deg: Degrees = 0.0

    @property
    def world_from_camera(self) -> RigidTransform:
        """Pose of the optical frame (x right, y down, z forward)."""
        turn = Rotation.from_euler("ZY", [self.yaw_deg, self.pitch_down_deg], degrees=True)
        return RigidTransform.from_components(self.position, turn * OPTICAL)


class WristMount(Model):
    """A camera on an arm's wrist link (before the last joint), looking along the link's x axis."""

    arm: Literal["left", "right"]
    offset: tuple[Near, Near, Near]  # metres, in the wrist link's frame

    @property
    def wrist_from_camera(self) -> RigidTransform:
        """Pose of the optical frame in the wrist link."""
        return RigidTransform.from_components(self.offset, OPTICAL)


# An optical frame (x right, y down, z forward) in a body frame (x forward, y left, z up).
OPTICAL = Rotation.from_matrix([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])


class CameraSpec(Model):
    """An RGB-D camera as its data sheet gives it."""

    name: Literal["rear", "wrist"]
    width: Annotated[int, Field(ge=16, le=4096)]
    height: Annotated[int, Field(ge=16, le=4096)]
    rate: Annotated[int, Field(ge=1, le=120)]  # frames a second
    horizontal_fov_deg: Annotated[float, Field(gt=1, lt=170)]  # of the colour image, to which depth is aligned
    depth_fov_deg: Annotated[float, Field(gt=1, lt=170)]  # of the depth imager, which sets its noise
    baseline: Length
    mount: FixedMount | WristMount

    @property
    def intrinsics(self) -> Intrinsics:
        """The colour image's pinhole model."""
        return Intrinsics.from_fov(self.width, self.height, float(np.deg2rad(self.horizontal_fov_deg)))


class Latencies(Model):
    """Seconds charged on the simulated clock."""

    image: Seconds  # exposure to estimate
    plan: Seconds


class KnownCell(Model):
    """What the robot's software is told about the cell."""

    boxes: tuple[Box, ...]  # floor, panels
    sockets: tuple[Socket, ...]
    plugged_into: str  # the socket that holds the connector at the start
    clip: Clip
    connector: Connector
    cable_length: Length  # metres of the flexible part
    arms: tuple[ArmSpec, ...]
    cameras: tuple[CameraSpec, ...]
    latencies: Latencies

    def solids(self) -> list[Box]:
        """All that stands fast and is known: floor, panels, clip bracket, and the sockets' blocks in upright boxes."""
        return [*self.boxes, *self.clip.bracket, *(socket.upright_box() for socket in self.sockets)]

    @property
    def cable_anchor(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Where the cable leaves its other end's socket, the last one's mouth, (3,) m, and its direction there."""
        socket = self.sockets[-1]
        axis = np.asarray(socket.axis) / np.linalg.norm(socket.axis)
        return np.asarray(socket.center) - 0.5 * socket.size[1] * axis, -axis

    def socket(self, name: str) -> Socket:
        """The socket of that name; `PLUGGED_INTO` is the one that holds the connector at the start.

        Raises:
            KeyError: there is none; the message lists those that exist.
        """
        name = self.plugged_into if name == PLUGGED_INTO else name
        for socket in self.sockets:
            if socket.name == name:
                return socket
        raise KeyError(f"no socket {name!r}; there are {', '.join(s.name for s in self.sockets)}")

    def arm(self, name: str) -> ArmSpec:
        """The arm of that name."""
        return next(a for a in self.arms if a.name == name)

    def camera(self, name: str) -> CameraSpec:
        """The camera of that name."""
        return next(c for c in self.cameras if c.name == name)


class Stiffness(Model):
    """Bending stiffness EI in N m2 for each gravity: the cable is stiffened for tests on Earth, as in the thesis."""

    zero: Annotated[float, Field(ge=1e-4, le=10)]
    earth: Annotated[float, Field(ge=1e-4, le=10)]


class Cable(Model):
    """The flexible part of the cable, clamped at `anchor`, at rest straight along `anchor_axis`."""

    length: Length
    radius: Annotated[float, Field(ge=1e-4, le=0.03)]
    mass_per_length: Mass  # kg/m
    links: Annotated[int, Field(ge=4, le=30)]  # PyBullet reads at most 31 spherical joints
    stiffness: Stiffness
    damping_ratio: Annotated[float, Field(ge=0, le=10)]
    anchor: Vector
    anchor_axis: Direction
    color: Color


class Errors(Model):
    """How wrong the cell is; one draw a seed unless said otherwise."""

    camera_position: Deviation  # standard deviation, each axis
    camera_angle_deg: Angle
    depth_scale: Annotated[float, Field(ge=0, le=0.5)]
    arm_tool: Deviation  # size of the tool's position error that the joint offsets make
    finger_noise: Deviation  # standard deviation of every reading
    finger_backlash: Deviation
    finger_resolution: Annotated[float, Field(ge=1e-9, le=0.1)]  # metres
    finger_rate: Annotated[int, Field(ge=1, le=480)]
    depth_subpixel: Annotated[float, Field(ge=0, le=10)]  # disparity noise in pixels
    depth_fixed_share: Fraction  # share of the depth noise's variance that stays while the scene is still


class Light(Model):
    """One far light with shadow, and ambient light."""

    direction: Direction  # from the scene to the light
    ambient: Fraction
    diffuse: Fraction
    direction_jitter_deg: Angle
    brightness_jitter: Fraction  # standard deviation of the factor on ambient and diffuse, one draw a seed


class GripperSpec(Model):
    """The jaw: pads on the fingers, and how hard it presses."""

    pad_thickness: Annotated[float, Field(ge=1e-4, le=0.02)]
    max_force: Force  # newtons a finger
    speed: Annotated[float, Field(ge=1e-3, le=10)]  # m/s a finger
    friction: Friction


class HiddenWorld(Model):
    """What only the world knows."""

    step_rate: Annotated[int, Field(ge=240, le=4800, multiple_of=240)]  # physics steps a second
    solver_iterations: Annotated[int, Field(ge=10, le=500)]
    cable: Cable
    connector_mass: Mass
    connector_friction: Friction
    gripper: GripperSpec
    errors: Errors
    light: Light


class Cell(Model):
    """A cell file."""

    known: KnownCell
    hidden: HiddenWorld
