"""Approaches to a cylinder: the grasps that may be taken, and how near to things each comes."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from scipy.spatial.transform import RigidTransform

from regrasp.interfaces.arrays import FloatArray
from regrasp.motion.failure import PlanningError
from regrasp.motion.grasping.grasps import (
    ApproachParameters,
    Grasp,
    GraspParameters,
    WaysIn,
    first_grasp,
    grasp_candidates,
    no_grasp,
)
from regrasp.motion.scene.collision import Clearances, CollisionModel


class Cylinder(Protocol):
    """A thing that jaws can take hold of. Its frame is at its centre, with x along its axis."""

    @property
    def length(self) -> float:
        """Its length, m."""
        ...

    @property
    def radius(self) -> float:
        """Its radius, m."""
        ...


@dataclass(frozen=True)
class PickParameters:
    """Which grasps are tried, and how many of them the planner may choose from."""

    # m along the cylinder from its centre, tried in turn: near a connector's cable its tip stays in sight
    grip_offsets: tuple[float, ...] = (-0.02, -0.03, 0.0)
    max_approaches: int = 12  # choice: each is a goal of the planner
    standoff: float = 0.08  # m back along the tool, where the straight approach begins; choice
    jaw_reach: float = 0.13  # m round a cylinder's centre where a jaw may be: half a length, a finger, 5 cm of palm
    grasp: GraspParameters = field(default_factory=GraspParameters)


def pick_candidates(
    world_from_cylinder: RigidTransform,
    cylinder: Cylinder,
    shallow: float,
    opening: float,
    parameters: PickParameters = PickParameters(),
) -> list[Grasp]:
    """Grasps at every grip offset, cheapest first within each; see `grasp_candidates` for `shallow` and `opening` m."""
    return [
        grasp
        for offset in parameters.grip_offsets
        for grasp in grasp_candidates(
            world_from_cylinder, cylinder.length, cylinder.radius, offset, shallow, parameters.grasp, opening
        )
    ]


def find_approaches(
    model: CollisionModel,
    near: CollisionModel,
    q: FloatArray,
    candidates: Sequence[Grasp],
    clearances: Clearances,
    parameters: PickParameters = PickParameters(),
) -> list[FloatArray]:
    """Joint paths (k, n) from standoff to grasp of the first candidates that work, about `max_approaches`.

    All keep the greatest of the near margins with which any candidate works. `model` and `near` as in `choose_grasp`.
    A rail stays where it is unless nothing works from there.
    Raises PlanningError with a tally when no candidate works with any margin.
    """
    kin = model.kinematics
    try:
        return _approaches(WaysIn(kin, parameters.standoff, q), model, near, q, candidates, clearances, parameters)
    except PlanningError:
        if kin.robot.rail is None:
            raise
    return _approaches(WaysIn(kin, parameters.standoff, None), model, near, q, candidates, clearances, parameters)


def _approaches(
    ways: WaysIn,
    model: CollisionModel,
    near: CollisionModel,
    q: FloatArray,
    candidates: Sequence[Grasp],
    clearances: Clearances,
    parameters: PickParameters,
) -> list[FloatArray]:
    for near_margin in clearances.near_margins:
        approach = ApproachParameters(parameters.standoff, clearances.margin, near_margin)
        paths: list[FloatArray] = []
        left = candidates
        while left and len(paths) < parameters.max_approaches:
            choice, troubles = first_grasp(ways, model, q, left, near, approach)
            if choice is None:
                if not paths and near_margin == clearances.near_margins[-1]:
                    raise no_grasp(troubles)
                break
            paths += choice.paths
            left = left[left.index(choice.grasp) + 1 :]
        if paths:
            return paths
    return []


def points_beyond(points: FloatArray, place: FloatArray, radius: float) -> FloatArray:
    """The points (n, 3) further than `radius` m from a place (3,)."""
    return points[np.linalg.norm(points - place, axis=1) > radius]
