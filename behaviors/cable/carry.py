"""Bring the held connector in front of the stow clip, and into it."""

from collections.abc import Generator
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform, Rotation

from regrasp.behaviors.cable.hand import HANDLING_ARM, HandLeaf
from regrasp.behaviors.leaf import LeafFailed, LeafSteps
from regrasp.interfaces.cause import CauseCode
from regrasp.interfaces.cell import Clip
from regrasp.interfaces.wall_time import counts_as
from regrasp.motion.failure import PlanningError
from regrasp.motion.planning.straight import straight_line
from regrasp.motion.robots.kinematics import ArmKinematics
from regrasp.motion.robots.poses import angle_between
from regrasp.motion.scene.collision import CollisionModel
from regrasp.motion.task import MotionTask
from regrasp.perception.pose.estimate import Estimate
from regrasp.perception.pose.fusion import fuse


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
        motion, held = self.services.motion, self.held()
        distance = self.parameters.insert_distance
        in_and_out = (distance, distance - self.hand.retreats[0])
        onward = [RigidTransform.from_translation([x, 0.0, 0.0]) for x in in_and_out]
        yield motion.carry(HANDLING_ARM, self._goals(held), held, onward=onward, speed=self.parameters.speed)

    @counts_as("planning")
    def _goals(self, held: RigidTransform) -> list[RigidTransform]:
        """Hand poses (world_from_tool) in front of the clip from which a straight path in is free.

        Every roll about the connector's axis is tried. Those that turn the hand least come first. Raises LeafFailed
        OUT_OF_REACH when there is none.
        """
        motion, clip, parameters = self.services.motion, self.services.known.clip, self.parameters
        model, near = motion.model(HANDLING_ARM, held=held), motion.model(HANDLING_ARM, clip=False)
        kin = motion.kinematics[HANDLING_ARM]
        goals = []
        for seated in _seated_poses(clip, held, np.linspace(-np.pi, np.pi, parameters.rolls, endpoint=False)):
            before = seated.copy()
            before[:3, 3] -= parameters.insert_distance * seated[:3, 0]
            starts = (q for q in kin.ik(before) if model.free(q, parameters.margin))
            if any(_straight_in(kin, near, q, seated, parameters) for q in starts):
                goals.append(before)
        if not goals:
            raise LeafFailed(CauseCode.OUT_OF_REACH, "no free hand pose brings the held connector into the clip")
        now = kin.tool_matrix(motion.joints(HANDLING_ARM))
        goals.sort(key=lambda pose: angle_between(now, pose))
        return [RigidTransform.from_matrix(pose) for pose in goals]


def _straight_in(
    kin: ArmKinematics,
    near: CollisionModel,
    q: NDArray[np.float64],
    seated: NDArray[np.float64],
    parameters: CarryParameters,
) -> bool:
    """Whether a free straight path leads from joints (6,) to the pose (4, 4) that seats the connector."""
    try:
        return near.path_free(straight_line(kin, q, seated, parameters.line_step), parameters.margin)
    except PlanningError:
        return False


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
        belief = self.services.belief
        seen = yield from self._estimates()
        long = [e for e in seen if e.extent >= self.parameters.min_extent]
        if not long or belief.held is None:
            self.say("the hand hides the connector", frames=len(seen))
            return
        found, whole = self._pose_in_hand(fuse(long), belief.held)
        shift = float(np.linalg.norm(found.translation - belief.held.translation))
        turn = float(np.rad2deg(np.arccos(np.clip(_axis(found) @ _axis(belief.held), -1.0, 1.0))))
        trusted = shift < self.parameters.max_shift
        self.say("connector in the hand", whole=whole, shift=round(shift, 4), turn_deg=round(turn, 1), trusted=trusted)
        if trusted:
            belief.held = found

    def _pose_in_hand(self, seen: Estimate, held: RigidTransform) -> tuple[RigidTransform, bool]:
        """tool_from_connector by what is seen of one that was `held` so, and whether the whole of it was seen."""
        found = self.services.motion.tool(HANDLING_ARM).inv() * seen.world_from_connector
        if _axis(found) @ _axis(held) < 0:  # a finger was taken for the cable: no connector turns round in a jaw
            found = found * RigidTransform.from_rotation(Rotation.from_euler("z", 180, degrees=True))
        # Where the fingers hide a part, the visible rest seems to end there. Unless the whole length shows it is not
        # known where on the connector that rest lies.
        whole = seen.extent > self.parameters.whole_share * self.services.known.connector.length
        return (found if whole else _turned_in_the_jaw(held, found)), whole

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

    @counts_as("planning")
    def _seated(self, held: RigidTransform) -> RigidTransform:
        """world_from_tool that seats the held connector, with the roll that turns the hand least."""
        tool, clip = self.services.motion.tool(HANDLING_ARM).as_matrix(), self.services.known.clip
        poses = _seated_poses(clip, held, np.linspace(-np.pi, np.pi, self.parameters.rolls))
        return RigidTransform.from_matrix(min(poses, key=lambda pose: angle_between(tool, pose)))


def _seated_poses(clip: Clip, held: RigidTransform, rolls: NDArray[np.float64]) -> NDArray[np.float64]:
    """world_from_tool (n, 4, 4) that seat the connector, `held` (tool_from_connector), turned by `rolls` (n,) rad."""
    turns = np.zeros((len(rolls), 4, 4))
    turns[:, :3, :3] = Rotation.from_euler("x", rolls[:, None]).as_matrix()
    turns[:, 3, 3] = 1.0
    return np.asarray(clip.world_from_seat.as_matrix() @ turns @ held.inv().as_matrix())


def _turned_in_the_jaw(held: RigidTransform, seen: RigidTransform) -> RigidTransform:
    """tool_from_connector when only a part of the connector is `seen`: its axis is known, its centre on it is not.

    A cable turns the connector between the pads and does not draw it through. So the pads stay at the place along the
    connector where they are by `held`.
    """
    axis = _axis(seen)
    nearest = seen.translation - (seen.translation @ axis) * axis
    pads_at = -float(held.translation @ _axis(held))
    return RigidTransform.from_components(nearest - pads_at * axis, seen.rotation)


def _axis(pose: RigidTransform) -> NDArray[np.float64]:
    """The connector's axis (3,), from cable to tip, in the pose's target frame."""
    return np.asarray(pose.rotation.apply([1.0, 0.0, 0.0]))
