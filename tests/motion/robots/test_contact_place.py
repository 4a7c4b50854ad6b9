import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from robots import VX300S
from scipy.spatial.transform import RigidTransform

from regrasp.interfaces.arrays import FloatArray
from regrasp.motion.robots.contact_guard import Touch
from regrasp.motion.robots.contact_place import ContactPlaceParameters, contact_place, felt_points
from regrasp.motion.robots.kinematics import ArmKinematics
from regrasp.motion.scene.collision import CollisionModel

KIN = ArmKinematics(VX300S, RigidTransform.identity())
MODEL = CollisionModel(KIN, [])
NOWHERE = np.full(len(MODEL.links), np.inf)  # nothing is mapped
HAND = np.flatnonzero(MODEL.links == len(KIN))


def efforts_of(q: FloatArray, link: int, place: FloatArray, force: FloatArray) -> FloatArray:
    """What joints feel of a force, by the change of the place with each joint."""
    out, step = np.zeros(len(q)), 1e-6
    frame = KIN.link_frames(q)[link]
    local = np.linalg.inv(frame) @ [*place, 1.0]
    for i in range(link):
        moved = q.copy()
        moved[i] += step
        out[i] = force @ ((KIN.link_frames(moved)[link] @ local)[:3] - place) / step
    return out


@given(st.integers(0, 10_000))
def test_a_push_on_the_hand_is_found_on_the_hand_and_against_its_motion(seed: int) -> None:
    rng = np.random.default_rng(seed)
    q = rng.uniform(0.8 * KIN.lower, 0.8 * KIN.upper)
    sphere = MODEL.spheres(q)[rng.choice(HAND)]
    velocities = rng.normal(scale=0.5, size=len(q))
    moving = np.array([efforts_of(q, len(q), sphere[:3], axis) @ velocities for axis in np.eye(3)])
    force = -8.0 * moving / np.linalg.norm(moving)
    touch = Touch(1.0, q, velocities, efforts_of(q, len(q), sphere[:3], force))
    place, inward = contact_place(KIN, MODEL.spheres(q), MODEL.links, touch, NOWHERE)
    reach = np.linalg.norm(MODEL.spheres(q)[HAND, :3] - place, axis=1) - MODEL.spheres(q)[HAND, 3]
    assert reach.min() < 0.12  # a weak sideways push may as well be a weaker one further out
    assert inward @ -force > 0.0


def test_of_two_places_that_explain_a_touch_as_well_the_one_further_out_is_told() -> None:
    q = np.zeros(6)  # stretched ahead: only the waist feels a push from the side, wherever it is
    velocities = np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    spheres, links = MODEL.spheres(q), MODEL.links
    upper = np.flatnonzero(links == 3)[-1]
    force = np.array([0.0, -10.0, 0.0])
    efforts = efforts_of(q, 3, spheres[upper, :3], force)
    place, inward = contact_place(KIN, spheres, links, Touch(1.0, q, velocities, efforts), NOWHERE)
    assert inward[1] > 0.9  # the waist turns to the left
    assert place[0] > spheres[upper, 0]


def test_of_two_places_that_explain_a_touch_the_one_beside_a_mapped_thing_is_told() -> None:
    q = np.zeros(6)
    velocities = np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    spheres, links = MODEL.spheres(q), MODEL.links
    upper = np.flatnonzero(links == 3)[-1]
    efforts = efforts_of(q, 3, spheres[upper, :3], np.array([0.0, -10.0, 0.0]))
    clearances = np.full(len(spheres), 0.10)
    clearances[upper] = 0.01
    place, _ = contact_place(KIN, spheres, links, Touch(1.0, q, velocities, efforts), clearances)
    assert np.linalg.norm(place - spheres[upper, :3]) == pytest.approx(spheres[upper, 3])


def test_a_touch_is_not_told_beside_a_mapped_thing_where_the_force_would_be_far_greater() -> None:
    q = np.zeros(6)
    velocities = np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    spheres, links = MODEL.spheres(q), MODEL.links
    fore = np.flatnonzero(links == 4)[-1]
    efforts = efforts_of(q, 4, spheres[fore, :3], np.array([0.0, -8.0, 0.0]))
    clearances = np.full(len(spheres), 0.50)
    clearances[links <= 2] = 0.005  # the shoulder stands beside its table
    place, _ = contact_place(KIN, spheres, links, Touch(1.0, q, velocities, efforts), clearances)
    assert place[0] > 0.25  # not at the shoulder, at x = 0


def test_felt_points_are_a_disc_of_the_surface_and_what_lies_behind() -> None:
    parameters = ContactPlaceParameters(radius=0.04, depth=0.02)
    points = felt_points(np.array([0.3, 0.1, 0.2]), np.array([1.0, 0.0, 0.0]), 0.01, parameters) - [0.3, 0.1, 0.2]
    assert points[:, 0].min() > -1e-9
    assert points[:, 0].max() < 0.02 + 1e-9
    assert np.linalg.norm(points[:, 1:], axis=1).max() < 0.04 + 1e-9
    assert len(points) > 100
