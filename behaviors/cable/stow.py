"""Leave the connector in the clip, and look whether it stays there."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from regrasp.behaviors.cable.hand import CAMERA_ARM, HANDLING_ARM, HandLeaf
from regrasp.behaviors.cable.look import LookLeaf
from regrasp.behaviors.leaf import LeafFailed, LeafSteps
from regrasp.behaviors.services import LossNotice
from regrasp.interfaces.cable.cause import CableCause
from regrasp.interfaces.cause import CauseCode
from regrasp.motion.failure import PlanningError
from regrasp.perception.cable.cable_shape import cable_course
from regrasp.perception.pose.estimate import Estimate
from regrasp.perception.tracking.slip import seen_at


@dataclass(frozen=True)
class LetGoParameters:
    """How long the hand waits before it draws back."""

    open_time: float = 0.6  # s after the jaw stands open; choice


@dataclass(frozen=True)
class LookAtStowParameters:
    """How the clip is looked at."""

    look_time: float = 1.0  # s; choice
    # m from the seat: 20 mm for the clip, 10 mm for the camera's error, the rest for a part that the clip hides
    stowed_radius: float = 0.04


class LetGo(HandLeaf):
    """Opens the jaw, draws it back and brings the arm to its sleep pose."""

    parameters: ClassVar[LetGoParameters] = LetGoParameters()

    def steps(self) -> LeafSteps:
        """See the class."""
        from regrasp.motion.scene.planning_scene import NO_POINTS

        yield self.services.motion.release(HANDLING_ARM)
        self.services.belief.held = None
        yield from self.wait(self.parameters.open_time)
        known, motion = self.services.known, self.services.motion
        seat = known.cable.clip.world_from_seat
        along = np.linspace(-0.5, 0.5, 10)[:, None] * known.cable.connector.length
        yield from self.draw_back()
        # The way to sleep must not sweep the stowed end out of its clip.
        motion.keep_clear(np.vstack([seat.apply(along * [1.0, 0.0, 0.0]), cable_course(known, seat)]))
        yield from self.go_to_sleep(HANDLING_ARM)
        motion.keep_clear(NO_POINTS)


class LookAtStow(LookLeaf):
    """Looks at the clip; FAILURE when the connector is not there, so that the tree can recover it.

    The wrist camera looks when the rear one is not to be trusted.
    """

    parameters: ClassVar[LookAtStowParameters] = LookAtStowParameters()

    def steps(self) -> LeafSteps:
        """See the class."""
        clock, perception = self.services.clock, self.services.perception
        begin = clock.now()
        seen: list[Estimate] = []
        while clock.now() < begin + self.parameters.look_time - 1e-9:
            yield None
            result = perception.look("rear")
            if isinstance(result, Estimate) and result.stamp > begin:
                seen.append(result)
        trouble = perception.trouble("rear")
        if trouble is not None:
            yield from self._look_from_the_wrist(trouble, seen)
        if not seen:
            self._lost("no camera sees the connector at the clip")
        else:
            seat = np.array(self.services.known.cable.clip.seat)
            evidence = seen_at(seen[-1].position, seat, self.parameters.stowed_radius)
            self.say("looked at the clip", distance=round(evidence.value, 4), stowed=evidence.detected)
            if not evidence.detected:
                self._lost(evidence.sentence)

    def _look_from_the_wrist(self, trouble: str, seen: list[Estimate]) -> LeafSteps:
        self.say("the wrist camera looks at the clip", why=trouble)
        seen.clear()
        if (other := self.services.perception.trouble("wrist")) is not None:
            raise LeafFailed(CauseCode.CAMERA_FAILED, f"{trouble}; {other}")
        try:
            _, goals = self.best_view(self.services.known.cable.clip.world_from_seat)
            yield from self.go_and_look(goals, self.parameters.look_time, seen)
        except PlanningError as error:
            raise LeafFailed(
                CauseCode.CAMERA_FAILED, f"{trouble}; the wrist camera cannot look there: {error}"
            ) from None
        other = self.services.perception.trouble("wrist")
        yield from self.go_to_sleep(CAMERA_ARM)
        if other is not None:
            raise LeafFailed(CauseCode.CAMERA_FAILED, f"{trouble}; {other}")

    def _lost(self, message: str) -> None:
        self.services.belief.notices.append(LossNotice(self.services.clock.now(), "place"))
        raise LeafFailed(CableCause.NOT_STOWED, message)
