"""Collision-free joint paths: straight when that is free, else OMPL's RRTConnect, then shortened.

The effort is limited by a count of checks, never by time: the same seed gives the same path.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import count

import numpy as np
import ompl.base as ob
import ompl.geometric as og
import ompl.util as ou

from regrasp.interfaces.arguments import finite, not_negative, rows
from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cause import CauseCode
from regrasp.motion.failure import PlanningError
from regrasp.motion.robots.kinematics import past_limits
from regrasp.motion.scene.collision import CollisionModel

ou.setLogLevel(ou.LOG_NONE)


@dataclass(frozen=True)
class PlannerParameters:
    """The planner's effort."""

    # Configurations that all searches together may check. 20000 take 40 ms
    max_checks: int = 120000
    # of these, after which a search that has found nothing begins again from another seed: RRTConnect mostly finds a
    # path soon or, with an unlucky tree, very late; choice
    restart: int = 20000
    searches: int = 4  # while the fine check of a path fails, another search begins; a last one checks finely; choice
    # m, each joint's rad times its lever, of a search's longest edge. OMPL's default, a fifth of the space's extent, is
    # 1.2 for the ViperX and 4.5 for the UR5e: most edges of that length collide, and a folded arm finds no way out.
    # 0.3 solves most queries in clutter, of 1.2, 0.6, 0.3 and 0.15, and takes no longer.
    longest_edge: float = 0.3
    # m by which a path may fall short of the margin in its fine check: between two coarse checks, 0.02 rad apart, a
    # hand 0.3 m off the joint's axis comes nearer by no more
    fine_slack: float = 0.003
    shortcuts: int = 80  # tries to shorten a path; choice
    past_limit: float = 0.05  # rad or m that a start may be read past a joint's limit: encoders are off by less
    start_overlap: float = 0.015  # m by which a start may seem to touch: the arm's spheres stand out of its meshes
    escape_step: float = 0.02  # rad of a step away from something near; choice: the step of a coarse check
    escape_steps: int = 100  # at most; choice
    escape_directions: int = 32  # random ones a step, besides the joints' own; choice


def plan(
    model: CollisionModel,
    start: FloatArray,
    goals: FloatArray,
    seed: int,
    margin: float = 0.01,
    parameters: PlannerParameters = PlannerParameters(),
) -> FloatArray:
    """Joint path (k, n) from `start` (n,) to one of `goals` (m, n), `margin` metres from everything.

    A start that is nearer than `margin` (after a grasp beside a panel) is first led away: the path begins with small
    steps along which the clearance only grows. One that is read a little past a joint's limit is
    first led back.

    Raises PlanningError: MOTION_BLOCKED if the start touches something or lies past a limit, OUT_OF_REACH without goals
    within the limits, NO_COLLISION_FREE_GOAL if none of them keeps the margin, PLANNING_FAILED if no path was found.
    Raises ValueError for joints or a margin that are not finite, and for a margin below 0.
    """
    start = finite("the start's joints", start)
    goals = rows("the goals' joints", goals, len(start))
    margin = not_negative("the margin", margin)
    inside = _inside(model, start, parameters.past_limit)
    escape = _escape(model, inside, margin, np.random.default_rng(seed), parameters)
    if inside is not start:
        escape = np.vstack([start, escape])
    free_goals = _free_goals(model, goals, margin)
    for goal in free_goals:
        if model.path_free(np.array([escape[-1], goal]), margin):
            return _joined(escape, np.array([escape[-1], goal]))
    budget, seeds = _Budget(parameters.max_checks), count(seed)
    for search in range(parameters.searches + 1):
        edges = _Edges(model, margin, fine=search == parameters.searches)
        found = _restarted(edges, escape[-1], free_goals, seeds, budget, parameters)
        path = _shortened(edges, found, np.random.default_rng([seed, search]), parameters.shortcuts)
        if model.path_free(path, max(0.0, margin - parameters.fine_slack)):
            return _joined(escape, path)
    message = f"{parameters.searches + 1} paths found, none free when checked finely"
    raise PlanningError(CauseCode.PLANNING_FAILED, message)


class _Budget:
    """Configurations that may still be checked."""

    def __init__(self, limit: int) -> None:
        self.left = limit

    def spent(self) -> bool:
        return self.left <= 0


