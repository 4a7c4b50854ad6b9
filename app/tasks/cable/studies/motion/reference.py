"""Another planner, with far more effort: what it finds a path for is feasible, whatever ours makes of it."""

from dataclasses import dataclass

import numpy as np
import ompl.base as ob
import ompl.geometric as og
import ompl.util as ou

from regrasp.app.tasks.cable.studies.motion.queries import Query
from regrasp.interfaces.arrays import FloatArray


@dataclass(frozen=True)
class ReferenceParameters:
    """Its effort."""

    max_checks: int = 400_000  # configurations; ten times ours. Where it fails, 800,000 found nothing either
    longest_edge: float = 0.3  # m, each joint's rad times its lever; as ours


def reference_path(
    query: Query, seed: int, parameters: ReferenceParameters = ReferenceParameters()
) -> FloatArray | None:
    """A path (k, n) rad by OMPL's LBKPIECE1 (Sucan and Kavraki 2009; Bohlin and Kavraki 2000), None if it finds none.

    It grows two trees by the cells of a projection that are explored least, and checks edges lazily: other samples,
    other edges, other seeds than our RRTConnect, and no shortcuts. Every edge is checked at the fine step with the full
    margin, so a path is a proof. None proves nothing.
    """
    model, levers = query.model, query.model.kinematics.chain.levers
    count, left = len(levers), [parameters.max_checks]
    space = ob.RealVectorStateSpace(count)
    bounds = ob.RealVectorBounds(count)
    for i, (low, high) in enumerate(zip(model.kinematics.lower * levers, model.kinematics.upper * levers, strict=True)):
        bounds.setLow(i, float(low))
        bounds.setHigh(i, float(high))
    space.setBounds(bounds)
    ou.RNG.setSeed(seed + 1)  # OMPL takes no 0
    setup = og.SimpleSetup(space)
    information = setup.getSpaceInformation()

    def joints(state: ob.State) -> FloatArray:
        return np.array(state[0:count]) / levers

    class Edges(ob.MotionValidator):
        def checkMotion(self, a: ob.State, b: ob.State) -> bool:  # noqa: N802 (OMPL's name)
            qa, qb = joints(a), joints(b)
            left[0] -= 1 + int(np.abs(qb - qa).max() / model.fine_step)
            return model.edge_free(qa, qb, query.margin, fine=True)

    def free(state: ob.State) -> bool:
        left[0] -= 1
        return model.free(joints(state), query.margin)

    edges = Edges(information)
    setup.setStateValidityChecker(free)
    information.setMotionValidator(edges)
    ends = [space.allocState(), space.allocState()]
    for end, q in zip(ends, (query.start, query.goal), strict=True):
        end[0:count] = (q * levers).tolist()
    setup.setStartAndGoalStates(*ends)
    planner = og.LBKPIECE1(information)
    planner.setRange(parameters.longest_edge)
    setup.setPlanner(planner)
    setup.solve(ob.PlannerTerminationCondition(lambda: left[0] <= 0))
    if not setup.haveExactSolutionPath():  # a status is true for an approximate solution, too
        return None
    return np.array([joints(state) for state in setup.getSolutionPath().getStates()])
