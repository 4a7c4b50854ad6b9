import numpy as np

from regrasp.motion.scene.bounds import MAX_GROUP, bounding_spheres, group_pairs, group_starts


def test_a_group_ends_with_its_link_its_room_or_a_gap() -> None:
    links = np.array([0, 0, 1, 1, 1, *[2] * (MAX_GROUP + 1)])
    spheres = np.zeros((len(links), 4))
    spheres[4, 0] = 0.5
    assert group_starts(links, spheres).tolist() == [0, 2, 4, 5, 5 + MAX_GROUP, 6 + MAX_GROUP]
    assert group_starts(links[:0], spheres[:0]).tolist() == [0]


def test_bounds_hold_every_sphere_of_their_group() -> None:
    rng = np.random.default_rng(0)
    spheres, starts = rng.uniform(0.01, 0.2, (20, 4)), np.array([0, 1, 8, 20])
    for g, bound in enumerate(bounding_spheres(spheres, starts)):
        for sphere in spheres[starts[g] : starts[g + 1]]:
            assert np.linalg.norm(sphere[:3] - bound[:3]) + sphere[3] < bound[3]


def test_groups_can_meet_when_their_spheres_can() -> None:
    starts, pairs = np.array([0, 2, 3, 5]), np.array([[0, 3], [0, 4], [1, 3], [1, 4], [2, 0], [2, 1]])
    assert group_pairs(pairs, starts).tolist() == [[0, 2], [1, 0]]
    assert group_pairs(pairs[:0], starts).shape == (0, 2)
