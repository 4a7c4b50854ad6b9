"""How an arm carries the end of a cable: by the cable's own shapes, where they are free."""

from collections.abc import Generator, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np
from scipy.spatial.transform import RigidTransform

from regrasp.interfaces.arguments import finite_pose, share
from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cause import CauseCode
from regrasp.motion.cable.cable_shape import cable_course
from regrasp.motion.cable.carry_paths import CarryPathParameters, carry_paths, first_free
from regrasp.motion.cable.held import connector_spheres
from regrasp.motion.cable.natural_routes import NaturalRoutes
from regrasp.motion.cable.search import SearchMotion, SearchMotionParameters
from regrasp.motion.cable.tether import Tether, TetherParameters
from regrasp.motion.failure import NO_WAY, PlanningError, StoppedShortError, TouchError
from regrasp.motion.planning.straight import can_continue
from regrasp.motion.request import MotionRequest
from regrasp.motion.robots.contact_guard import ContactLimits
from regrasp.motion.scene.collision import CollisionModel


@dataclass(frozen=True)
class CarryMotionParameters(SearchMotionParameters):
    """Those of every task, of the search, and of carrying."""

    slip_time: float = 1.0  # s that a slip has to be noticed after a touch; by the pads' gap it takes 0.3
    connector_padding: float = 1.2  # radii of the spheres that cover a carried connector, in its own radii; choice
    carry: CarryPathParameters = field(default_factory=CarryPathParameters)
    tether: TetherParameters = field(default_factory=TetherParameters)


