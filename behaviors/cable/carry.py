"""Bring the held connector in front of the stow clip, and into it."""

from dataclasses import dataclass
from typing import ClassVar

from regrasp.behaviors.cable.hand import HandLeaf, LookInHand
from regrasp.behaviors.cable.keys import HELD, NOTICES, VAIN_CARRIES
from regrasp.behaviors.cable.look import LookLeaf
from regrasp.behaviors.keys import Keys
from regrasp.behaviors.leaf import LeafFailed, LeafSteps
from regrasp.interfaces.cable.cause import CableCause
from regrasp.interfaces.cause import CauseCode
from regrasp.motion.failure import PlanningError


@dataclass(frozen=True)
class InsertParameters:
    """How long the connector is looked at in the hand, how long its insertion takes, and how often it is tried."""

    look_time: float = 0.8  # s of looking; choice
    seat_time: float = 0.6  # s of waiting; the clip's lips take 0.2 s to close
    # before which try the other arm's camera looks where the hand hides the connector; that takes 7 to 10 s; choice
    other_look: int = 0
    blocked: int = 2  # insertions that were blocked, or carries in vain, before the hand lets it fall; choice


@dataclass(frozen=True)
class CarryParameters:
    """How often the connector is carried."""

    carries: int = 2  # that fail before the hand lets it fall; choice


class Carry(HandLeaf):
    """Plans the held connector's path to a place in front of the clip and follows it.

    Where it is held so that no pose of the hand brings it there, or carrying it has failed before, the hand lets it
    fall: its cable may hang on something, and it is taken otherwise then. The cable is bent by force only once that has
    happened: that may pull the connector out of the jaw, and press the arm against things.
    """

    NEEDS: ClassVar[Keys] = (HELD,)
    READS: ClassVar[Keys] = (NOTICES, VAIN_CARRIES)
    WRITES: ClassVar[Keys] = (NOTICES, VAIN_CARRIES)
    CLEARS: ClassVar[Keys] = (HELD,)
    parameters: ClassVar[CarryParameters] = CarryParameters()

    def steps(self) -> LeafSteps:
        """See the class."""
        try:
            yield from self.ask(self.services.motion.carry_to_clip(self.held(), forced=self._was_let_fall()))
        except PlanningError as error:
            yield from self.count_vain(error, self.parameters.carries)
            raise

    def _was_let_fall(self) -> bool:
        return any(notice.by == "hand" for notice in self.read(NOTICES))


class Insert(LookInHand, LookLeaf):
    """Looks how the connector lies in the hand, brings it straight into the clip, and pulls gently.

    Where the hand hides it from the overview camera, the other arm's camera looks, if it can. Where the clip does not
    hold it, the hand comes back out, looks again, and tries as if it lay a little otherwise. When no try is left, it
    lies in the hand in an unknown way: the hand lets it fall, and the leaf fails. So it does where the way in or back
    out was blocked, the second time.
    """

    NEEDS: ClassVar[Keys] = (HELD,)
    READS: ClassVar[Keys] = (NOTICES, VAIN_CARRIES)
    WRITES: ClassVar[Keys] = (HELD, NOTICES, VAIN_CARRIES)
    CLEARS: ClassVar[Keys] = (HELD,)
    parameters: ClassVar[InsertParameters] = InsertParameters()

    def steps(self) -> LeafSteps:
        """See the class."""
        motion, why = self.services.motion, ""
        for attempt in range(motion.insertions):
            seen = yield from self.look_in_hand(self.parameters.look_time)
            if not seen and attempt == self.parameters.other_look and self.search_arm != self.hand:
                yield from self._look_with_the_other_arm()
            try:
                yield from self.ask(motion.insert(self.held(), attempt))
                yield from self.wait(self.parameters.seat_time)
                pull = yield from self.ask(motion.pull_at_clip(self.held()))
            except PlanningError as error:
                if error.code is not CauseCode.OUT_OF_REACH:
                    yield from self.count_vain(error, self.parameters.blocked)
                    raise
                why = why or str(error)
                continue
            self.say("pulled at the clip", stiffness=round(pull.value), holds=pull.detected)
            if pull.detected:
                return
            why = pull.sentence
        yield from self.let_fall()
        raise LeafFailed(CableCause.NOT_STOWED, f"the clip does not hold the connector: {why}")

    def _look_with_the_other_arm(self) -> LeafSteps:
        """Look in the hand with the camera that searches. Where it cannot look there, only an event says so."""
        motion, perception = self.services.motion, self.services.perception
        connector = motion.tool(self.hand) * self.held()
        try:
            yield from self.ask(motion.go_to_view(motion.best_view(connector, past=self.hand)))
            looked = yield from self.ask(
                perception.watch(self.search, self.parameters.look_time, settle=self.looking.settle_time)
            )
            self.correct_held(looked.estimates)
        except PlanningError as error:
            self.say("no look in the hand", why=str(error))
        yield from self.go_to_sleep(self.search_arm)
