"""A technique of a task's perception that `regrasp perceive` tries on a user's own pictures."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from regrasp.app.task.part import Part

if TYPE_CHECKING:
    from regrasp.interfaces.fields import Color


FRAME_FIELDS = ("depth", "intrinsics", "camera", "pose")


@dataclass(frozen=True)
class FrameFiles:
    """The files of one frame, the name of its camera in the cell, and the file of the camera's pose."""

    rgb: Path
    depth: Path | None = None
    intrinsics: Path | None = None
    camera: str | None = None
    pose: Path | None = None


@dataclass(frozen=True)
class PerceiveRequest:
    """What a user asks of a technique; None: not given."""

    technique: str
    frames: Sequence[FrameFiles]
    cell: str | None = None  # a name or a path
    color: "Color | None" = None  # the object's, each of R, G, B 0 to 1
    length: float | None = None  # m
    radius: float | None = None  # m
    depth_unit: float | None = None  # m that a whole number of a depth image counts
    draw: Path | None = None  # the file for the first picture with the result

    def given(self) -> Iterator[str]:
        """The options that the user gave, besides --rgb, --technique, --cell and --draw."""
        for option, field in zip(("depth", "intrinsics", "camera", "camera-pose"), FRAME_FIELDS, strict=True):
            if any(getattr(frame, field) is not None for frame in self.frames):
                yield f"--{option}"
        for field in ("color", "length", "radius", "depth_unit"):
            if getattr(self, field) is not None:
                yield f"--{field.replace('_', '-')}"


@dataclass(frozen=True, eq=False)
class Technique:
    """A technique.

    `run` prints the answer as JSON, draws it where that is asked for, and tells whether the object is found. It raises
    `Findings` for what is wrong in the request or its files.
    """

    about: str  # what it finds, and by what; a line of help
    run: Part["Callable[[PerceiveRequest], bool]"]
