import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.optimize import linprog
from scipy.spatial.transform import Rotation

from app.placement import penetration

edges = st.tuples(*[st.floats(0.02, 0.5)] * 3)
angles = st.tuples(*[st.floats(-3, 3)] * 3)
places = st.tuples(*[st.floats(-0.6, 0.6)] * 3)


def halves(size: tuple[float, ...], turn: tuple[float, ...]) -> NDArray[np.float64]:
    half: NDArray[np.float64] = (Rotation.from_rotvec(turn).as_matrix() * (0.5 * np.asarray(size))).T
    return half


def share_a_point(generators: NDArray[np.float64], offset: NDArray[np.float64]) -> bool:
    """Brute force: is the offset a sum of the half edges, each times a factor from -1 to 1?"""
    n = len(generators)
    return bool(linprog(np.zeros(n), A_eq=generators.T, b_eq=offset, bounds=[(-1, 1)] * n).status == 0)


@given(edges, angles, edges, angles, places, st.tuples(*[st.floats(0, 0.1)] * 3))
def test_penetration_agrees_with_a_linear_programme(
    size: tuple[float, ...],
    turn: tuple[float, ...],
    other: tuple[float, ...],
    other_turn: tuple[float, ...],
    place: tuple[float, ...],
    jitter: tuple[float, ...],
) -> None:
    generators = np.vstack([halves(size, turn), np.diag(jitter), halves(other, other_turn)])
    depth = penetration(generators, np.array(place))
    if abs(depth) > 1e-6:
        assert share_a_point(generators, np.array(place)) == (depth > 0)


def test_penetration_is_the_shortest_way_out() -> None:
    boxes = np.vstack([halves((0.2, 0.2, 0.2), (0, 0, 0)), halves((1.0, 1.0, 0.1), (0, 0, 0))])
    np.testing.assert_allclose(penetration(boxes, np.array([0.3, 0.1, 0.12])), 0.03, atol=1e-12)
    np.testing.assert_allclose(penetration(boxes, np.array([0.0, 0.0, 0.25])), -0.10, atol=1e-12)
