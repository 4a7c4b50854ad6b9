"""Requests that cannot be done, by construction, each with the cause that the motion service must name."""

import re
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation

from regrasp.app.tasks.cable.studies.motion.clutter import ClutteredCell, draw_pieces, piece_at
from regrasp.app.tasks.cable.studies.motion.queries import NoQuery, QueryParameters, lost_end
from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cable.cell import CableCell
from regrasp.interfaces.cause import CauseCode
from regrasp.interfaces.cell import Box
from regrasp.interfaces.request import Request
from regrasp.interfaces.scene import Obstacle
from regrasp.motion.robots.kinematics import ArmKinematics
from regrasp.motion.scene.collision import CollisionModel


@dataclass(frozen=True, eq=False)
class Infeasible:
    """A request that cannot be done; `cause` and `pattern` are what its error must say, numbers included."""

    kind: str
    cell: ClutteredCell
    ask: Callable[[], Request[None]]
    cause: CauseCode
    pattern: str

    def is_named(self, code: str, message: str) -> bool:
        """Whether an error's code and sentence name the cause."""
        return code == self.cause and re.search(self.pattern, message) is not None


@dataclass(frozen=True)
class InfeasibleParameters:
    """How what cannot be done is made, in m where nothing else is said. All are choices."""

    beyond: tuple[float, float] = (1.05, 2.0)  # times the length of an arm's links
    box_gap: float = 0.02  # between a connector and the foam box round it
    box_wall: float = 0.03
    depth: float = 0.02  # by which a tool is inside a thing at least
    # Walls in a vertical plane through the waist's axis, on either side of a gap, and a lid over the gap
    wall_thickness: float = 0.02
    wall_gap: float = 0.10  # from the waist's axis to the walls
    wall_width: float = 0.24
    wall_height: float = 0.46  # from the floor
    lid: float = 0.28  # from the floor to the lid; the shoulder is at 0.127
    wall_turn: tuple[float, float] = (0.0, 0.8)  # rad of the waist, from straight ahead to the walls, on either side
    goal_turn: tuple[float, float] = (0.4, 1.2)  # rad of the waist, from the walls to the start and to the goal
    tries: int = 300  # draws


Make = Callable[[CableCell, np.random.Generator, InfeasibleParameters], Infeasible]


def draw_infeasible(
    cell: CableCell, kind: str, rng: np.random.Generator, parameters: InfeasibleParameters = InfeasibleParameters()
) -> Infeasible:
    """A request of a kind (a key of `INFEASIBLE`) in a cell of its own. Raises ValueError if none is found."""
    for _ in range(parameters.tries):
        try:
            return INFEASIBLE[kind](cell, rng, parameters)
        except NoQuery:
            continue
    raise ValueError(f"no request of the kind {kind!r} in {parameters.tries} draws")


def _out_of_reach(cell: CableCell, rng: np.random.Generator, parameters: InfeasibleParameters) -> Infeasible:
    """A lost end, or a pose of a tool, farther from the arm's base than all its links in a line."""
    cluttered = _cluttered(cell, rng)
    motion = cluttered.motion
    arm = motion.hand
    kin = motion.kinematics[arm]
    way = rng.normal(size=3)
    place = kin.base[:3, 3] + way / np.linalg.norm(way) * kin.reach * rng.uniform(*parameters.beyond)
    pose = RigidTransform.from_components(place, Rotation.random(rng=rng))
    pick = rng.random() < 0.5
    return Infeasible(
        "out of reach",
        cluttered,
        lambda: motion.pick_loose(pose) if pick else motion.move_tool(arm, pose),
        CauseCode.OUT_OF_REACH,
        rf"{np.linalg.norm(place - kin.base[:3, 3]):.2f} m from its base, and its links measure {kin.reach:.2f} m",
    )


