"""Bring the held connector in front of the stow clip, and into it."""

from collections.abc import Generator
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from regrasp.behaviors.cable.hand import HANDLING_ARM, HandLeaf
from regrasp.behaviors.leaf import LeafFailed, LeafSteps
from regrasp.interfaces.cause import CauseCode
from regrasp.motion.task import MotionTask
from regrasp.perception.pose.estimate import Estimate
from regrasp.perception.pose.fusion import fuse

if TYPE_CHECKING:
    from scipy.spatial.transform import RigidTransform


@dataclass(frozen=True)
class CarryParameters:
    """Where the hand stops in front of the clip, and how fast it goes there."""

    # m in front of the clip along the hand's own axis, from where it goes straight in; more would press the cable
    insert_distance: float = 0.025
    speed: float = 0.5  # share of the joints' speed; choice
    margin: float = 0.0  # m of clearance in front of the clip and on the straight path in; choice
    rolls: int = 36  # angles about the connector's axis that are tried; choice: every 10 degrees
    line_step: float = 0.01  # m between the waypoints of the straight path in that is checked; choice


@dataclass(frozen=True)
class InsertParameters:
    """How the connector is looked at in the hand, and how it is inserted."""

    speed: float = 0.2  # share of the joints' speed; choice
    look_time: float = 0.8  # s of looking; choice
    seat_time: float = 0.6  # s of waiting; the clip's lips take 0.2 s to close
    rolls: int = 361  # angles about the connector's axis from which the roll is chosen; choice: every degree
    whole_share: float = 0.9  # of the length; choice: the visible part's middle is then within 5 mm of the whole's
    min_extent: float = 0.04  # m; a shorter visible part says too little of the axis
    max_shift: float = 0.06  # m; what is seen further off its believed place in the hand is a false detection


class Carry(HandLeaf):
    """Plans the held connector's path to a place in front of the clip and follows it."""

    parameters: ClassVar[CarryParameters] = CarryParameters()

    def steps(self) -> LeafSteps:
        """See the class."""
        from scipy.spatial.transform import RigidTransform

        motion, held = self.services.motion, self.held()
        distance = self.parameters.insert_distance
        in_and_out = (distance, distance - self.hand.retreats[0])
        onward = [RigidTransform.from_translation([x, 0.0, 0.0]) for x in in_and_out]
        yield motion.carry(HANDLING_ARM, self._goals(held), held, onward=onward, speed=self.parameters.speed)

    def _goals(self, held: "RigidTransform") -> "list[RigidTransform]":
        """Hand poses (world_from_tool) in front of the clip from which a straight path in is free, the best first.

        Raises LeafFailed OUT_OF_REACH when there is none.
        """
        from regrasp.motion.cable.seating import poses_before

        motion, values = self.services.motion, self.parameters
        distance, margin, step = values.insert_distance, values.margin, values.line_step
        goals = poses_before(
            motion, HANDLING_ARM, held, distance=distance, rolls=values.rolls, margin=margin, step=step
        )
        if not goals:
            raise LeafFailed(CauseCode.OUT_OF_REACH, "no free hand pose brings the held connector into the clip")
        return goals


class Insert(HandLeaf):
    """Looks how the connector lies in the hand, and brings it straight into the clip."""

    parameters: ClassVar[InsertParameters] = InsertParameters()

    def steps(self) -> LeafSteps:
        """See the class."""
        motion = self.services.motion
        yield from self._look()
        yield motion.straight(HANDLING_ARM, self._seated(self.held()), speed=self.parameters.speed)
        yield from self.wait(self.parameters.seat_time)

    def _look(self) -> LeafSteps:
        """Correct the belief of how the connector lies in the hand by what the rear camera sees of it."""
        from regrasp.motion.cable.seating import connector_axis, pose_in_hand

        belief, motion = self.services.belief, self.services.motion
        seen = yield from self._estimates()
        long = [e for e in seen if e.extent >= self.parameters.min_extent]
        if not long or belief.held is None:
            self.say("the hand hides the connector", frames=len(seen))
            return
        best = fuse(long)
        # Where the fingers hide a part, the visible rest seems to end there. Unless the whole length shows it is not
        # known where on the connector that rest lies.
        whole = best.extent > self.parameters.whole_share * self.services.known.cable.connector.length
        found = pose_in_hand(motion.tool(HANDLING_ARM).inv() * best.world_from_connector, belief.held, whole=whole)
        shift = float(np.linalg.norm(found.translation - belief.held.translation))
        cosine = connector_axis(found) @ connector_axis(belief.held)
        turn = float(np.rad2deg(np.arccos(np.clip(cosine, -1.0, 1.0))))
        trusted = shift < self.parameters.max_shift
        self.say("connector in the hand", whole=whole, shift=round(shift, 4), turn_deg=round(turn, 1), trusted=trusted)
        if trusted:
            belief.held = found

    def _estimates(self) -> Generator[MotionTask | None, None, list[Estimate]]:
        """Estimates by the rear camera, one a frame, of the frames taken while it looks."""
        clock, perception, seconds = self.services.clock, self.services.perception, self.parameters.look_time
        seen: dict[float, Estimate] = {}
        end = clock.now() + seconds
        while clock.now() < end - 1e-9:
            yield None
            result = perception.look("rear")
            if isinstance(result, Estimate) and result.stamp > end - seconds:
                seen[result.stamp] = result
        return list(seen.values())

    def _seated(self, held: "RigidTransform") -> "RigidTransform":
        """world_from_tool that seats the held connector, with the roll that turns the hand least."""
        from regrasp.motion.cable.seating import seated_pose

        tool = self.services.motion.tool(HANDLING_ARM)
        return seated_pose(tool, self.services.known.cable.clip, held, self.parameters.rolls)
