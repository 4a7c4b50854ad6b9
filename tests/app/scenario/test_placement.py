import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.optimize import linprog
from scipy.spatial.transform import Rotation

from regrasp.app.scenario.placement import overlaps
from regrasp.app.scenario.shapes import JitteredBox, penetration_depth
from regrasp.interfaces.cable.cell import CableKnown
from regrasp.motion.robots.kinematics import ArmKinematics

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
    depth = penetration_depth(generators, np.array(place))
    if abs(depth) > 1e-6:
        assert share_a_point(generators, np.array(place)) == (depth > 0)


def test_penetration_is_the_shortest_way_out() -> None:
    boxes = np.vstack([halves((0.2, 0.2, 0.2), (0, 0, 0)), halves((1.0, 1.0, 0.1), (0, 0, 0))])
    np.testing.assert_allclose(penetration_depth(boxes, np.array([0.3, 0.1, 0.12])), 0.03, atol=1e-12)
    np.testing.assert_allclose(penetration_depth(boxes, np.array([0.0, 0.0, 0.25])), -0.10, atol=1e-12)


def test_a_block_in_a_sleeping_arm_or_around_the_camera_is_told(known: CableKnown) -> None:
    def named(center: tuple[float, float, float], edge: float = 0.03) -> list[str]:
        return [name for name, _ in overlaps(known, JitteredBox(np.array(center), (edge, edge, edge), 20.0))]

    for arm in known.arms:
        kinematics = ArmKinematics(arm.robot, arm.world_from_base)
        wrist = kinematics.mount(np.array(arm.sleep)).translation
        assert named((wrist[0], wrist[1], wrist[2])) == [f"the {arm.name} arm asleep"]
    assert named((-0.3556, 0.0, 0.4064)) == ["the rear camera"]
    assert named((0.2, 0.0, 0.6)) == []


@given(places, st.floats(0.02, 0.3), st.floats(-180, 180))
def test_an_arm_asleep_is_told_where_one_of_its_spheres_is_in_the_block(
    known: CableKnown, place: tuple[float, float, float], edge: float, yaw_deg: float
) -> None:
    found = dict(overlaps(known, JitteredBox(np.array(place), (edge, edge, edge), yaw_deg)))
    for arm in known.arms:
        frames = ArmKinematics(arm.robot, arm.world_from_base).link_frames(np.array(arm.sleep))
        moving = arm.robot.body.links > 0  # the base is another thing
        links, spheres = arm.robot.body.links[moving], arm.robot.body.spheres[moving]
        centers = np.array([(frames[link] @ [*c[:3], 1.0])[:3] for link, c in zip(links, spheres, strict=True)])
        inside = Rotation.from_euler("z", -yaw_deg, degrees=True).apply(centers - place)
        if np.any(np.abs(inside).max(axis=1) < 0.5 * edge - 1e-5):
            assert f"the {arm.name} arm asleep" in found
        gaps = np.linalg.norm(np.maximum(np.abs(inside) - 0.5 * edge, 0.0), axis=1)
        if np.all(gaps > spheres[:, 3]):
            assert f"the {arm.name} arm asleep" not in found