def _goal_in_collision(cell: CableCell, rng: np.random.Generator, parameters: InfeasibleParameters) -> Infeasible:
    """The tool inside a piece of foam, or a box of the cell."""
    cluttered = _cluttered(cell, rng)
    motion = cluttered.motion
    arm = str(rng.choice(list(cluttered.arms)))
    things = [(piece.box, piece.yaw) for piece in cluttered.pieces] + [(box, 0.0) for box in cell.known.boxes]
    pose = _inside(*things[rng.integers(len(things))], rng, parameters.depth)
    goals = motion.kinematics[arm].ik(pose)
    if not len(goals):
        raise NoQuery
    by_joints = rng.random() < 0.5
    return Infeasible(
        "goal in collision",
        cluttered,
        lambda: motion.move(arm, goals) if by_joints else motion.move_tool(arm, pose),
        CauseCode.NO_COLLISION_FREE_GOAL,
        r"none of \d+ goals keeps \d+ mm: the best has -\d+ mm to \w+",
    )


def _no_grasp(cell: CableCell, rng: np.random.Generator, parameters: InfeasibleParameters) -> Infeasible:
    """A lost end in a closed box of foam."""
    lost = lost_end(rng, QueryParameters(tilt=0.0))
    connector = cell.known.cable.connector
    inner = np.array([connector.length, 2 * connector.radius, 2 * connector.radius]) + 2 * parameters.box_gap
    pieces = _closed_box(lost, inner, parameters.box_wall)
    cluttered = ClutteredCell(cell.known, pieces, int(rng.integers(2**31)))
    motion = cluttered.motion
    return Infeasible(
        "no free grasp",
        cluttered,
        lambda: motion.pick_loose(lost),
        CauseCode.NO_COLLISION_FREE_GOAL,
        r"\d+ grasp candidates: .*\d+ .*seen surface",
    )


def _start_in_collision(cell: CableCell, rng: np.random.Generator, parameters: InfeasibleParameters) -> Infeasible:
    """The tool stands inside a box of the cell. (In foam it may: what is seen where an arm stands is forgotten.)"""
    cluttered = _cluttered(cell, rng)
    motion = cluttered.motion
    arm = str(rng.choice(list(cluttered.arms)))
    pose = _inside(cell.known.boxes[rng.integers(len(cell.known.boxes))], 0.0, rng, parameters.depth)
    standing = motion.kinematics[arm].ik(pose)
    if not len(standing):
        raise NoQuery
    cluttered.arms[arm].positions = standing[rng.integers(len(standing))]
    return Infeasible(
        "start in collision",
        cluttered,
        lambda: motion.sleep(arm),
        CauseCode.MOTION_BLOCKED,
        r"the arm touches \w+, \d+ mm deep",
    )


def _walled_in(cell: CableCell, rng: np.random.Generator, parameters: InfeasibleParameters) -> Infeasible:
    """A free goal behind foam through which the upper arm must pass, whatever the other joints do: `crosses_foam`."""
    hand = cell.known.cable.hand
    turn = float(rng.choice([-1.0, 1.0]) * rng.uniform(*parameters.wall_turn))
    pieces = _walls(cell.known.arm(hand).world_from_base.translation, turn, parameters)
    cluttered = ClutteredCell(cell.known, pieces, int(rng.integers(2**31)))
    motion = cluttered.motion
    model, margin = motion.model(hand), motion.parameters.clearances.margin
    if not crosses_foam(model.kinematics, pieces, turn):
        raise NoQuery
    start, goal = (_free_beyond(model, turn, side, margin, rng, parameters) for side in (-1.0, 1.0))
    cluttered.arms[hand].positions = start
    return Infeasible(
        "walled in",
        cluttered,
        lambda: motion.move(hand, goal[None]),
        CauseCode.PLANNING_FAILED,
        r"no path to 1 goals at \d+ mm margin in \d+ checked configurations",
    )


INFEASIBLE: dict[str, Make] = {
    "out of reach": _out_of_reach,
    "goal in collision": _goal_in_collision,
    "no free grasp": _no_grasp,
    "start in collision": _start_in_collision,
    "walled in": _walled_in,
}


def _free_beyond(
    model: CollisionModel,
    waist: float,
    side: float,
    margin: float,
    rng: np.random.Generator,
    parameters: InfeasibleParameters,
) -> FloatArray:
    """Free joints (n,) rad with the waist turned past an angle (rad), to the left (1.0) or right (-1.0) of it."""
    lower, upper = model.kinematics.lower, model.kinematics.upper
    for _ in range(parameters.tries):
        q = rng.uniform(lower, upper)
        q[0] = waist + side * rng.uniform(*parameters.goal_turn)
        if model.free(q, margin):
            return np.asarray(q)
    raise NoQuery


