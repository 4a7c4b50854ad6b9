"""Bring the held connector before the stow clip, and into it."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform, Rotation

from regrasp.behaviors.cable.hand import BACK, HANDLING_ARM, HandLeaf
from regrasp.behaviors.leaf import LeafFailed, LeafSteps
from regrasp.interfaces.cause import CauseCode
from regrasp.motion.failure import PlanningError
from regrasp.motion.planning.straight import straight_line
from regrasp.motion.robots.kinematics import ArmKinematics
from regrasp.motion.scene.collision import CollisionModel
from regrasp.perception.pose.estimate import Estimate
from regrasp.perception.pose.fusion import fuse

# m before the clip along the hand's own axis, from where it goes straight in; more would press the cable
BEFORE = 0.025
CARRY_SPEED = 0.5
INSERT_SPEED = 0.2
LOOK_SECONDS = 0.8
SEATED_SECONDS = 0.6  # the clip's lips take 0.2 s to close
WAY_MARGIN = 0.0
ROLLS = 36
WHOLE_SHARE = 0.9  # of the length; choice: the visible part's middle is then within 5 mm of the whole's
LONG_ENOUGH = 0.04  # m: a shorter visible part says too little of the axis
TRUSTED_SHIFT = 0.06  # m: what is seen further off its place in the hand than this is a false look


class Carry(HandLeaf):
    """Plans the held connector's way to a place before the clip and follows it."""

    def steps(self) -> LeafSteps:
        """See the class."""
        motion, held = self.services.motion, self.held()
        in_and_out = (BEFORE, BEFORE - BACK[0])
        onward = [RigidTransform.from_translation([x, 0.0, 0.0]) for x in in_and_out]
        yield motion.carry(HANDLING_ARM, self._goals(held), held, onward=onward, speed=CARRY_SPEED)

    def _goals(self, held: RigidTransform) -> list[RigidTransform]:
        """Hand poses before the clip from which a straight way in is free, any roll about the connector's axis.

        Those that turn the hand least come first.
        """
        motion, clip = self.services.motion, self.services.known.clip
        model, near = motion.model(HANDLING_ARM, held=held), motion.model(HANDLING_ARM, clip=False)
        kin = motion.kinematics[HANDLING_ARM]
        goals = []
        for roll in np.linspace(-np.pi, np.pi, ROLLS, endpoint=False):
            seated = clip.world_from_seat * RigidTransform.from_rotation(Rotation.from_euler("x", roll)) * held.inv()
            before = seated * RigidTransform.from_translation([-BEFORE, 0.0, 0.0])
            if any(_straight_in(kin, near, q, seated) for q in kin.ik(before) if model.free(q, WAY_MARGIN)):
                goals.append(before)
        if not goals:
            raise LeafFailed(CauseCode.OUT_OF_REACH, "no free hand pose brings the held connector into the clip")
        now = motion.tool(HANDLING_ARM).rotation.inv()
        return sorted(goals, key=lambda pose: float((now * pose.rotation).magnitude()))


def _straight_in(kin: ArmKinematics, near: CollisionModel, q: NDArray[np.float64], seated: RigidTransform) -> bool:
    """Whether a free straight way leads from joints (6,) to the pose that seats the connector."""
    try:
        return near.path_free(straight_line(kin, q, seated, 0.01), WAY_MARGIN)
    except PlanningError:
        return False


class Insert(HandLeaf):
    """Looks how the connector lies in the hand, and brings it straight into the clip."""

    def steps(self) -> LeafSteps:
        """See the class."""
        motion = self.services.motion
        yield from self._look()
        yield motion.straight(HANDLING_ARM, self._seated(self.held()), speed=INSERT_SPEED)
        yield from self.wait(SEATED_SECONDS)

    def _look(self) -> LeafSteps:
        """Correct the belief of how the connector lies in the hand by what the rear camera sees of it."""
        clock, perception, belief = self.services.clock, self.services.perception, self.services.belief
        seen: dict[float, Estimate] = {}
        end = clock.now() + LOOK_SECONDS
        while clock.now() < end - 1e-9:
            yield None
            result = perception.look("rear")
            if isinstance(result, Estimate) and result.stamp > end - LOOK_SECONDS:
                seen[result.stamp] = result
        long = [e for e in seen.values() if e.extent >= LONG_ENOUGH]
        if not long or belief.held is None:
            self.say("the hand hides the connector", frames=len(seen))
            return
        mean = fuse(long)
        found = self.services.motion.tool(HANDLING_ARM).inv() * mean.world_from_connector
        if _axis(found) @ _axis(belief.held) < 0:  # a finger was taken for the cable: no connector turns round in a jaw
            found = found * RigidTransform.from_rotation(Rotation.from_euler("z", 180, degrees=True))
        # The fingers end the visible part as an end of its own would: unless all of the length shows, where the part
        # lies on it is a guess.
        whole = mean.extent > WHOLE_SHARE * self.services.known.connector.length
        if not whole:
            found = _turned_in_the_jaw(belief.held, found)
        shift = float(np.linalg.norm(found.translation - belief.held.translation))
        turn = float(np.rad2deg(np.arccos(np.clip(_axis(found) @ _axis(belief.held), -1.0, 1.0))))
        trusted = shift < TRUSTED_SHIFT
        self.say("connector in the hand", whole=whole, shift=round(shift, 4), turn_deg=round(turn, 1), trusted=trusted)
        if trusted:
            belief.held = found

    def _seated(self, held: RigidTransform) -> RigidTransform:
        """world_from_tool that seats the held connector, with the roll that turns the hand least."""
        tool, seat = self.services.motion.tool(HANDLING_ARM), self.services.known.clip.world_from_seat
        rolls = [RigidTransform.from_rotation(Rotation.from_euler("x", r)) for r in np.linspace(-np.pi, np.pi, 361)]
        poses = [seat * roll * held.inv() for roll in rolls]
        return min(poses, key=lambda pose: float((tool.rotation.inv() * pose.rotation).magnitude()))


def _turned_in_the_jaw(held: RigidTransform, seen: RigidTransform) -> RigidTransform:
    """tool_from_connector when only a part is `seen`, so that its axis is known but not where its centre lies on it.

    A cable turns the connector between the pads and does not draw it through: the pads stay at the place along it where
    they were believed to be, `held`.
    """
    axis = _axis(seen)
    nearest = seen.translation - (seen.translation @ axis) * axis
    pads_at = -float(held.translation @ _axis(held))
    return RigidTransform.from_components(nearest - pads_at * axis, seen.rotation)


def _axis(pose: RigidTransform) -> NDArray[np.float64]:
    return np.asarray(pose.rotation.apply([1.0, 0.0, 0.0]))
