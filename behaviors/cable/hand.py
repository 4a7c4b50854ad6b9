"""Small steps of the right hand that several states share."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform

from regrasp.behaviors.leaf import LeafFailed, LeafSteps, StepsLeaf
from regrasp.interfaces.cause import CauseCode
from regrasp.motion.failure import PlanningError
from regrasp.perception.tracking.slip import GapTest

HANDLING_ARM = "right"  # the thesis's fixed roles: the right arm handles the cable ...
CAMERA_ARM = "left"  # ... and the left one carries the wrist camera
GRIP_FORCE = 40.0  # N a finger
CLOSE_SECONDS = 1.0  # the jaw closes from 60 mm at 0.1 m/s a finger, and the readings settle
CLOSINGS = 3  # a jaw that does not move is told again
MOVED = 0.003  # m: three times the encoder's backlash
# m of straight way back from a place where something was held, the first that goes
BACK = (0.10, 0.08, 0.06, 0.05, 0.04, 0.03)


class HandLeaf(StepsLeaf):
    """A state in which the right hand works."""

    def held(self) -> RigidTransform:
        """tool_from_connector as believed. Raises `LeafFailed` when the watch beside this leaf has just noticed a loss."""
        held = self.services.belief.held
        if held is None:
            raise LeafFailed(CauseCode.SLIPPED, "the hand holds nothing any more")
        return held

    def seen(self, since: float) -> NDArray[np.float64] | None:
        """What the rear camera sees of the hand and around it: `regrasp.motion.service.Seen`."""
        return self.services.perception.surface("rear", since)

    def grip(self, world_from_connector: RigidTransform) -> LeafSteps:
        """Close the jaw and feel whether something is in it; belief: held as it was thought to lie."""
        services = self.services
        jaw = services.motion.grippers[HANDLING_ARM]
        before = jaw.reading().gap
        for _ in range(CLOSINGS):
            jaw.close(GRIP_FORCE)
            test = GapTest(2 * services.known.connector.radius)
            end = services.clock.now() + CLOSE_SECONDS
            while services.clock.now() < end - 1e-9:
                test.feed(jaw.reading())
                yield None
            evidence = test.evidence()
            stood = evidence.detected and evidence.value > before - MOVED
            if not stood:
                break
        if stood:
            message = f"the right jaw stands {1e3 * evidence.value:.1f} mm open, told {CLOSINGS} times to close"
            raise services.motion.give_up(HANDLING_ARM, CauseCode.GRIPPER_FAILED, message)
        if evidence.detected:
            raise LeafFailed(CauseCode.GRASP_EMPTY, f"the jaw closed on nothing: {evidence.sentence}")
        services.belief.held = services.motion.tool(HANDLING_ARM).inv() * world_from_connector
        self.say("grasped", gap=evidence.value)

    def draw_back(self) -> LeafSteps:
        """Draw the hand straight back as far as may be; left out (and said once) where no distance is free."""
        motion = self.services.motion
        why = ""
        for distance in BACK:
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