def crosses_foam(kin: ArmKinematics, pieces: tuple[Obstacle, ...], waist: float, step: float = 0.002) -> bool:
    """Whether the upper arm's middle line is inside foam at this waist angle (rad) for every angle of the shoulder.

    The upper arm, from the shoulder's axis to the elbow's, depends on these two joints alone, and the waist's limits
    let it not turn round. So a path between two waist angles on either side of `waist` meets foam, whatever it does
    else. The shoulder is tried at every `step` rad, in which a point of the upper arm moves by less than a millimetre;
    that deep a point of the line must be inside.
    """
    slack = step * float(np.linalg.norm(kin.chain.origins[2]))
    for shoulder in np.arange(kin.lower[1], kin.upper[1] + step, step):
        frames = kin.link_frames(np.array([waist, shoulder, *np.zeros(len(kin) - 2)]))
        line = np.linspace(frames[2][:3, 3], frames[3][:3, 3], 30)
        if not any(_depth(line, piece) > slack for piece in pieces):
            return False
    return True


def _depth(points: FloatArray, piece: Obstacle) -> float:
    """How deep (m) the deepest of the points (n, 3) m is inside a piece."""
    local = Rotation.from_euler("z", piece.yaw).inv().apply(points - piece.box.center)
    return float((0.5 * np.array(piece.box.size) - np.abs(local)).min(axis=1).max())


def _walls(base: FloatArray, turn: float, parameters: InfeasibleParameters) -> tuple[Obstacle, ...]:
    """Walls of foam before and behind the arm at `base` (3,) m, in the plane of that waist angle, and a lid between."""
    x, y, _ = base.tolist()
    way = np.array([np.cos(turn), np.sin(turn)])
    middle = parameters.wall_gap + 0.5 * parameters.wall_width
    wall = (parameters.wall_width, parameters.wall_thickness, parameters.wall_height)
    sides = [
        piece_at(name, (x + float(at * way[0]), y + float(at * way[1]), 0.0), wall, turn)
        for name, at in (("wall_before", middle), ("wall_behind", -middle))
    ]
    height = parameters.wall_height - parameters.lid
    lid = Box(
        name="lid",
        center=(x, y, parameters.lid + 0.5 * height),
        size=(2 * parameters.wall_gap, parameters.wall_thickness, height),
    )
    return *sides, Obstacle(lid, turn, None)


def _closed_box(middle: RigidTransform, inner: FloatArray, wall: float) -> tuple[Obstacle, ...]:
    """Six slabs `wall` m thick round a space of `inner` (3,) m about a level pose (world_from_space)."""
    yaw = float(middle.rotation.as_euler("ZYX")[0])
    pieces: list[Obstacle] = []
    for axis in range(3):
        for side in (-1.0, 1.0):
            offset, size = np.zeros(3), inner + 2 * wall
            offset[axis], size[axis] = side * 0.5 * (inner[axis] + wall), wall
            center = middle.translation + Rotation.from_euler("z", yaw).apply(offset)
            box = Box(name=f"slab_{len(pieces)}", center=tuple(center.tolist()), size=tuple(size.tolist()))
            pieces.append(Obstacle(box, yaw, None))
    return tuple(pieces)


def _inside(box: Box, yaw: float, rng: np.random.Generator, depth: float) -> RigidTransform:
    """A random pose inside a box, `depth` m below its faces where it is thick enough."""
    room = np.maximum(0.5 * np.array(box.size) - depth, 0.0)
    place = box.center + Rotation.from_euler("z", yaw).apply(rng.uniform(-room, room))
    return RigidTransform.from_components(place, Rotation.random(rng=rng))


def _cluttered(cell: CableCell, rng: np.random.Generator) -> ClutteredCell:
    return ClutteredCell(cell.known, draw_pieces(cell, rng), int(rng.integers(2**31)))
