"""The cable task's sections of a cell file, `known.cable` and `hidden.cable`. Units are SI."""

from typing import Annotated, Any, Self

import numpy as np
from pydantic import Field
from scipy.spatial.transform import RigidTransform, Rotation

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cell import Box, Cell, KnownCell, WristMount, pose_along
from regrasp.interfaces.fields import Color, Direction, Force, Friction, Length, Mass, Model, Size, Vector
from regrasp.interfaces.hidden_world import HiddenWorld
from regrasp.interfaces.tag import Tag


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


class KnownCable(Model):
    """What the robot is told about the cable, where its end belongs, and which arm and which cameras do what."""

    sockets: tuple[Socket, ...]
    plugged_into: str  # name of the socket that holds the connector at the start
    clip: Clip
    connector: Connector
    length: Length  # of the flexible part
    radius: Length = 0.0035  # of the flexible part, by which an arm that takes hold of it closes its jaw
    hand: str = "right"  # the arm that handles the cable
    overview: str = "rear"  # the camera that watches the hand
    search: str = "wrist"  # the camera, on another arm's wrist, that looks for a lost end

    @property
    def anchor(self) -> tuple[FloatArray, FloatArray]:
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


class Stiffness(Model):
    """Bending stiffness EI in N m2 for each gravity. For tests on Earth the cable is stiffer, as in the thesis."""

    zero: Annotated[float, Field(ge=1e-4, le=10)]
    earth: Annotated[float, Field(ge=1e-4, le=10)]


class HiddenCable(Model):
    """The flexible part of the cable. It is clamped at `anchor`; without load it lies straight along `anchor_axis`."""

    length: Length
    radius: Annotated[float, Field(ge=1e-4, le=0.03)]
    mass_per_length: Mass
    links: Annotated[int, Field(ge=4, le=30)]  # PyBullet reads at most 31 spherical joints
    stiffness: Stiffness
    damping_ratio: Annotated[float, Field(ge=0, le=10)]  # of the first bending mode
    anchor: Vector
    anchor_axis: Direction
    color: Color
    connector_mass: Mass
    connector_friction: Friction


class CableKnown(KnownCell):
    """What the robot's software is told about a cell with a cable."""

    cable: KnownCable

    def solids(self) -> list[Box]:
        """Floor, panels, the clip's bracket, and the bounding boxes of the sockets' blocks."""
        cable = self.cable
        return [*self.boxes, *cable.clip.bracket, *(socket.upright_box() for socket in cable.sockets)]

    def with_cable(self, **values: Any) -> Self:
        """A copy with these values in its section `cable`."""
        return self.model_copy(update={"cable": self.cable.model_copy(update=values)})

    @property
    def search_mount(self) -> WristMount:
        """How the camera that searches is mounted."""
        mount = self.camera(self.cable.search).mount
        assert isinstance(mount, WristMount)  # the cell's check
        return mount


class CableHidden(HiddenWorld):
    """What only the simulated world knows of a cell with a cable."""

    cable: HiddenCable


class CableCell(Cell):
    """A cell with a cable."""

    known: CableKnown
    hidden: CableHidden
