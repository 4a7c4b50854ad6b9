"""The cell: what its robot is told (`KnownCell`) and what only the simulated world knows (`HiddenWorld`).

It is read from a YAML file under `scenarios/cells/`. Units are SI. The world frame lies on the plane of the two arm
bases, midway between them: x points forward to the panels, y left, z up.
"""

from typing import Annotated, Literal

import numpy as np
from pydantic import Field
from scipy.spatial.transform import RigidTransform, Rotation

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.fields import (
    Color,
    Direction,
    Force,
    JointAngle,
    Length,
    Model,
    MountOffset,
    Seconds,
    SignedDegrees,
    Size,
    Vector,
)
from regrasp.interfaces.frame import Intrinsics
from regrasp.interfaces.geometry import axes_along
from regrasp.interfaces.hidden_world import HiddenWorld

ArmName = Literal["left", "right"]


def pose_along(position: Vector, axis: Vector) -> RigidTransform:
    """Pose world_from_frame at `position` (m): x points along `axis` (any length), z as far up as that allows.

    For an axis within 8 degrees of the vertical the world's x axis takes the place of up.
    """
    return RigidTransform.from_components(position, Rotation.from_matrix(axes_along(np.array([axis], float))[0]))


class Box(Model):
    """A fixed box with its edges along the world's axes: centre and full edge lengths, m."""

    name: str
    center: Vector
    size: Size
    color: Color = (0.6, 0.6, 0.6)


class Socket(Model):
    """A socket: a block that takes a plug. The plug goes in along `axis`, through the middle of the face it meets."""

    name: str
    center: Vector
    size: Size  # (across, along the plug axis, high)
    axis: Direction
    depth: Length  # how deep the plug sits in the block
    pull_out_force: Force
    color: Color = (0.1, 0.3, 0.8)

    def world_from_plug(self, connector_length: float) -> RigidTransform:
        """Pose world_from_connector of a plugged connector that is `connector_length` m long."""
        axis = np.asarray(self.axis, float) / np.linalg.norm(self.axis)
        centre = np.asarray(self.center) - axis * (0.5 * self.size[1] + 0.5 * connector_length - self.depth)
        return pose_along((float(centre[0]), float(centre[1]), float(centre[2])), self.axis)

    @property
    def world_from_block(self) -> Rotation:
        """Rotation of the block: its x edge is horizontal, its y edge lies on the plug axis and points towards +y."""
        along = np.asarray(self.axis, float) / np.linalg.norm(self.axis)
        if along[1] < 0:
            along = -along  # the same block
        horizontal = float(np.hypot(along[0], along[1]))
        across = np.array([along[1], -along[0], 0.0]) / horizontal if horizontal > 0 else np.array([1.0, 0.0, 0.0])
        return Rotation.from_matrix(np.column_stack([across, along, np.cross(across, along)]))

    def upright_box(self) -> Box:
        """The smallest box along the world's axes that contains the block (its bounding box)."""
        size = (np.abs(self.world_from_block.as_matrix()) * self.size).sum(axis=1)
        # Without validation: the bounds are for what a file says, and the box round a turned block may exceed them.
        return Box.model_construct(name=self.name, center=self.center, size=tuple(size.tolist()), color=self.color)


PLUGGED_INTO = "plugged_into"  # stands for the name of the socket that the cell names under this key

TAG_DICTIONARY = "DICT_4X4_50"  # of cv2.aruco. Choice: the fewest cells, so they are the largest on a small plate


class Tag(Model):
    """An ArUco tag of `TAG_DICTIONARY` in the middle of a square white plate, fixed on a body.

    In the body's frame it faces +y, and its own x axis points along x. It stands for a printed film of a fraction of a
    gram that gives way to a hand: it is visible, and has neither mass nor a collision shape.
    """

    number: Annotated[int, Field(ge=0, le=49)]
    size: Length  # edge of the black square
    plate: Length  # edge of the plate, with the white border that the tag needs
    center: Vector  # of its face, in the body's frame

    @property
    def body_from_tag(self) -> RigidTransform:
        """Pose of the tag in the body's frame: x to its right, y to its top, z out of its face towards the viewer."""
        return RigidTransform.from_components(self.center, Rotation.from_matrix([[1, 0, 0], [0, 0, 1], [0, -1, 0]]))


class Clip(Model):
    """A snap-in clip that holds the connector by its tip half."""

    seat: Vector  # centre of a stowed connector
    axis: Direction  # x axis of a stowed connector
    capture_distance: Length  # from the seat, within which the clip takes a connector and outside of which it lets go
    capture_angle_deg: Annotated[float, Field(ge=0.1, le=180)]  # largest angle between the axes at which it takes one
    hold_force: Force
    bracket: tuple[Box, ...]
    tag: Tag | None = None  # in the seat's frame

    @property
    def world_from_seat(self) -> RigidTransform:
        """Pose world_from_connector of a stowed connector."""
        return pose_along(self.seat, self.axis)


