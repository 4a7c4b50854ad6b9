"""`birrt` of the package pybullet-planning, asked the planner's queries: with our collision check, or with its own."""

import random
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from regrasp.app.tasks.cable.studies.motion.queries import Query
from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cable.cell import CableCell
from regrasp.interfaces.scene import SceneSetup
from regrasp.sim.cable.objects import CableObjects
from regrasp.sim.world import World


class Birrt:
    """The package's planners in a world with a query's foam, which is the process's only PyBullet client.

    Its check has PyBullet's hulls of the links in place of our spheres, and the foam itself in place of voxels. Pairs
    of an arm's links whose hulls touch at an end of the query are left out of it, as its users leave out pairs that
    touch in good poses; so are those of the hand and the connector that it holds.
    """

    def __init__(self, package: Any, world: World[Any], query: Query) -> None:
        self._package, self._world, self._query = package, world, query
        arm = world.arms[query.arm]
        self._body, self._joints, self._signs = arm.body, arm.joints, arm.robot.signs
        ends = np.sort(self._signs * np.array([arm.robot.chain.lower, arm.robot.chain.upper]), axis=0).T.tolist()
        self._limits = {joint: tuple(pair) for joint, pair in zip(self._joints, ends, strict=True)}
        for name, standing in query.cell.arms.items():
            self._stand(name, standing.positions)
            self._open_jaw(name, query.cell.gap)
        self._touching = self._pairs_that_touch(query.start) | self._pairs_that_touch(query.goal)

    def with_our_check(self, seed: int) -> FloatArray | None:
        """By its `birrt`: each check is one of our model, at our coarse steps."""
        package, query, signs = self._package, self._query, self._signs
        steps = np.full(len(signs), query.model.coarse_step)
        start, goal = (tuple((signs * q).tolist()) for q in (query.start, query.goal))

        def collides(q: Any, diagnosis: bool = False) -> bool:
            return not query.model.free(signs * q, query.margin)

        _sow(seed)
        path = package.birrt(
            start,
            goal,
            package.get_distance_fn(self._body, self._joints),
            package.get_sample_fn(self._body, self._joints, custom_limits=self._limits),
            package.get_extend_fn(self._body, self._joints, resolutions=steps, norm=np.inf),
            collides,
        )
        return self._in_our_signs(path)

    def with_its_check(self, seed: int) -> FloatArray | None:
        """By its `plan_joint_motion`, as its users call it: PyBullet's check of the meshes, and its own steps."""
        package, query = self._package, self._query
        others = [arm.body for name, arm in self._world.arms.items() if name != query.arm]
        self._stand(query.arm, query.start)
        held, apart = self._held()
        _sow(seed)
        path = package.plan_joint_motion(
            self._body,
            self._joints,
            tuple((self._signs * query.goal).tolist()),
            obstacles=[*self._world.fixed_bodies.values(), *others],
            attachments=held,
            disabled_collisions=self._touching,
            extra_disabled_collisions=apart,
            max_distance=query.margin,
            custom_limits=self._limits,
        )
        return self._in_our_signs(path)

    def _held(self) -> tuple[list[Any], set[tuple[tuple[int, int], tuple[int, int]]]]:
        """The held connector as the package's attachment, and the pairs of it and the hand's links."""
        package, query = self._package, self._query
        if query.held is None:
            return [], set()
        connector = query.cell.known.cable.connector
        child = package.create_cylinder(connector.radius, connector.length)  # along its z
        pose = query.model.kinematics.tool(query.start) * query.held
        turn = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])  # z to x
        quaternion = (pose.rotation * type(pose.rotation).from_matrix(turn)).as_quat().tolist()
        package.set_pose(child, (pose.translation.tolist(), quaternion))
        last = self._joints[-1]
        hand = [last, *package.get_link_descendants(self._body, last)]
        attachment = package.create_attachment(self._body, last, child)
        return [attachment], {((self._body, link), (child, package.BASE_LINK)) for link in hand}

    def _pairs_that_touch(self, q: FloatArray) -> set[tuple[int, int]]:
        """Pairs of the arm's links whose hulls touch at joints (n,)."""
        package = self._package
        self._stand(self._query.arm, q)
        pairs = package.get_self_link_pairs(self._body, self._joints)
        return {(a, b) for a, b in pairs if package.pairwise_link_collision(self._body, a, self._body, b)}

    def _stand(self, name: str, q: FloatArray) -> None:
        arm = self._world.arms[name]
        self._package.set_joint_positions(arm.body, arm.joints, arm.robot.signs * q)

    def _open_jaw(self, name: str, gap: float) -> None:
        arm, package = self._world.arms[name], self._package
        positions = arm.robot.gripper_positions(gap)
        package.set_joint_positions(arm.body, package.joints_from_names(arm.body, list(positions)), positions.values())

    def _in_our_signs(self, path: Any) -> FloatArray | None:
        return None if path is None else np.array(path, float) * self._signs


@contextmanager
def birrt_in(cell: CableCell, query: Query) -> Iterator[Birrt | None]:
    """The package's planners for a query; None where the package is not installed.

    Raises ValueError if the process has another PyBullet client already: the package knows the first alone.
    """
    try:
        import pybullet_planning
    except ImportError:
        yield None
        return
    world = World(cell, "zero", 0, CableObjects(cell), SceneSetup(query.cell.pieces))
    try:
        if world.client != pybullet_planning.CLIENT:
            raise ValueError(f"pybullet-planning plans in client {pybullet_planning.CLIENT} only, not {world.client}")
        yield Birrt(pybullet_planning, world, query)
    finally:
        world.close()


def _sow(seed: int) -> None:
    """Seed both generators that the package draws from."""
    random.seed(seed)
    np.random.seed(seed)  # noqa: NPY002 - it has no other
