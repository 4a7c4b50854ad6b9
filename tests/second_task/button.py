"""A second task: a free arm presses a lit button that it sees. It changes no file of the engine."""

from dataclasses import dataclass
from enum import StrEnum
from typing import Any, ClassVar, Literal

import numpy as np
from pydantic import Field
from scipy.spatial.transform import RigidTransform

from regrasp.app.task import expect
from regrasp.app.task.part import Part
from regrasp.app.task.task import Task
from regrasp.app.task.words import Words
from regrasp.behaviors.keys import Key, Keys
from regrasp.behaviors.leaf import LeafFailed, LeafPort, LeafSteps, StepsLeaf
from regrasp.behaviors.services import Services
from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cell import Cell, KnownCell
from regrasp.interfaces.fault import Lasting
from regrasp.interfaces.fields import Color, Force, Length, Model, Vector
from regrasp.interfaces.hidden_world import HiddenWorld
from regrasp.motion.request import MotionRequest
from regrasp.motion.service import Motion
from regrasp.perception.camera.color import SegmentationParameters, color_mask
from regrasp.perception.camera.model import deproject
from regrasp.perception.service import Perception


class KnownButton(Model):
    arm: str
    camera: str
    color: Color


class HiddenButton(Model):
    place: Vector
    size: Length
    force: Force  # that presses it


class ButtonKnown(KnownCell):
    button: KnownButton


class ButtonHidden(HiddenWorld):
    button: HiddenButton


class ButtonCell(Cell):
    known: ButtonKnown
    hidden: ButtonHidden


class ButtonGoesDark(Lasting):
    """The lamp of the button goes out."""

    type: Literal["button_goes_dark"] = Field(description="This fault.", examples=["button_goes_dark"])


class ButtonPerception(Perception):
    def lit_button(self, button: KnownButton) -> FloatArray | None:
        """The middle (3,) m, world, of what has the lamp's colour; None while too little does."""
        frame = self.frame(button.camera)
        if frame is None or self.trouble(button.camera) is not None:
            return None
        mask = color_mask(frame.rgb, SegmentationParameters.for_color(button.color)) > 0
        points = deproject(frame.depth, mask, frame.intrinsics)
        return None if len(points) < 30 else np.asarray(self.pose_of(frame).apply(np.median(points, axis=0)))


class ButtonMotion(Motion):
    def go_before(self, arm: str, place: FloatArray) -> MotionRequest:
        """Bring the tool 12 cm before a place (3,) m, and point it there along the world's x."""
        before = RigidTransform.from_translation(place - [0.12, 0.0, 0.0])
        return self.move_tool(arm, before, onward=[RigidTransform.from_translation([0.115, 0.0, 0.0])])


@dataclass
class ButtonServices(Services):
    known: ButtonKnown
    motion: ButtonMotion
    perception: ButtonPerception


class ButtonCause(StrEnum):
    BUTTON_DARK = "button_dark"


PLACE: "Key[FloatArray]" = Key("button/place", "the lit button's middle, m, in the world")


class FindButton(StepsLeaf):
    """Looks for the lit button, for `seconds` at most."""

    WRITES: ClassVar[Keys] = (PLACE,)
    INPUT_PORTS: ClassVar[dict[str, Any]] = {"seconds": LeafPort(data_type=float, above=0.0, description="of looking")}
    services: ButtonServices

    def steps(self) -> LeafSteps:
        end = self.services.clock.now() + self.get_input("seconds")
        while (place := self.services.perception.lit_button(self.services.known.button)) is None:
            if self.services.clock.now() > end:
                raise LeafFailed(ButtonCause.BUTTON_DARK, f"no lit button in {self.get_input('seconds'):g} s")
            yield None
        self.write(PLACE, place)


class Press(StepsLeaf):
    """Presses the button that was found until the arm stands still, and draws back."""

    NEEDS: ClassVar[Keys] = (PLACE,)
    services: ButtonServices

    def steps(self) -> LeafSteps:
        motion, arm = self.services.motion, self.services.known.button.arm
        yield motion.go_before(arm, self.read(PLACE))
        reached, step = -np.inf, 0.006
        while (x := motion.kinematics[arm].tool(motion.joints(arm)).translation[0]) > reached + step / 2:
            reached = x
            yield motion.shift(arm, [step, 0.0, 0.0], checked=False)
        yield motion.shift(arm, [-0.08, 0.0, 0.0], checked=False)


LEAVES = {"FindButton": FindButton, "Press": Press}


class Expect(expect.Expect):
    pressed: bool | None = Field(default=None, description="Whether it is pressed at the end.", examples=[True])


FAULTS = (ButtonGoesDark,)
WORDS = Words(measured="button", measured_title="The button, by ground truth")
TASK = Task(
    name="button",
    about="Press a lit button.",
    objects=Part("button_run:ButtonObjects"),
    cell=Part("button:ButtonCell"),
    expect=Part("button:Expect"),
    causes=Part("button:ButtonCause"),
    faults=Part("button:FAULTS"),
    services=Part("button_run:services"),
    judge=Part("button_run:Judge"),
    words=Part("button:WORDS"),
)
