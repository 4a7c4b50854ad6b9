"""One seed of the motion study: a retrieval query to our planner and birrt, or a request that cannot be done."""

import time
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from importlib.util import find_spec

import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation

from regrasp.app.studies.mesh_check import Carried, MeshCheck, Standing, Surroundings
from regrasp.app.tasks.cable.studies.motion.birrt import birrt_in
from regrasp.app.tasks.cable.studies.motion.clutter import ClutteredCell, solid_parts
from regrasp.app.tasks.cable.studies.motion.infeasible import INFEASIBLE, draw_infeasible
from regrasp.app.tasks.cable.studies.motion.queries import KINDS, Query, draw_queries
from regrasp.app.tasks.cable.studies.motion.reference import reference_path
from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cable.cell import CableCell
from regrasp.interfaces.cell import Box
from regrasp.motion.failure import PlanningError
from regrasp.motion.planning.planner import plan
from regrasp.motion.planning.timing import JointLimits, time_path

EVERY = 4  # every fourth seed is a request that cannot be done
CAMERA_SIZE = (0.025, 0.09, 0.025)  # m, of a RealSense D435i along the mount's axes
OURS, BIRRT, BIRRT_OURS = "regrasp", "birrt, PyBullet's check", "birrt, our check"


@dataclass(frozen=True)
class Answer:
    """What a planner made of a query: processor ms, and the path's length in joint space (rad), None without one."""

    plan_ms: float
    path_length_rad: float | None


@dataclass(frozen=True)
class QueryRow:
    """A query that a path is known for. `answers` by planner; `touched` names what our path touches by coal's meshes.

    `touched` is "" for nothing, and None without a path or without coal.
    """

    seed: int
    kind: str
    pieces: int
    margin_m: float
    answers: Mapping[str, Answer]
    why: str = ""  # there is no path of ours
    touched: str | None = None
    straight: int = 0  # queries drawn before, which a straight motion solves
    unproven: int = 0  # queries drawn before, for which the reference found no path ...
    unproven_solved: int = 0  # ... and ours found one

    def __str__(self) -> str:
        ours = self.answers[OURS]
        if ours.path_length_rad is None:
            return f"{self.kind}: {self.why}"
        touched = f", touches {self.touched}" if self.touched else ""
        return f"{self.kind}: {ours.path_length_rad:.2f} rad in {ours.plan_ms:.0f} ms{touched}"


@dataclass(frozen=True)
class InfeasibleRow:
    """A request that cannot be done, the cause that must be named, and the one that was."""

    seed: int
    kind: str
    pieces: int
    expected: str
    cause: str  # "" if nothing was raised
    message: str
    named: bool
    plan_ms: float

    def __str__(self) -> str:
        return f"{self.kind}: {'named' if self.named else 'NOT NAMED'}, {self.cause or 'no error'}: {self.message}"


Row = QueryRow | InfeasibleRow


@dataclass(frozen=True)
class TrialParameters:
    """What is measured besides our planner."""

    birrt: bool = field(default_factory=lambda: find_spec("pybullet_planning") is not None)
    coal: bool = field(default_factory=lambda: find_spec("coal") is not None)


