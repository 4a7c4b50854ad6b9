"""How a hand brings the connector that it holds into a clip or a socket."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.wall_time import counts_as
from regrasp.motion.planning.straight import straight_lines
from regrasp.motion.robots.kinematics import ArmKinematics
from regrasp.motion.robots.poses import angle_between
from regrasp.motion.scene.collision import CollisionModel


@dataclass(frozen=True)
class SeatingParameters:
    """Where the hand stops in front of the clip, and how it goes in."""

    # m in front of the clip along the hand's own axis, from where it goes straight in; more would press the cable
    distance: float = 0.025
    # m back from where the clip did not hold: its lips take again only what was 30 mm from the seat, and the hand may
    # have been 15 mm too deep
    clear: float = 0.045
    margin: float = 0.0  # m of clearance in front of the clip and on the straight path in; choice
    rolls: int = 36  # angles about the connector's axis that are tried; choice: every 10 degrees
    line_step: float = 0.01  # m between the waypoints of the straight path in that is checked; choice
    fine_rolls: int = 361  # angles about the axis from which the roll in the clip is chosen; choice: every degree
    # share of the joints' speed on the way there: twice as fast, a foam block is pressed with twice the force; choice
    speed_to: float = 0.35
    speed_in: float = 0.2  # share of the joints' speed on the way in; choice
    # Ways in which the connector may lie in the hand other than believed, one a try: m nearer to the finger tips, and
    # degrees about the pads' normal. The clip's lips take what is 20 mm and 20 degrees off; choice
    tries: tuple[tuple[float, float], ...] = (
        (0.0, 0.0),
        (-0.015, 0.0),
        (0.015, 0.0),
        (0.0, 20.0),
        (0.0, -20.0),
    )

    @property
    def straight_in(self) -> list[FloatArray]:
        """The only corner of the way into the clip: straight before where the hand ends, in its frame."""
        return [np.array([-self.distance, 0.0, 0.0])]


@counts_as("planning")
def poses_before(
    models: tuple[CollisionModel, CollisionModel],
    q: FloatArray,
    seat: RigidTransform,
    held: RigidTransform,
    back: Sequence[FloatArray],
    parameters: SeatingParameters = SeatingParameters(),
) -> list[RigidTransform]:
    """Hand poses (world_from_tool) from which a free way leads straight in to a seat, the best first.

    `models` are the hand's collision models on the way there, with what it holds, and on the way in. It stands at
    joints `q` (n,) rad and holds the connector so (`held`: tool_from_connector), which belongs at `seat`
    (world_from_connector). The way in has its corners `back` (3,) m from where the hand ends, in the hand's frame, the
    furthest first. Those poses come first that turn it least.
    """
    model, near = models
    kin, margin = model.kinematics, parameters.margin
    goals = []
    for seated in _seated_poses(seat, held, np.linspace(-np.pi, np.pi, parameters.rolls, endpoint=False)):
        before, *way = [_displaced(seated, corner) for corner in (*back, np.zeros(3))]
        starts = (start for start in kin.ik(before, q) if model.free(start, margin))
        if any(_free_way(kin, near, start, way, margin, parameters.line_step) for start in starts):
            goals.append(before)
    now = kin.tool_matrix(q)
    goals.sort(key=lambda pose: angle_between(now, pose))
    return [RigidTransform.from_matrix(pose) for pose in goals]


def _displaced(pose: FloatArray, displacement: FloatArray) -> FloatArray:
    """The pose (4, 4) after a displacement (3,) m in its own frame."""
    displaced = pose.copy()
    displaced[:3, 3] += pose[:3, :3] @ displacement
    return displaced


def _free_way(
    kin: ArmKinematics, near: CollisionModel, q: FloatArray, way: Sequence[FloatArray], margin: float, step: float
) -> bool:
    """Whether straight lines from joints (n,) through poses (4, 4) are free."""
    path = straight_lines(kin, q, way, step)
    return path is not None and near.path_free(path, margin)


@counts_as("planning")
def seated_pose(tool: RigidTransform, seat: RigidTransform, held: RigidTransform, rolls: int) -> RigidTransform:
    """world_from_tool that brings the held connector to `seat`, with the one of so many `rolls` that turns it least.

    `tool` is world_from_tool now, `held` is tool_from_connector, `seat` is world_from_connector.
    """
    now = tool.as_matrix()
    poses = _seated_poses(seat, held, np.linspace(-np.pi, np.pi, rolls))
    return RigidTransform.from_matrix(min(poses, key=lambda pose: angle_between(now, pose)))


def lying_otherwise(held: RigidTransform, outwards: float, turn_deg: float) -> RigidTransform:
    """tool_from_connector of one that lies so much nearer (m) to the finger tips than `held`, and turned in the jaw."""
    turn = Rotation.from_euler("y", turn_deg, degrees=True)
    return RigidTransform.from_components(held.translation + np.array([outwards, 0.0, 0.0]), turn * held.rotation)


def _seated_poses(seat: RigidTransform, held: RigidTransform, rolls: FloatArray) -> FloatArray:
    """world_from_tool (n, 4, 4) that seat the connector, `held` (tool_from_connector), turned by `rolls` (n,) rad."""
    turns = np.zeros((len(rolls), 4, 4))
    turns[:, :3, :3] = Rotation.from_euler("x", rolls[:, None]).as_matrix()
    turns[:, 3, 3] = 1.0
    return np.asarray(seat.as_matrix() @ turns @ held.inv().as_matrix())
