"""Steps that several of the cable's leaves share: looking, and what the hand does."""

from typing import TYPE_CHECKING, TypeVar

from regrasp.behaviors.cable.keys import HELD
from regrasp.behaviors.cable.services import CableServices
from regrasp.behaviors.leaf import LeafFailed, LeafSteps, StepsLeaf
from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cable.cause import CableCause

if TYPE_CHECKING:
    from scipy.spatial.transform import RigidTransform

T = TypeVar("T")


class CableLeaf(StepsLeaf):
    """A leaf of steps with the cable's services."""

    services: CableServices

    @property
    def hand(self) -> str:
        """The arm that handles the cable."""
        return self.services.known.cable.hand

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

    def go_to_sleep(self, arm: str) -> LeafSteps:
        """Bring an arm to its sleep pose, out of the cameras' and the other arm's way."""
        yield from self.ask(self.services.motion.sleep(arm))


class HandLeaf(CableLeaf):
    """A leaf in which the hand works. One that asks for `held` NEEDS the key HELD, one that grips WRITES it."""

    def held(self) -> "RigidTransform":
        """tool_from_connector as believed. Raises `LeafFailed` when `DetectSlip` has just noticed a loss."""
        held = self.read(HELD, None)
        if held is None:
            raise LeafFailed(CableCause.SLIPPED, "the hand holds nothing any more")
        return held

    def grip(self, world_from_connector: "RigidTransform") -> LeafSteps:
        """Close the jaw; then the belief is that it holds the connector. Raises PlanningError when it does not."""
        grip = yield from self.ask(self.services.motion.grip(world_from_connector))
        self.write(HELD, grip.pose)
        self.say("grasped", gap=grip.gap)

    def draw_back(self) -> LeafSteps:
        """Draw the hand straight back as far as is free. Where no distance is free, only an event says so."""
        why = yield from self.ask(self.services.motion.draw_back())
        if why:
            self.say("left out", why=why)