def run_trial(cell: CableCell, seed: int, parameters: TrialParameters) -> list[Row]:
    """The seed's row: every fourth seed's is a request that cannot be done; the kinds take turns."""
    if seed % EVERY == EVERY - 1:
        return [infeasible_row(cell, seed, list(INFEASIBLE)[seed // EVERY % len(INFEASIBLE)])]
    return [query_row(cell, seed, list(KINDS)[seed % len(KINDS)], parameters)]


def infeasible_row(cell: CableCell, seed: int, kind: str) -> InfeasibleRow:
    """What the motion service says to a request that cannot be done."""
    request = draw_infeasible(cell, kind, np.random.default_rng([seed, 1]))
    request.cell.motion.warm_up()
    cause, message = "", "the request went on"
    began = time.thread_time()
    try:
        request.ask().poll()
    except PlanningError as error:
        cause, message = str(error.code), str(error)
    except Exception as error:
        message = f"{type(error).__name__}: {error}"
    taken = 1e3 * (time.thread_time() - began)
    named = request.is_named(cause, message)
    return InfeasibleRow(seed, kind, len(request.cell.pieces), str(request.cause), cause, message, named, taken)


def query_row(cell: CableCell, seed: int, kind: str, parameters: TrialParameters) -> QueryRow:
    """What our planner and birrt make of the seed's query; they are asked one after the other."""
    drawn = _Drawn()
    query = drawn.feasible(cell, seed, kind)
    with suppress(PlanningError):
        _plan(query, seed + 1)  # loads what is compiled
    path, why = None, ""
    began = time.thread_time()
    try:
        path = _plan(query, seed)
    except PlanningError as error:
        why = f"{error.code}: {error}"
    answers = {OURS: Answer(1e3 * (time.thread_time() - began), _length(path))}
    if parameters.birrt:
        answers |= dict(_by_birrt(cell, query, seed))
    touched = touched_by(query, path) if parameters.coal and path is not None else None
    return QueryRow(seed, kind, len(query.cell.pieces), query.margin, answers, why, touched, *drawn.counts)


@dataclass
class _Drawn:
    """The draws of a query that came to nothing: straight ones, unproven ones, and those of these that ours solves."""

    straight: int = 0
    unproven: int = 0
    unproven_solved: int = 0

    @property
    def counts(self) -> tuple[int, int, int]:
        return self.straight, self.unproven, self.unproven_solved

    def feasible(self, cell: CableCell, seed: int, kind: str) -> Query:
        """The first query drawn with something in the straight way, and with a path by the reference."""
        for query in draw_queries(cell, kind, np.random.default_rng([seed, 0])):
            if query.model.path_free(np.array([query.start, query.goal]), query.margin):
                self.straight += 1
            elif reference_path(query, seed) is not None:
                return query
            else:
                self.unproven += 1
                with suppress(PlanningError):
                    _plan(query, seed)
                    self.unproven_solved += 1
        raise ValueError(f"no query {kind!r} with seed {seed}")


def _plan(query: Query, seed: int) -> FloatArray:
    return plan(query.model, query.start, query.goal[None], seed, query.margin)


def _by_birrt(cell: CableCell, query: Query, seed: int) -> Iterator[tuple[str, Answer]]:
    with birrt_in(cell, query) as birrt:
        assert birrt is not None
        for name, planner in ((BIRRT, birrt.with_its_check), (BIRRT_OURS, birrt.with_our_check)):
            began = time.thread_time()
            path = planner(seed)
            yield name, Answer(1e3 * (time.thread_time() - began), _length(path))


def _length(path: FloatArray | None) -> float | None:
    return None if path is None else float(np.linalg.norm(np.diff(path, axis=0), axis=1).sum())


def touched_by(query: Query, path: FloatArray) -> str:
    """What a path (k, n) rad touches by coal's meshes, or the trajectory along it, which cuts corners; "": nothing.

    The meshes are those of the arm, with its jaw as far open as in the query, and the connector or the camera that it
    carries, against the foam itself, the other arm, and the cell's boxes and sockets.
    """
    chain = query.model.kinematics.chain
    driven = time_path(path, JointLimits(chain.speeds, chain.accelerations)).positions
    check = mesh_check(query)
    return check.first_touch(path) or check.first_touch(driven) or ""


def mesh_check(query: Query) -> MeshCheck:
    """Coal's check of a query's arm."""
    around = _surroundings(query.cell, query.arm)
    return MeshCheck(query.model.kinematics, around, opening=query.cell.gap, carried=list(_carried(query)))


def _carried(query: Query) -> Iterator[Carried]:
    """The connector that the hand holds, or the camera on the other arm's wrist."""
    kin, known = query.model.kinematics, query.cell.known
    if query.held is not None:
        connector = known.cable.connector
        pose = kin.last_from_tool @ query.held.as_matrix()
        yield Carried(len(kin), pose, (connector.length, connector.radius))
    if query.arm == query.cell.motion.search_arm:
        link, link_from_mount = kin.robot.mounted
        offset = RigidTransform.from_translation(known.search_mount.offset).as_matrix()
        yield Carried(link, link_from_mount @ offset, CAMERA_SIZE)


def _surroundings(cell: ClutteredCell, arm: str) -> Surroundings:
    known = cell.known
    turned = [
        (box, RigidTransform.from_components(box.center, Rotation.from_euler("z", piece.yaw)))
        for piece in cell.pieces
        for box in solid_parts(piece)
    ]
    for socket in known.cable.sockets:
        block = Box(name=socket.name, center=socket.center, size=socket.size)
        turned.append((block, RigidTransform.from_components(socket.center, socket.world_from_block)))
    others = [
        Standing(cell.motion.kinematics[name], other.positions, cell.gap)
        for name, other in cell.arms.items()
        if name != arm
    ]
    return Surroundings([*known.boxes, *known.cable.clip.bracket], turned, others)
