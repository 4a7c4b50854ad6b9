"""The parts of a robot file. SI units; angles in rad."""

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from regrasp.interfaces.fields import (
    Coordinate,
    Force,
    Friction,
    JointAngle,
    Length,
    Model,
    Size,
    Vector,
)

JointName = Annotated[str, Field(pattern=r"^[A-Za-z_][A-Za-z0-9_]*$", max_length=40, examples=["wrist_1"])]
LinkName = Annotated[str, Field(min_length=1, max_length=80)]
Sphere = tuple[Coordinate, Coordinate, Coordinate, Annotated[float, Field(gt=0, le=2)]]  # centre and radius, m
JointLimit = Annotated[float, Field(ge=-100, le=100)]  # rad, or m of a sliding joint
Margin = Annotated[float, Field(ge=0, le=1)]  # m
PadOffset = Annotated[float, Field(ge=-1, le=1)]  # m


class Source(Model):
    """A URDF or xacro file: of an installed Python package, or beside the robot file.

    `ros_packages` says which folder of the same place stands for a ROS package in `package://` addresses.
    """

    path: str
    package: str | None = None
    arguments: dict[str, str] = Field(default_factory=dict)  # of the xacro file
    ros_packages: dict[str, str] = Field(default_factory=dict)


class Placed(Model):
    """A frame that is fixed to a link: `xyz` m and roll, pitch, yaw (URDF's order) rad in the link's frame."""

    link: LinkName
    xyz: Vector = (0.0, 0.0, 0.0)
    rpy: tuple[JointAngle, JointAngle, JointAngle] = (0.0, 0.0, 0.0)


class Joint(Model):
    """A joint that is driven. What is left out comes from the URDF.

    Units are rad, rad/s, rad/s2 and N m; of a sliding joint m, m/s, m/s2 and N.
    """

    name: JointName
    urdf: str | None = None  # its name there, if that is another
    sign: Literal[1, -1] = 1  # -1: we count the other way round
    lower: JointLimit | None = None
    upper: JointLimit | None = None
    speed: Annotated[float, Field(gt=0, le=100)] | None = None
    acceleration: Annotated[float, Field(gt=0, le=1000)]  # a URDF has none
    torque: Annotated[float, Field(gt=0, le=1e5)] | None = None
    lever: Annotated[float, Field(gt=0, le=10)] | None = None  # m that the far end moves by a rad, about

    @property
    def in_urdf(self) -> str:
        """Its name in the URDF."""
        return self.urdf or self.name

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        if self.lower is not None and self.upper is not None and self.lower >= self.upper:
            raise ValueError(f"lower {self.lower:g} is not below upper {self.upper:g}; exchange them")
        return self


class Rail(Model):
    """A rail or lift under the base: one more joint, the first. The base's place in a cell is that of its zero.

    The `carriage` and the `beam` are boxes of these sizes, m, whose middles lie on the rail's line; the beam is as
    long as the way of the carriage and stays where it is.
    """

    name: JointName = "rail"
    axis: Literal["x", "y", "z"] = "y"  # of the base's frame
    lower: JointLimit
    upper: JointLimit
    speed: Annotated[float, Field(gt=0, le=10)]
    acceleration: Annotated[float, Field(gt=0, le=100)]
    force: Force
    carriage: Size
    beam: tuple[Length, Length]  # its width and height
    below: Length = 0.02  # m from the base's origin down to the carriage's middle

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        if self.lower >= self.upper:
            raise ValueError(f"lower {self.lower:g} is not below upper {self.upper:g}; exchange them")
        return self


class Pads(Model):
    """Rubber pads that are added to two fingers, as boxes; the URDF has none. "Along the finger" is the tool's x."""

    links: tuple[LinkName, LinkName]  # of the left and the right finger, whose faces look at each other
    face: PadOffset  # m from a finger link's origin to its inner face, against the way it opens
    ahead: PadOffset  # m from a finger link's origin to the pad's middle, along the finger
    length: Length  # along the finger
    height: Length
    thickness: Annotated[float, Field(ge=1e-4, le=0.02)]


class _Gripper(Model):
    """What all two-finger grippers have."""

    opening: Annotated[float, Field(gt=0, le=1)]  # m between the pads at most
    closed: Annotated[float, Field(ge=0, le=1)] = 0.0  # m between the pads at the lower stop
    force: Force  # N of each finger at most
    speed: Annotated[float, Field(ge=1e-3, le=10)]  # m/s of each finger
    friction: Friction  # of the pads

    @model_validator(mode="after")
    def _closes(self) -> Self:
        if self.closed >= self.opening:
            raise ValueError(f"closed {self.closed:g} is not below opening {self.opening:g}; exchange them")
        return self


class ParallelGripper(_Gripper):
    """Two sliding fingers that one drive moves. Which way each of their joints opens follows from the URDF."""

    type: Literal["parallel"]
    joints: tuple[str, str]  # of the left and the right finger
    pads: Pads
    spin: tuple[str, ...] = ()  # joints of the URDF that turn for show, and are held


class LinkageGripper(_Gripper):
    """Two fingers on linkages: one joint is driven, and the others follow it by the `mimic` tags of the URDF."""

    type: Literal["linkage"]
    joint: str  # the driven one; it closes upwards
    pads: tuple[LinkName, LinkName]  # left and right
    thickness: Annotated[float, Field(ge=0, le=0.05)]  # m of a pad: its link's origin lies in its middle
    length: Length | None = None  # m of a pad along the finger; needed by what looks for the pads in a picture ...
    height: Length | None = None  # and this, too


Gripper = Annotated[ParallelGripper | LinkageGripper, Field(discriminator="type")]


class Attached(Model):
    """A gripper that has a URDF of its own. Its links and joints get the `prefix`."""

    urdf: Source
    at: Placed  # the gripper's root link in the arm
    prefix: str = ""


class Calibration(Model):
    """How an arm's encoders err: constant offsets of its joints, drawn so that the tool errs as the cell says.

    The stated error is the tool's mean over the `poses`.
    """

    poses: Annotated[tuple[tuple[JointAngle, ...], ...], Field(min_length=1)]
    encoder_step: Annotated[float, Field(gt=0, le=0.1)] = 1e-4  # rad


class Footprint(Model):
    """The box that the base fills, whatever the joints are: centre and full size, m, in the base's frame."""

    center: Vector
    size: Size


class LinkCover(Model):
    """What the spheres of one link promise, where that differs from the others."""

    outside: Margin | None = None
    excess: Margin | None = None


class Cover(Model):
    """What the spheres promise of the links' geometry; `regrasp robots check` measures it.

    Spheres of links that are fixed to one another count together. No point of a moving link's geometry lies farther
    than `outside` m out of the spheres, and no sphere stands out of it by more than `excess` m. Of links that stand
    still, or only turn on the spot, nothing around is checked: they promise no excess, and without spheres nothing.
    """

    outside: Margin = 0.001
    excess: Margin = 0.03
    links: dict[LinkName, LinkCover] = Field(default_factory=dict)  # those that differ

    def of(self, link: str) -> tuple[float, float]:
        """What is promised of a link: `outside` and `excess`, m."""
        own = self.links.get(link, LinkCover())
        return (
            self.outside if own.outside is None else own.outside,
            self.excess if own.excess is None else own.excess,
        )
