"""Grasp the connector again where it was found."""

from collections.abc import Generator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

from regrasp.behaviors.cable.hand import HandLeaf
from regrasp.behaviors.cable.keys import FOUND, HELD, NOTICES, VAIN_CARRIES
from regrasp.behaviors.keys import Keys
from regrasp.behaviors.leaf import LeafSteps
from regrasp.interfaces.cause import CauseCode
from regrasp.interfaces.request import Request
from regrasp.motion.failure import NO_WAY, GraspEmptyError, PlanningError

if TYPE_CHECKING:
    from scipy.spatial.transform import RigidTransform

NO_GRASP = (CauseCode.NO_COLLISION_FREE_GOAL, CauseCode.OUT_OF_REACH)  # no jaw gets round the connector where it is


@dataclass(frozen=True)
class RegraspParameters:
    """How an end that was pulled out by its cable is looked at. All values are choices."""

    hang_time: float = 3.0  # s for the end to hang still
    look_time: float = 1.5  # s of looking then
    places: int = 3  # to which it is lifted, one after the other, where it cannot be taken from the one before
    blocked: int = 2  # times in a row that every arm's way was blocked, from which on the end is pulled out, too


class Regrasp(HandLeaf):
    """Brings an arm to where the connector was found, closes the jaw and tells by its gap whether it holds.

    The arm that can do it best is the hand from now on. One that finds no way there goes to sleep, and the next one
    tries. Where none finds one, an arm takes hold of the cable and lifts the connector out, and another takes it then.
    A hand that closes on nothing opens and goes back to sleep, and the leaf fails.
    """

    NEEDS: ClassVar[Keys] = (FOUND,)
    READS: ClassVar[Keys] = (NOTICES,)
    WRITES: ClassVar[Keys] = (HELD, NOTICES, VAIN_CARRIES)
    parameters: ClassVar[RegraspParameters] = RegraspParameters()
    _blocked = 0  # times in a row that no arm found a way

    def steps(self) -> LeafSteps:
        """See the class."""
        connector = self.read(FOUND).world_from_connector
        try:
            yield from self._take(connector)
        except PlanningError as error:
            self._blocked += error.code in NO_WAY
            again = error.code in NO_WAY and self._blocked >= self.parameters.blocked
            if not (again or error.code in NO_GRASP) or len(self.services.known.arms) == 1:
                raise
            yield from self._take_by_cable(connector, error)

    def grip(self, world_from_connector: "RigidTransform") -> LeafSteps:
        """As every hand does; a jaw that closes on nothing may have held the connector for a moment, and lost it."""
        try:
            yield from super().grip(world_from_connector)
        except GraspEmptyError:
            self.note_loss("grasp")
            raise

    def _take(self, connector: "RigidTransform", holds_cable: str | None = None) -> LeafSteps:
        """Grip the connector (world_from_connector) with the best arm, but for one that `holds_cable`."""
        motion = self.services.motion
        motion.set_obstacles(*self.services.perception.obstacles_beside(connector))
        hands = yield from self.ask(motion.hands_for(connector, () if holds_cable is None else (holds_cable,)))
        yield from self.take(hands, lambda: motion.pick_loose(connector, point_cloud=self.overview_points))
        self.say("took it", arm=motion.hand)
        yield from self.grip_or_leave(connector)
        self._blocked = 0
        self.services.take_over_map()  # what nobody has seen beside the connector counts again

    def _take_by_cable(self, connector: "RigidTransform", no_grasp: PlanningError) -> LeafSteps:
        """Lift the connector out by its cable, and grip it with another arm. Raises `no_grasp` where none can."""
        motion = self.services.motion
        try:
            arm = yield from self.ask(motion.pull_cable(connector))
        except PlanningError as error:
            if error.code not in (*NO_WAY, *NO_GRASP, CauseCode.GRASP_EMPTY):
                raise
            self.say("the cable cannot be taken, either", why=str(error))
            raise no_grasp from None
        self.say("lifted by its cable", arm=arm)
        try:
            yield from self._take_lifted(arm, no_grasp)
        except PlanningError:
            yield from self.ask(motion.let_go_of_cable(arm))
            raise
        try:
            yield from self.ask(motion.let_go_of_cable(arm))
        except PlanningError as error:
            if error.code not in NO_WAY:
                raise
            self.say("stays beside the hand", arm=arm, why=str(error))  # which may clear the way as it goes on

    def _take_lifted(self, arm: str, no_grasp: PlanningError) -> LeafSteps:
        """Grip the connector whose cable an arm holds; where that fails the arm brings it elsewhere first.

        At last it stays elsewhere: what falls from there may lie where it can be taken.
        """
        for left in reversed(range(self.parameters.places)):
            hanging = yield from self._look_at_hanging()
            try:
                if hanging is None:
                    raise no_grasp
                yield from self._take(hanging, arm)
                return
            except PlanningError as error:
                if error.code not in (*NO_WAY, *NO_GRASP, CauseCode.GRASP_EMPTY):
                    raise
                self.say("brought elsewhere by its cable", arm=arm, why=str(error))
                yield from self.ask(self.services.motion.bring_cable(arm, hanging))
                if not left:
                    raise

    def _look_at_hanging(self) -> Generator[Request[Any] | None, None, "RigidTransform | None"]:
        """Where a connector hangs whose cable an arm holds (world_from_connector); None where it is not seen."""
        perception = self.services.perception
        yield from self.wait(self.parameters.hang_time)
        looked = yield from self.ask(perception.watch(self.overview, self.parameters.look_time, later=True))
        return perception.fuse(looked.estimates).world_from_connector if looked.estimates else None
