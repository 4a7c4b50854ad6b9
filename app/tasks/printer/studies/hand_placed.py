"""A printer's world in which the hand stands where it is put: for studies that begin before the part."""

import logging
from types import TracebackType
from typing import Any, Self

import numpy as np
import structlog
from scipy.spatial.transform import RigidTransform

from regrasp.app.tasks.printer.services import printer_services
from regrasp.interfaces.cause import CauseCode
from regrasp.interfaces.frame import RgbdFrame
from regrasp.interfaces.printer.actions import PART_AND_BED
from regrasp.interfaces.printer.cell import PrinterCell
from regrasp.interfaces.request import RequestError
from regrasp.interfaces.scene import Gravity
from regrasp.sim.printer.objects import PrinterObjects
from regrasp.sim.world import World


class HandPlaced:
    """The world and the services of a seed; `goal` is where the tool shall come, by the part's true place.

    `rail` is where the rail stands, m, `before` how far before the section's front the goal lies, and `gap` how wide
    the jaw stands open, m.
    """

    def __init__(
        self,
        cell: PrinterCell,
        seed: int,
        gravity: Gravity = "zero",
        rail: float = 1.75,
        before: float = 0.02,
        gap: float = 0.05,
    ) -> None:
        self.world: World[PrinterObjects] = World(cell, gravity, seed, PrinterObjects(cell))
        silent = structlog.make_filtering_bound_logger(logging.CRITICAL)
        self.services = printer_services(self.world, seed, structlog.wrap_logger(None, wrapper_class=silent))
        self.name, self.rail, self.before = cell.known.printer.hand, rail, before
        self._camera = cell.known.printer.camera
        self.arm = self.world.arms[self.name]
        self.arm.gripper.place_at(gap)
        self.arm.gripper.open(gap)

    @property
    def goal(self) -> RigidTransform:
        """world_from_tool before the part's section, by its true place."""
        return self.world.objects.part.front() * RigidTransform.from_translation([-self.before, 0.0, 0.0])

    def place(self, tool: RigidTransform, onward: tuple[RigidTransform, ...] = ()) -> None:
        """Put the tool, by the encoders, at a pose from where it can go straight on to the poses `onward`.

        Raises:
            RequestError: OUT_OF_REACH.
        """
        motion: Any = self.services.motion
        kin, q = motion.kinematics[self.name], np.array(self.world.cell.known.arm(self.name).sleep)
        q[0] = self.rail
        ends = [end for end in kin.ik(tool, q) if abs(end[0] - self.rail) < 1e-9]
        ways = [tool.inv() * pose for pose in onward]
        free = [end for end in ends if motion.leads_on(self.name, end, ways, PART_AND_BED)]
        if not free:
            raise RequestError(
                CauseCode.OUT_OF_REACH, f"no joints bring the tool to {tool.translation.round(3).tolist()}"
            )
        self.arm.place(free[0])

    def tool(self) -> RigidTransform:
        """The true world_from_tool, for a jaw that stands open as the tool point is defined."""
        motion: Any = self.services.motion
        return motion.kinematics[self.name].tool(self.arm.true_joints())

    def picture(self) -> RgbdFrame:
        """A picture of the hand's camera from where it stands now."""
        begin = self.world.now()
        while (frame := self.services.perception.frame(self._camera)) is None or frame.stamp <= begin:
            self.world.advance(0.05)
        return frame

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.world.close()