class CarryMotion(SearchMotion):
    """Carries a held connector on its cable."""

    parameters: CarryMotionParameters

    def __init__(self, *args: Any, **keywords: Any) -> None:
        """See `Motion`."""
        super().__init__(*args, **keywords)
        self._caught: list[FloatArray] = []  # places (3,) m of the cable's end at which a touch stopped the arm

    def forget_felt(self) -> bool:
        """See `PlanningScene`; the places at which the cable may have been caught are forgotten, too."""
        caught, self._caught = self._caught, []
        return super().forget_felt() or bool(caught)

    def carry(
        self,
        arm: str,
        goals: Sequence[RigidTransform],
        held: RigidTransform,
        *,
        onward: Sequence[RigidTransform] = (),
        speed: float,
        forced: bool = True,
    ) -> MotionRequest:
        """Bring what `arm` holds (tool_from_connector) to one of the goals (world_from_tool), the first preferred.

        Along the shapes that the cable takes by itself where that is free, else straight or in a flat arch, else along
        any free path. On all of them the cable reaches, sweeps through nothing and bends little (`Tether`). Where there
        is none, or only one on which the arm touched something, OUT_OF_REACH is raised; if `forced` the arm goes on
        such ways and feels only a harder touch, then on those where the cable bends more, and at last it does not
        count. Where possible there is room for a jaw that opens on the way, as after a slip. From the goal the tool
        must also reach the poses `onward` (goal_from_tool) in straight lines.
        """
        for pose in (*goals, held, *onward):
            finite_pose("a pose of the tool or the connector", pose)
        share("the speed", speed)

        def steps(optimistic: bool, max_bend: float | None, limits: ContactLimits) -> Iterator[None]:
            spheres = self.held_spheres(held)
            model = self.start_model(arm, held=spheres, optimistic=optimistic)
            q, kin = self.joints(arm), self.kinematics[arm]
            clearances, carry = self.parameters.clearances, self.parameters.carry
            tether = self._tether(arm, held, q, np.inf if max_bend is None else max_bend, optimistic)

            def arm_free(world_from_tool: FloatArray) -> bool:
                return any(model.free(end, clearances.near_margins[-1]) for end in kin.ik(world_from_tool, q))

            routes = NaturalRoutes(self.known, tether.clearance, carry.routes)
            candidates = carry_paths(self.known, kin, q, goals, held, routes, arm_free, carry)
            paths = (path for path in candidates if path is None or can_continue(kin, path[-1], onward, carry.step))
            widest = self.known.arm(arm).robot.gripper.opening
            wide = self.model(arm, held=spheres, opening=widest, optimistic=optimistic)
            tethered = model
            if max_bend is not None:
                tethered, wide = model.constrained(tether), wide.constrained(tether)
            path = yield from first_free((wide, tethered), clearances, carry.leaving, paths)
            if path is None:
                ends = [end for end in kin.ik_of_all(goals, q) if can_continue(kin, end, onward, carry.step)]
                path = yield from self._shortest_plan(tethered, q, np.array(ends).reshape(-1, len(kin)), carry.searched)
            try:
                allowed = self._along_cable(limits, held)
                yield from self._follow(arm, path, min(speed, self._pace(optimistic)), model, allowed)
            except TouchError as error:
                yield from self._while_open(arm)
                # The cable behind the connector may have touched, and not the arm: the place that is mapped as felt, on
                # the arm, then does not keep the next path from the same touch.
                self._caught.append(self._cable_end(kin.tool(error.touch.joints) * held))
                raise

        def tries() -> Iterator[None]:
            natural, *more = self.parameters.tether.bends
            # What held it back just now may do so again: it is not broken.
            carrying = replace(self._guard.carrying, elastic=self.execution.held_back(arm))
            levels: list[tuple[float | None, ContactLimits]] = [(natural, carrying)]
            if forced:
                # What stopped it on its natural ways may have been its cable: there it may pull harder now.
                levels += [(bend, self._guard.pulling) for bend in (natural, *more, None)]
            for level, (max_bend, limits) in enumerate(levels, 1):
                try:
                    tried = partial(steps, max_bend=max_bend, limits=limits)
                    # Only where it may press harder is it worth while to go again where something was felt.
                    yield from self._tries(arm, tried, forgetting=level > 1)
                except PlanningError as error:
                    last = level == len(levels) and forced
                    if last or error.code not in NO_WAY or isinstance(error, (TouchError, StoppedShortError)):
                        raise
                    self._on_anomaly(f"{error}, with the cable bent by at most {max_bend:g}/m")
                else:
                    return
            raise PlanningError(CauseCode.OUT_OF_REACH, "it cannot be carried there without bending its cable by force")

        return self.execution.request(arm, tries())

    def _shift_held(self, arm: str, displacement: FloatArray, held: RigidTransform) -> MotionRequest:
        """`shift`, checked, with what the arm holds (tool_from_connector)."""
        limits = self._along_cable(self._guard.pulling, held)
        return self._shift(arm, displacement, held=self.held_spheres(held), contact=limits)

    def _tether(self, arm: str, held: RigidTransform, q: FloatArray, max_bend: float, optimistic: bool) -> Tether:
        """The cable of what is held (tool_from_connector) as a constraint on a path that begins at joints `q` (n,)."""
        tether, kin = self.parameters.tether, self.kinematics[arm]
        grid = self.grid_beside(cable_course(self.known, kin.tool(q) * held), tether.seen_free, optimistic)
        return Tether(self.known, held, q, kin, self.known.solids(), grid, max_bend, tether, self._caught)

    def _cable_end(self, world_from_connector: RigidTransform) -> FloatArray:
        """Where (3,) m the cable goes into a connector."""
        return world_from_connector.apply([-0.5 * self.known.cable.connector.length, 0.0, 0.0])

    def _along_cable(self, limits: ContactLimits, held: RigidTransform) -> ContactLimits:
        """The limits, with the cable free to pull along itself at what is held (tool_from_connector)."""
        return replace(limits, pull=np.concatenate([held.translation, held.rotation.apply([1.0, 0.0, 0.0])]))

    def _while_open(self, arm: str) -> Iterator[None]:
        """Wait for a short while if the jaw stands wider than the connector: what it lost felt like a touch.

        Whoever watches for slips then ends the motion, and nothing wrong is mapped.
        """
        end, holds = self._clock.now() + self.parameters.slip_time, 2 * self.known.cable.connector.radius
        slack = self.parameters.execution.jaw.slack
        while self.grippers[arm].reading().gap > holds + slack and self._clock.now() < end - 1e-9:
            yield

    def held_spheres(self, held: RigidTransform) -> FloatArray:
        """Spheres (n, 4) m in the tool frame that stand for a held connector (tool_from_connector); see `model`."""
        return connector_spheres(held, self.known.cable.connector, self.parameters.connector_padding)

    def _shortest_plan(
        self, model: CollisionModel, start: FloatArray, goals: FloatArray, count: int
    ) -> Generator[None, None, FloatArray]:
        """Steps that plan `count` times, one a tick, and return the path (k, n) on which the links move least.

        Raises PlanningError: the first plan fails.
        """
        shortest = self._plan(model, start, goals)
        levers = model.kinematics.chain.levers
        for _ in range(count - 1):
            if len(shortest) == 2:  # straight from start to goal
                break
            yield
            with suppress(PlanningError):
                shortest = min(shortest, self._plan(model, start, goals), key=lambda path: _length(path, levers))
        return shortest


def _length(path: FloatArray, levers: FloatArray) -> float:
    """How far (m) the links move along a joint path (k, n), by the joints' `levers` (n,) m."""
    return float(np.linalg.norm(np.diff(path, axis=0) * levers, axis=1).sum())
