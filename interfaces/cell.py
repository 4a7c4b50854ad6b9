"""The cell: what its robot is told (`KnownCell`) and what only the simulated world knows (`HiddenWorld`).

It is read from a YAML file under `scenarios/cells/`. Units are SI. The world frame lies on the plane of the two arm
bases, midway between them: x points forward to the panels, y left, z up.
"""

from typing import Annotated, Self

import numpy as np
from pydantic import Field, model_validator
from scipy.spatial.transform import RigidTransform, Rotation

from regrasp.interfaces.fields import (
    Color,
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
from regrasp.interfaces.robot.robot import Robot

Name = Annotated[str, Field(pattern=r"^[A-Za-z_][A-Za-z0-9_-]*$", max_length=40)]


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


class ArmSpec(Model):
    """An arm: a robot, and where it stands."""

    name: Name
    robot: Robot  # in a file the name of a robot or the path of its file
    base: Vector  # position of its base link
    base_rpy_deg: tuple[SignedDegrees, SignedDegrees, SignedDegrees] = (0.0, 0.0, 0.0)  # roll, pitch and yaw
    sleep: tuple[JointAngle, ...]  # left out in a file: the robot's

    @model_validator(mode="after")
    def _all_joints(self) -> Self:
        if len(self.sleep) != len(self.robot.joint_names):
            names = ", ".join(self.robot.joint_names)
            raise ValueError(f"sleep has {len(self.sleep)} values for the joints {names}; write one for each")
        return self

    @property
    def world_from_base(self) -> RigidTransform:
        """Pose of the base link: turned about x by the roll, then about y, then about z, all axes of the world."""
        if not any(self.base_rpy_deg):
            return RigidTransform.from_translation(self.base)
        return RigidTransform.from_components(self.base, Rotation.from_euler("xyz", self.base_rpy_deg, degrees=True))


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
    """A camera on the mount that an arm's robot has, looking along the mount's x axis."""

    arm: str
    offset: tuple[MountOffset, MountOffset, MountOffset]

    @property
    def mount_from_camera(self) -> RigidTransform:
        """Pose of the optical frame in the mount."""
        return RigidTransform.from_components(self.offset, OPTICAL)


# Rotation body_from_optical: an optical frame (x right, y down, z forward) in a body frame (x forward, y left, z up).
OPTICAL = Rotation.from_matrix([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])


class CameraSpec(Model):
    """An RGB-D camera as its data sheet gives it."""

    name: Name
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


class Region(Model):
    """A box along the world's axes by two corners, m."""

    lower: Vector
    upper: Vector

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        if any(low >= high for low, high in zip(self.lower, self.upper, strict=True)):
            raise ValueError("lower is not below upper in x, y and z; exchange what is the wrong way round")
        return self


_MOST_VOXELS = 3e6  # of a map, which each look goes through: choice, some 0.3 s


class MappedRegion(Region):
    """Where obstacles are mapped, in voxels."""

    voxel: Length = 0.01  # edge, m; choice: a hand must pass between obstacles 0.1 m apart

    @model_validator(mode="after")
    def _not_too_many(self) -> Self:
        sides = np.array(self.upper) - self.lower
        if (count := float(np.prod(sides / self.voxel))) > _MOST_VOXELS:
            least = np.ceil(1e3 * np.cbrt(np.prod(sides) / _MOST_VOXELS)) / 1e3
            raise ValueError(
                f"has {count / 1e6:.0f} million voxels, at most {_MOST_VOXELS / 1e6:.0f} million are allowed; "
                f"make the region smaller, or add voxel: {least:g}"
            )
        return self


class KnownCell(Model):
    """What the robot's software is told about the cell. A task adds its section under the task's name."""

    boxes: tuple[Box, ...]  # floor, panels
    arms: tuple[ArmSpec, ...]
    cameras: tuple[CameraSpec, ...]
    latencies: Latencies
    mapped: MappedRegion | None = None  # left out: before the arms, see `PerceptionParameters`

    def solids(self) -> list[Box]:
        """All fixed and known obstacles, as boxes along the world's axes."""
        return list(self.boxes)

    def arm(self, name: str) -> ArmSpec:
        """The arm of that name. Raises StopIteration if there is none."""
        return next(a for a in self.arms if a.name == name)

    def camera(self, name: str) -> CameraSpec:
        """The camera of that name. Raises StopIteration if there is none."""
        return next(c for c in self.cameras if c.name == name)


class Cell(Model):
    """Contents of a cell file. A task that adds to it has a class of its own (`regrasp.app.task.task`)."""

    known: KnownCell
    hidden: HiddenWorld
    # from where a run is filmed: behind and above the right one of two arms at the origin, unless a file says otherwise
    viewpoint: FixedMount = FixedMount(position=(-0.55, -0.75, 0.85), pitch_down_deg=30.0, yaw_deg=38.0)