@dataclass(frozen=True)
class _Edges:
    """Straight joint motions in a model that keep `margin` m, checked at its coarse or fine steps."""

    model: CollisionModel
    margin: float
    fine: bool

    def free(self, qa: FloatArray, qb: FloatArray) -> bool:
        """Whether that from joints `qa` (n,) to `qb` is free."""
        return self.model.edge_free(qa, qb, self.margin, fine=self.fine)

    def checks(self, qa: FloatArray, qb: FloatArray) -> int:
        """How many configurations that checks."""
        step = self.model.fine_step if self.fine else self.model.coarse_step
        return 1 + int(np.abs(qb - qa).max() / step)


class _EdgeCheck(ob.MotionValidator):
    """Straight joint motions checked in one call, and counted. States are joints times their levers."""

    def __init__(self, space: ob.SpaceInformation, edges: _Edges, budget: _Budget) -> None:
        super().__init__(space)
        self._edges, self._budget = edges, budget

    def checkMotion(self, a: ob.State, b: ob.State) -> bool:  # noqa: N802 (OMPL's name)
        """Whether the motion between two states is free."""
        levers = self._edges.model.kinematics.chain.levers
        qa, qb = _joints(a, levers), _joints(b, levers)
        self._budget.left -= self._edges.checks(qa, qb)
        return self._edges.free(qa, qb)


def _joints(state: ob.State, levers: FloatArray) -> FloatArray:
    return np.array(state[0 : len(levers)]) / levers  # iterating over a state crashes the process (OMPL 2.0.1)


def _restarted(
    edges: _Edges,
    start: FloatArray,
    goals: FloatArray,
    seeds: Iterator[int],
    budget: _Budget,
    parameters: PlannerParameters,
) -> FloatArray:
    """Waypoints (k, n) of the first search that finds a way; PlanningError when the budget runs out."""
    while budget.left > 0:
        part = _Budget(most := min(parameters.restart, budget.left))
        path = _search(edges, start, goals, next(seeds), part, parameters.longest_edge)
        if path is not None:
            budget.left -= most - part.left
            return path
        budget.left -= most
    margin, checks = f"{edges.margin * 1e3:.0f} mm", parameters.max_checks
    message = f"no path to {len(goals)} goals at {margin} margin in {checks} checked configurations"
    raise PlanningError(CauseCode.PLANNING_FAILED, message)


def _search(
    edges: _Edges, start: FloatArray, goals: FloatArray, seed: int, budget: _Budget, longest_edge: float
) -> FloatArray | None:
    """Waypoints (k, n) by RRTConnect (Kuffner and LaValle 2000), or None when the budget runs out.

    Distances between states are those of the joints, each times its lever: big joints count more.
    """
    model, margin, kin = edges.model, edges.margin, edges.model.kinematics
    levers, joints = kin.chain.levers, len(kin)
    space = ob.RealVectorStateSpace(joints)
    bounds = ob.RealVectorBounds(joints)
    for i in range(joints):
        bounds.setLow(i, float(kin.lower[i] * levers[i]))
        bounds.setHigh(i, float(kin.upper[i] * levers[i]))
    space.setBounds(bounds)
    ou.RNG.setSeed(seed + 1)  # OMPL takes no 0
    setup = og.SimpleSetup(space)
    information = setup.getSpaceInformation()

    def valid(state: ob.State) -> bool:
        budget.left -= 1
        return model.free(_joints(state, levers), margin)

    check = _EdgeCheck(information, edges, budget)
    setup.setStateValidityChecker(valid)
    information.setMotionValidator(check)
    first = space.allocState()
    first[0:joints] = (start * levers).tolist()
    setup.addStartState(first)
    targets = ob.GoalStates(information)
    for goal in goals:
        target = space.allocState()
        target[0:joints] = (goal * levers).tolist()
        targets.addState(target)
    setup.setGoal(targets)
    planner = og.RRTConnect(information)
    planner.setRange(longest_edge)
    setup.setPlanner(planner)
    setup.solve(ob.PlannerTerminationCondition(budget.spent))
    if not setup.haveExactSolutionPath():  # a status is true for an approximate solution, too
        return None
    path = np.array([_joints(state, levers) for state in setup.getSolutionPath().getStates()])
    path[0] = start
    path[-1] = goals[np.argmin(np.abs(goals - path[-1]).max(axis=1))]  # as given, without the rounding of the levers
    return path


