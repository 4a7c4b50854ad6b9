"""Leave the connector in the clip, and look whether it stays there."""

from collections.abc import Generator
from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from regrasp.behaviors.cable.hand import HandLeaf
from regrasp.behaviors.cable.keys import HELD, NOTICES
from regrasp.behaviors.cable.look import LookLeaf
from regrasp.behaviors.keys import Keys
from regrasp.behaviors.leaf import LeafFailed, LeafSteps
from regrasp.interfaces.cable.cause import CableCause
from regrasp.interfaces.cable.sight import Estimate
from regrasp.interfaces.cause import CauseCode
from regrasp.interfaces.evidence import Evidence
from regrasp.interfaces.request import Request
from regrasp.motion.failure import PlanningError

if TYPE_CHECKING:
    from scipy.spatial.transform import RigidTransform


@dataclass(frozen=True)
class LetGoParameters:
    """How long the hand waits before it draws back."""

    open_time: float = 0.6  # s after the jaw stands open; choice


@dataclass(frozen=True)
class LookAtStowParameters:
    """How long the clip is looked at."""

    look_time: float = 1.0  # s; choice


class LetGo(HandLeaf):
    """Opens the jaw, draws it back and brings the arm to its sleep pose."""

    CLEARS: ClassVar[Keys] = (HELD,)
    parameters: ClassVar[LetGoParameters] = LetGoParameters()

    def steps(self) -> LeafSteps:
        """See the class."""
        yield self.services.motion.let_go()
        self.clear(HELD)
        yield from self.wait(self.parameters.open_time)
        yield from self.leave()

    def leave(self) -> LeafSteps:
        """Bring the open hand away."""
        yield from self.draw_back()
        yield self.services.motion.leave_clip()


class LookAtStow(LookLeaf):
    """Looks at the clip; FAILURE when the connector is not there, so that the tree can recover it.

    The wrist camera looks when the rear one is not to be trusted, sees no connector, or a part of it elsewhere.
    """

    READS: ClassVar[Keys] = (NOTICES,)
    WRITES: ClassVar[Keys] = (NOTICES,)
    PLACE: ClassVar[str] = "the clip"
    STATE: ClassVar[str] = "stowed"
    CAUSE: ClassVar[CableCause] = CableCause.NOT_STOWED
    parameters: ClassVar[LookAtStowParameters] = LookAtStowParameters()

    @property
    def seat(self) -> "RigidTransform":
        """world_from_connector where it should be."""
        return self.services.known.cable.clip.world_from_seat

    def seated(self, estimate: Estimate) -> Evidence:
        """Whether a connector seen so is there."""
        return self.services.perception.stowed(estimate)

    def steps(self) -> LeafSteps:
        """See the class."""
        perception = self.services.perception
        looked = yield from self.ask(perception.watch(self.overview, self.parameters.look_time, later=True))
        seen, trouble = looked.estimates, perception.trouble(self.overview)
        if trouble is not None:
            seen = yield from self._look_from_the_other(trouble)
        elif not seen or not (seen[-1].whole or self.seated(seen[-1]).detected):
            # What is half hidden may seem to lie elsewhere, and what is hidden is not seen at all.
            what = "the connector in part" if seen else "no connector"
            with suppress(LeafFailed):
                other = yield from self._look_from_the_other(f"the {self.overview} camera sees {what}")
                seen = [estimate for estimate in other if estimate.whole] or seen or other
        if not seen:
            self._lost(f"no camera sees the connector at {self.PLACE}")
        else:
            evidence = self.seated(seen[-1])
            self.say(f"looked at {self.PLACE}", distance=round(evidence.value, 4), **{self.STATE: evidence.detected})
            if not evidence.detected:
                self._lost(evidence.sentence)

    def _look_from_the_other(self, trouble: str) -> Generator[Request[None] | None, None, list[Estimate]]:
        motion, perception = self.services.motion, self.services.perception
        self.say(f"the {self.search} camera looks at {self.PLACE}", why=trouble)
        if (other := perception.trouble(self.search)) is not None:
            raise LeafFailed(CauseCode.CAMERA_FAILED, f"{trouble}; {other}")
        try:
            view = motion.best_view(self.seat)
            looked = yield from self.go_and_look(view, self.parameters.look_time)
        except PlanningError as error:
            raise LeafFailed(
                CauseCode.CAMERA_FAILED, f"{trouble}; the {self.search} camera cannot look there: {error}"
            ) from None
        other = perception.trouble(self.search)
        yield from self.go_to_sleep(self.search_arm)
        if other is not None:
            raise LeafFailed(CauseCode.CAMERA_FAILED, f"{trouble}; {other}")
        return looked.estimates

    def _lost(self, message: str) -> None:
        self.note_loss("place")
        raise LeafFailed(self.CAUSE, message)
