"""Steps of the handling arm that several leaves share."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from numpy.typing import NDArray

from regrasp.behaviors.leaf import LeafFailed, LeafSteps, StepsLeaf
from regrasp.interfaces.cable.cause import CableCause
from regrasp.interfaces.cause import CauseCode
from regrasp.motion.failure import PlanningError
from regrasp.perception.tracking.slip import GapTest

if TYPE_CHECKING:
    from scipy.spatial.transform import RigidTransform

# The thesis's fixed roles of the two arms.
HANDLING_ARM = "right"  # handles the cable
CAMERA_ARM = "left"  # carries the wrist camera


@dataclass(frozen=True)
class HandParameters:
    """How the hand grips and draws back."""

    grip_force: float = 40.0  # N a finger; choice
    close_time: float = 1.0  # s; the jaw closes from 60 mm at 0.1 m/s a finger, and the readings settle
    close_attempts: int = 3  # times that a jaw which does not move is told to close; choice
    moved: float = 0.003  # m that a jaw must move to count as moved: three times the encoder's backlash
    # m straight back from where something was held; the first that is free; choice
    retreats: tuple[float, ...] = (0.10, 0.08, 0.06, 0.05, 0.04, 0.03)


class HandLeaf(StepsLeaf):
    """A leaf in which the handling arm works."""

    hand: ClassVar[HandParameters] = HandParameters()

    def held(self) -> "RigidTransform":
        """tool_from_connector as believed. Raises `LeafFailed` when `DetectSlip` has just noticed a loss."""
        held = self.services.belief.held
        if held is None:
            raise LeafFailed(CableCause.SLIPPED, "the hand holds nothing any more")
        return held

    def rear_point_cloud(self, since: float) -> NDArray[np.float64] | None:
        """Points (n, 3) m in the world that the rear camera saw from second `since` on; None until a picture comes."""
        return self.services.perception.surface("rear", since)

    def grip(self, world_from_connector: "RigidTransform") -> LeafSteps:
        """Close the jaw and tell by its gap whether something is in it; then the belief is that it holds the connector.

        Raises LeafFailed GRASP_EMPTY when the jaw closes on nothing, PlanningError when it does not move.
        """
        services, hand = self.services, self.hand
        jaw = services.motion.grippers[HANDLING_ARM]
        before = jaw.reading().gap
        for _ in range(hand.close_attempts):
            jaw.close(hand.grip_force)
            test = GapTest(2 * services.known.cable.connector.radius)
            end = services.clock.now() + hand.close_time
            while services.clock.now() < end - 1e-9:
                test.feed(jaw.reading())
                yield None
            evidence = test.evidence()
            stood = evidence.detected and evidence.value > before - hand.moved
            if not stood:
                break
        if stood:
            message = (
                f"the right jaw stands {1e3 * evidence.value:.1f} mm open, told {hand.close_attempts} times to close"
            )
            raise services.motion.give_up(HANDLING_ARM, CauseCode.GRIPPER_FAILED, message)
        if evidence.detected:
            raise LeafFailed(CauseCode.GRASP_EMPTY, f"the jaw closed on nothing: {evidence.sentence}")
        services.belief.held = services.motion.tool(HANDLING_ARM).inv() * world_from_connector
        self.say("grasped", gap=evidence.value)

    def open_jaw(self) -> None:
        """Tell the jaw to open, without waiting for it."""
        motion = self.services.motion
        motion.grippers[HANDLING_ARM].open(motion.parameters.execution.jaw.open_gap)

    def draw_back(self) -> LeafSteps:
        """Draw the hand straight back as far as is free. Where no distance is free, only an event says so."""
        motion = self.services.motion
        why = ""
        for distance in self.hand.retreats:
            try:
                yield from self.follow(
                    motion.shift(HANDLING_ARM, motion.tool(HANDLING_ARM).rotation.apply([-distance, 0.0, 0.0]))
                )
                return
            except PlanningError as error:
                why = str(error)
        self.say("left out", why=why)

    def go_to_sleep(self, arm: str) -> LeafSteps:
        """Bring an arm to its sleep pose, out of the cameras' and the other arm's way."""
        yield from self.follow(self.services.motion.move(arm, np.array([self.services.known.arm(arm).sleep])))