def _free_goals(model: CollisionModel, goals: FloatArray, margin: float) -> FloatArray:
    """The goals that keep the margin; PlanningError with the best one's trouble when there is none."""
    if not len(goals):
        raise PlanningError(CauseCode.OUT_OF_REACH, "no joint angles reach the goal")
    free = goals[[model.free(goal, margin) for goal in goals]]
    if not len(free):
        within = [goal for goal in goals if not past_limits(model.kinematics, goal)]
        if not within:
            message = (
                f"none of {len(goals)} goals lies within the joints' limits: {past_limits(model.kinematics, goals[0])}"
            )
            raise PlanningError(CauseCode.OUT_OF_REACH, message)
        distance, what = max(model.nearest(goal) for goal in within)
        message = (
            f"none of {len(goals)} goals keeps {margin * 1e3:.0f} mm: the best has {distance * 1e3:.0f} mm to {what}"
        )
        raise PlanningError(CauseCode.NO_COLLISION_FREE_GOAL, message)
    return free


def _inside(model: CollisionModel, start: FloatArray, past_limit: float) -> FloatArray:
    """The start (n,), led back within the limits if it is read past them; PlanningError when that is too far."""
    kin = model.kinematics
    inside = np.clip(start, kin.lower, kin.upper)
    if np.array_equal(inside, start):
        return start
    if np.abs(inside - start).max() > past_limit:
        raise PlanningError(CauseCode.MOTION_BLOCKED, f"the arm stands past its limits: {past_limits(kin, start)}")
    return np.asarray(inside)


def _escape(
    model: CollisionModel, start: FloatArray, margin: float, rng: np.random.Generator, parameters: PlannerParameters
) -> FloatArray:
    """Small steps (k, n) from the start to where the margin is kept, each with more clearance than the one before."""
    q = start
    steps = [q]
    clearance, what = model.nearest(q)
    if clearance < -parameters.start_overlap:
        message = f"the arm touches {what}, {-clearance * 1e3:.0f} mm deep"
        raise PlanningError(CauseCode.MOTION_BLOCKED, message)
    while not model.free(q, margin):
        directions = _directions(rng, parameters.escape_directions, len(q))
        candidates = np.clip(q + directions * parameters.escape_step, model.kinematics.lower, model.kinematics.upper)
        best = max(candidates, key=model.clearance)
        if model.clearance(best) <= clearance or len(steps) > parameters.escape_steps:
            message = f"no way out to {margin * 1e3:.0f} mm clearance from {what}, {clearance * 1e3:.0f} mm away"
            raise PlanningError(CauseCode.MOTION_BLOCKED, message)
        q, clearance = best, model.clearance(best)
        steps.append(q)
    return np.array(steps)


def _directions(rng: np.random.Generator, count: int, joints: int) -> FloatArray:
    """Directions (2 joints + count, joints), largest entry 1: each joint both ways, and `count` random mixtures."""
    mixed = rng.normal(size=(count, joints))
    mixed /= np.abs(mixed).max(axis=1, keepdims=True)
    return np.vstack([np.eye(joints), -np.eye(joints), mixed])


def _shortened(edges: _Edges, path: FloatArray, rng: np.random.Generator, tries: int) -> FloatArray:
    """Path with random stretches replaced by straight lines wherever these are free (shortcutting)."""
    for _ in range(tries):
        if len(path) < 3:
            break
        i, j = np.sort(rng.uniform(0, len(path) - 1, 2))
        a, b = _at(path, i), _at(path, j)
        # What is left of the two edges is checked anew: with other steps, it may graze something.
        ways = [(a, b), (path[int(i)], a), (b, path[int(j) + 1])]
        if int(j) > int(i) and all(edges.free(*way) for way in ways):
            path = np.vstack([path[: int(i) + 1], a, b, path[int(j) + 1 :]])
            path = path[np.append(True, np.abs(np.diff(path, axis=0)).max(axis=1) > 1e-6)]
            path = _without_needless(edges, path)
    return path


def _without_needless(edges: _Edges, path: FloatArray) -> FloatArray:
    """Path without the waypoints whose neighbours a free straight line joins."""
    i = 1
    while i < len(path) - 1:
        if edges.free(path[i - 1], path[i + 1]):
            path = np.delete(path, i, axis=0)
        else:
            i += 1
    return path


def _at(path: FloatArray, s: float) -> FloatArray:
    """Point of the path at the fractional index `s`."""
    i = min(int(s), len(path) - 2)
    point: FloatArray = path[i] + (s - i) * (path[i + 1] - path[i])
    return point


def _joined(escape: FloatArray, path: FloatArray) -> FloatArray:
    """The escape and the path that begins at its end."""
    return np.vstack([escape[:-1], path])
