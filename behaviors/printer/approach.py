"""The approaches to the printed part: the source's three (Mounesisohi 2022, section 4.3.10), and a servo."""

from collections.abc import Callable, Iterator
from typing import Any

from regrasp.behaviors.printer.services import PrinterServices
from regrasp.interfaces.printer.actions import PART_AND_BED, Approach, ImageGoal, PoseRelGoal
from regrasp.interfaces.request import Request

BUFFER = 0.25  # m before the goal at which three_step stops; the source's


def approach_steps(
    services: PrinterServices,
    method: Approach,
    before: float,
    buffer: float = BUFFER,
    seconds: float = 1.0,
    say: Callable[..., None] = lambda event, **values: None,
) -> Iterator[Request[Any]]:
    """Requests, to be done one after the other, that bring the tool `before` m before the part's section.

    `buffer` m before the goal three_step stops. A look of a source's approach gives up after so many `seconds`. `say`
    is told what was seen.
    """
    if method == "servo":
        motion, gripper = services.motion, services.gripper
        now = services.clock.now()
        tracker = services.perception.part_tracker(motion.tool_at, lambda: gripper.state().gap, now, say)
        yield services.arm_and_rail.take(motion.servo(services.known.printer.hand, tracker, before), str)
        return
    if method != "one_step":
        yield from _step(services, None, seconds, say)
    if method == "three_step":
        yield from _step(services, buffer, seconds, say)
    yield from _step(services, 0.0, seconds, say)


def _step(
    services: PrinterServices, stop: float | None, seconds: float, say: Callable[..., None]
) -> Iterator[Request[Any]]:
    """Look, centre the part, and go on to `stop` m before the goal; None: only centre it."""
    look = services.analyzer.send(ImageGoal("obj", seconds))
    yield look
    seen = look.answer
    x, y, z = (float(value) for value in services.perception.offset_by_tables(seen))
    say("saw the part", offset=seen.offset, area=seen.area, goal=[round(value, 4) for value in (x, y, z)])
    ahead = 0.0 if stop is None else min(x + stop, 0.0)  # never back, as the source
    yield services.manipulator.send(PoseRelGoal((ahead, y, z), PART_AND_BED))
