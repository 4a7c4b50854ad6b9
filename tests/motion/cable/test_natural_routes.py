"""Ways round obstacles along the natural shapes of a cable."""

from collections.abc import Callable

import numpy as np
import pytest

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cable.cell import CableKnown
from regrasp.motion.cable.cable_path import deflection
from regrasp.motion.cable.natural_routes import NaturalRoutes

BEGIN, END = np.array([-0.15, 0.0, 0.0]), np.array([0.15, 0.0, 0.0])


def anywhere(pose: FloatArray) -> bool:
    return True


def beside(known: CableKnown, place: FloatArray, radius: float) -> Callable[[FloatArray], float]:
    """The clearance to a round thing in the plane of deflections."""
    return lambda pose: float(np.linalg.norm(deflection(known, pose) - place)) - radius


def length(begin: FloatArray, route: FloatArray) -> float:
    return float(np.linalg.norm(np.diff(np.vstack([begin, route]), axis=0), axis=1).sum())


def test_where_nothing_is_in_the_way_one_route_goes_straight(known: CableKnown) -> None:
    (route,) = NaturalRoutes(known, lambda pose: 1.0).routes(BEGIN, END, anywhere)
    assert route[-1] == pytest.approx(END)
    assert length(BEGIN, route) == pytest.approx(0.30, abs=0.03)


def test_a_route_leads_round_an_obstacle_widely_and_then_closely(known: CableKnown) -> None:
    block = np.array([0.0, 0.0, 0.02])
    routes = list(NaturalRoutes(known, beside(known, block, 0.05)).routes(BEGIN, END, anywhere))
    assert len(routes) > 1
    lengths = [length(BEGIN, route) for route in routes]
    assert lengths == sorted(lengths, reverse=True)
    for route, clearance in zip(routes, (0.03, 0.015, 0.006), strict=False):
        assert all(np.linalg.norm(place - block) - 0.05 >= clearance for place in route[:-1])


def test_the_arm_must_be_free_on_the_route_too(known: CableKnown) -> None:
    def below_only(pose: FloatArray) -> bool:
        place = deflection(known, pose)
        return abs(float(place[0])) > 0.04 or float(place[2]) < -0.08

    for route in NaturalRoutes(known, lambda pose: 1.0).routes(BEGIN, END, below_only):
        assert min(place[2] for place in route) < -0.08


def test_a_closed_ring_leaves_no_route(known: CableKnown) -> None:
    def ring(pose: FloatArray) -> float:
        return abs(float(np.linalg.norm(deflection(known, pose) - END)) - 0.10) - 0.03

    assert list(NaturalRoutes(known, ring).routes(BEGIN, END, anywhere)) == []
