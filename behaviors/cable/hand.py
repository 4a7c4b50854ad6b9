"""Steps that several of the cable's leaves share: looking, and what the hand does."""

from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar, TypeVar

from regrasp.behaviors.cable.keys import HELD, NOTICES, VAIN_CARRIES, LossNotice
from regrasp.behaviors.cable.services import CableServices
from regrasp.behaviors.keys import Keys
from regrasp.behaviors.leaf import LeafFailed, LeafSteps, StepsLeaf
from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cable.cause import CableCause
from regrasp.interfaces.cable.sight import Estimate
from regrasp.interfaces.cause import CauseCode
from regrasp.interfaces.request import Request
from regrasp.motion.failure import NO_WAY, GraspEmptyError, PlanningError

if TYPE_CHECKING:
    from scipy.spatial.transform import RigidTransform

T = TypeVar("T")


@dataclass(frozen=True)
class HandParameters:
    """How the hand leaves an empty grasp."""

    open_time: float = 0.6  # s that the jaw has to open after an empty grasp; choice


class CableLeaf(StepsLeaf):
    """A leaf of steps with the cable's services."""

    services: CableServices

    @property
    def hand(self) -> str:
        """The arm that handles the cable now."""
        return self.services.motion.hand

    @property
    def overview(self) -> str:
        """The camera that watches the hand."""
        return self.services.known.cable.overview

    @property
    def search(self) -> str:
        """The camera that looks for a lost end."""
        return self.services.known.cable.search

    def overview_points(self, since: float) -> FloatArray | None:
        """Points (n, 3) m in the world that the overview saw from second `since` on; None until a picture comes."""
        return self.services.perception.surface(self.overview, since)

    def note_loss(self, by: str) -> None:
        """Note that the connector is lost, as `by` shows. The leaf READS and WRITES the key NOTICES."""
        self.write(NOTICES, (*self.read(NOTICES), LossNotice(self.services.clock.now(), by)))

    def go_to_sleep(self, arm: str, *, pulling: bool = False) -> LeafSteps:
        """Bring an arm to its sleep pose, out of the cameras' and the other arm's way.

        `pulling`: the cable may have caught on it.
        """
        yield from self.ask(self.services.motion.sleep(arm, pulling=pulling))


class HandLeaf(CableLeaf):
    """A leaf in which the hand works.

    One that asks for `held` NEEDS the key HELD, one that grips WRITES it and VAIN_CARRIES.
    """

    leaving: ClassVar[HandParameters] = HandParameters()

    def held(self) -> "RigidTransform":
        """tool_from_connector as believed. Raises `LeafFailed` when `DetectSlip` has just noticed a loss."""
        held = self.read(HELD, None)
        if held is None:
            raise LeafFailed(CableCause.SLIPPED, "the hand holds nothing any more")
        return held

    def let_fall(self) -> LeafSteps:
        """Let go of a connector that the hand holds so that it cannot deliver it: it is taken otherwise then.

        The leaf CLEARS the key HELD, besides what `note_loss` needs.
        """
        yield self.services.motion.let_go()
        self.clear(HELD)
        self.note_loss("hand")

    def count_vain(self, error: PlanningError, most: int) -> LeafSteps:
        """Count that the held connector could not be delivered; let it fall where it cannot be, or the `most`-th time.

        The leaf READS and WRITES the key VAIN_CARRIES, besides what `let_fall` needs.
        """
        failed = self.read(VAIN_CARRIES) + 1
        self.write(VAIN_CARRIES, failed)
        if error.code is CauseCode.OUT_OF_REACH or (error.code in NO_WAY and failed >= most):
            yield from self.let_fall()

    def take(self, arms: Sequence[str], pick: Callable[[], Request[None]]) -> LeafSteps:
        """Let the first of the `arms` that finds a way bring its jaw round the connector: the hand from now on.

        One that finds none goes back to sleep. Raises the last one's PlanningError.
        """
        motion = self.services.motion
        for arm in arms:
            motion.take_with(arm)
            try:
                yield from self.ask(pick())
                return
            except PlanningError as error:
                if error.code not in (*NO_WAY, CauseCode.OUT_OF_REACH):
                    raise
                yield from self.go_to_sleep(arm)
                if arm == arms[-1]:
                    raise
                self.say("left to the other arm", arm=arm, why=str(error))

    def grip(self, world_from_connector: "RigidTransform") -> LeafSteps:
        """Close the jaw; then the belief is that it holds the connector. Raises PlanningError when it does not."""
        grip = yield from self.ask(self.services.motion.grip(world_from_connector))
        self.write(HELD, grip.pose)
        self.write(VAIN_CARRIES, 0)
        self.say("grasped", gap=grip.gap)

    def grip_or_leave(self, world_from_connector: "RigidTransform") -> LeafSteps:
        """`grip`; a hand that closed on nothing opens and goes back to sleep before GraspEmptyError is raised."""
        try:
            yield from self.grip(world_from_connector)
        except GraspEmptyError:
            self.services.motion.open_jaw(self.hand)
            yield from self.wait(self.leaving.open_time)
            yield from self.draw_back()
            yield from self.go_to_sleep(self.hand, pulling=True)
            raise

    def draw_back(self) -> LeafSteps:
        """Draw the hand straight back as far as is free. Where no distance is free, only an event says so."""
        why = yield from self.ask(self.services.motion.draw_back())
        if why:
            self.say("did not draw back", why=why)


class LookInHand(HandLeaf):
    """A leaf that looks how the connector lies in the hand before it goes on."""

    WRITES: ClassVar[Keys] = (HELD,)

    def look_in_hand(self, seconds: float, least_turn_deg: float = 0.0) -> Generator[Request[None] | None, None, bool]:
        """Correct the belief of how the connector lies in the hand by what the overview camera sees of it.

        A turn by less than `least_turn_deg` is taken for an error of the sight. Returns whether it was seen.
        """
        # Only later frames: in this moment the hand may still move.
        looked = yield from self.ask(self.services.perception.watch(self.overview, seconds, later=True))
        return self.correct_held(looked.estimates, least_turn_deg)

    def correct_held(self, seen: Sequence[Estimate], least_turn_deg: float = 0.0) -> bool:
        """Correct the belief of how the connector lies in the hand by what was seen of it; whether that was enough."""
        motion, perception = self.services.motion, self.services.perception
        held = self.read(HELD, None)
        found = None
        if held is not None:
            found = perception.in_hand(seen, motion.tool(self.hand), held, least_turn_deg=least_turn_deg)
        if found is None:
            self.say("the hand hides the connector", frames=len(seen))
            return False
        shift, turn = round(found.shift, 4), round(found.turn_deg, 1)
        self.say("connector in the hand", whole=found.whole, shift=shift, turn_deg=turn, trusted=found.trusted)
        if found.trusted:
            self.write(HELD, found.pose)
        return True