class Connector(Model):
    """The connector at the cable's free end, a cylinder. Its frame is at its centre, x points from cable to tip."""

    length: Length
    radius: Length
    color: Color
    tag: Tag | None = None


class ArmSpec(Model):
    """A ViperX 300 S."""

    name: ArmName
    base: Vector  # position of its base link
    sleep: tuple[JointAngle, JointAngle, JointAngle, JointAngle, JointAngle, JointAngle]


class FixedMount(Model):
    """A camera that does not move: it looks along +x, turned left by `yaw_deg` and down by `pitch_down_deg`."""

    position: Vector
    pitch_down_deg: SignedDegrees
    yaw_deg: SignedDegrees = 0.0

    @property
    def world_from_camera(self) -> RigidTransform:
        """Pose of the optical frame (x right, y down, z forward) in the world."""
        turn = Rotation.from_euler("ZY", [self.yaw_deg, self.pitch_down_deg], degrees=True)
        return RigidTransform.from_components(self.position, turn * OPTICAL)


class WristMount(Model):
    """A camera on an arm's wrist link (before the last joint), looking along the link's x axis."""

    arm: ArmName
    offset: tuple[MountOffset, MountOffset, MountOffset]

    @property
    def wrist_from_camera(self) -> RigidTransform:
        """Pose of the optical frame in the wrist link."""
        return RigidTransform.from_components(self.offset, OPTICAL)


# Rotation body_from_optical: an optical frame (x right, y down, z forward) in a body frame (x forward, y left, z up).
OPTICAL = Rotation.from_matrix([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])


class CameraSpec(Model):
    """An RGB-D camera as its data sheet gives it."""

    name: Literal["rear", "wrist"]
    width: Annotated[int, Field(ge=16, le=4096)]
    height: Annotated[int, Field(ge=16, le=4096)]
    rate: Annotated[int, Field(ge=1, le=120)]  # Hz
    horizontal_fov_deg: Annotated[float, Field(gt=1, lt=170)]  # of the colour image, to which depth is aligned
    depth_fov_deg: Annotated[
        float, Field(gt=1, lt=170)
    ]  # horizontal, of the depth imager; the depth noise depends on it
    baseline: Length  # between the two depth imagers
    mount: FixedMount | WristMount

    @property
    def intrinsics(self) -> Intrinsics:
        """The colour image's pinhole model."""
        return Intrinsics.from_fov(self.width, self.height, float(np.deg2rad(self.horizontal_fov_deg)))


class Latencies(Model):
    """Simulated seconds that sensing and planning cost."""

    image: Seconds  # from an exposure until its frame can be read
    plan: Seconds  # for a motion plan


class KnownCell(Model):
    """What the robot's software is told about the cell."""

    boxes: tuple[Box, ...]  # floor, panels
    sockets: tuple[Socket, ...]
    plugged_into: str  # name of the socket that holds the connector at the start
    clip: Clip
    connector: Connector
    cable_length: Length  # of the flexible part
    arms: tuple[ArmSpec, ...]
    cameras: tuple[CameraSpec, ...]
    latencies: Latencies

    def solids(self) -> list[Box]:
        """All fixed and known obstacles: floor, panels, clip bracket, and the bounding boxes of the sockets' blocks."""
        return [*self.boxes, *self.clip.bracket, *(socket.upright_box() for socket in self.sockets)]

    @property
    def cable_anchor(self) -> tuple[FloatArray, FloatArray]:
        """Where the cable's fixed end leaves the last socket: position (3,) m and unit direction (3,) of the cable."""
        socket = self.sockets[-1]
        axis = np.asarray(socket.axis) / np.linalg.norm(socket.axis)
        return np.asarray(socket.center) - 0.5 * socket.size[1] * axis, -axis

    def socket(self, name: str) -> Socket:
        """The socket of that name; `PLUGGED_INTO` means the one that holds the connector at the start.

        Raises:
            KeyError: no socket has that name; the message lists those that exist.
        """
        name = self.plugged_into if name == PLUGGED_INTO else name
        for socket in self.sockets:
            if socket.name == name:
                return socket
        raise KeyError(f"no socket {name!r}; there are {', '.join(s.name for s in self.sockets)}")

    def arm(self, name: str) -> ArmSpec:
        """The arm of that name. Raises StopIteration if there is none."""
        return next(a for a in self.arms if a.name == name)

    def camera(self, name: str) -> CameraSpec:
        """The camera of that name. Raises StopIteration if there is none."""
        return next(c for c in self.cameras if c.name == name)


class Cell(Model):
    """Contents of a cell file."""

    known: KnownCell
    hidden: HiddenWorld
