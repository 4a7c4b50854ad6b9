"""`birrt` of the package pybullet-planning, asked the planner's queries: with our collision check, or with its own."""

import random
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from regrasp.app.tasks.cable.studies.planner_queries import Query
from regrasp.interfaces.arrays import FloatArray
from regrasp.sim.world import World

Planner = Callable[[Query, int], FloatArray | None]  # a query and a seed to a path (k, 6) rad, None without success


class Birrt:
    """The package's planners in a `world`, which must be the process's first PyBullet client: it knows no other.

    Its check has PyBullet's hulls of the links in place of our spheres; pairs of an arm's links whose hulls touch at an
    end of one of the `queries` are left out of it, as its users leave out pairs that touch in good poses.
    Raises ImportError if the package is not installed, and ValueError if the world is another client.
    """

    def __init__(self, world: World[Any], queries: Sequence[Query]) -> None:
        import pybullet_planning

        if world.client != pybullet_planning.CLIENT:
            raise ValueError(f"pybullet-planning plans in client {pybullet_planning.CLIENT} only, not {world.client}")
        self._package: Any = pybullet_planning
        self._world = world
        self._touching: dict[str, set[tuple[int, int]]] = {name: set() for name in world.arms}
        for query in queries:
            for q in (query.start, query.goal):
                self._touching[query.arm] |= self._pairs_that_touch(query.arm, q)
            self._sleep(query.arm)

    def with_our_check(self, query: Query, seed: int) -> FloatArray | None:
        """By its `birrt`: each check is one of our model, at our coarse steps."""
        package, (body, joints, limits) = self._package, self._arm(query.arm)
        signs = self._signs(query.arm)
        steps = np.full(len(signs), query.model.coarse_step)
        start, goal = (tuple((signs * q).tolist()) for q in (query.start, query.goal))

        def collides(q: Any, diagnosis: bool = False) -> bool:
            return not query.model.free(signs * q, query.margin)

        _sow(seed)
        path = package.birrt(
            start,
            goal,
            package.get_distance_fn(body, joints),
            package.get_sample_fn(body, joints, custom_limits=limits),
            package.get_extend_fn(body, joints, resolutions=steps, norm=np.inf),
            collides,
        )
        return _in_our_signs(path, signs)

    def with_its_check(self, query: Query, seed: int) -> FloatArray | None:
        """By its `plan_joint_motion`, as its users call it: PyBullet's check of the meshes, and its own steps."""
        package, (body, joints, limits) = self._package, self._arm(query.arm)
        others = [arm.body for name, arm in self._world.arms.items() if name != query.arm]
        signs = self._signs(query.arm)
        package.set_joint_positions(body, joints, signs * query.start)
        _sow(seed)
        path = package.plan_joint_motion(
            body,
            joints,
            tuple((signs * query.goal).tolist()),
            obstacles=[*self._world.fixed_bodies.values(), *others],
            disabled_collisions=self._touching[query.arm],
            max_distance=query.margin,
            custom_limits=limits,
        )
        self._sleep(query.arm)
        return _in_our_signs(path, signs)

    def _signs(self, name: str) -> FloatArray:
        return self._world.arms[name].robot.signs

    def _arm(self, name: str) -> tuple[int, list[int], dict[int, tuple[float, float]]]:
        """Body, joints, and our limits (rad, in the URDF's signs) of an arm."""
        arm = self._world.arms[name]
        chain = arm.robot.chain
        ends = np.sort(arm.robot.signs * np.array([chain.lower, chain.upper]), axis=0).T.tolist()
        return arm.body, arm.joints, {joint: tuple(pair) for joint, pair in zip(arm.joints, ends, strict=True)}

    def _pairs_that_touch(self, name: str, q: FloatArray) -> set[tuple[int, int]]:
        """Pairs of links of an arm whose hulls touch at joints (n,)."""
        package, (body, joints, _) = self._package, self._arm(name)
        package.set_joint_positions(body, joints, self._signs(name) * q)
        pairs = package.get_self_link_pairs(body, joints)
        return {(a, b) for a, b in pairs if package.pairwise_link_collision(body, a, body, b)}

    def _sleep(self, name: str) -> None:
        body, joints, _ = self._arm(name)
        sleep = np.array(self._world.cell.known.arm(name).sleep)
        self._package.set_joint_positions(body, joints, self._signs(name) * sleep)


def _sow(seed: int) -> None:
    """Seed both generators that the package draws from."""
    random.seed(seed)
    np.random.seed(seed)  # noqa: NPY002 - it has no other


def _in_our_signs(path: Any, signs: FloatArray) -> FloatArray | None:
    return None if path is None else np.array(path, float) * signs
