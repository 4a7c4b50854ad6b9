"""A grasp attempt at an estimated pose by the right arm, with the leaves of the recovery, judged by ground truth."""

import logging

import structlog
from py_trees.common import Status
from scipy.spatial.transform import RigidTransform

from app.pose_scenes import Scene
from behaviors.hand import HAND
from behaviors.leaf import Leaf
from behaviors.regrasp import Regrasp
from behaviors.services import Services
from behaviors.start_up import StartUp
from motion.failure import PlanningError
from motion.service import Motion
from perception.service import Perception

TICK = 0.05  # simulated seconds
DRAWN = 0.05  # m straight back
FOLLOWED = 0.04  # m that the connector must have come along; choice: it may slide a little, and the arm errs
HELD_SECONDS = 2.0


def grasp(scene: Scene, pose: RigidTransform, seed: int) -> str:
    """Why the right arm could not take the connector believed at `pose` out of the stand, or '' if it could.

    Grasped, drawn back 5 cm and held for 2 s, by ground truth; the scene's things move. `seed` is the planner's.
    """
    services = _services(scene, seed)
    services.belief.connector = pose
    for leaf in (StartUp(name="start_up"), Regrasp(name="regrasp")):
        leaf.setup(services=services)
        if not _succeeds(leaf, scene):
            cause = services.belief.causes[-1]
            return f"{cause.code.value}: {cause.message}"
    return _drawn_back(services, scene)


def _services(scene: Scene, seed: int) -> Services:
    world, known = scene.world, scene.world.cell.known
    grippers = {name: arm.gripper for name, arm in world.arms.items()}
    motion = Motion(known, world.arms, grippers, world, seed * 1000)
    perception = Perception(known, world.cameras, world, motion.camera_pose, motion.spheres)
    silent = structlog.make_filtering_bound_logger(logging.CRITICAL)
    return Services(known, world, motion, perception, structlog.wrap_logger(None, wrapper_class=silent))


def _succeeds(leaf: Leaf, scene: Scene) -> bool:
    """Tick a leaf to its end while the world runs."""
    leaf.tick_once()
    while leaf.status is Status.RUNNING:
        scene.world.advance(TICK)
        leaf.tick_once()
    return bool(leaf.status is Status.SUCCESS)


def _drawn_back(services: Services, scene: Scene) -> str:
    motion, truth = services.motion, scene.truth
    start = truth.connector_pose().translation
    task = motion.shift(HAND, motion.tool(HAND).rotation.apply([-DRAWN, 0.0, 0.0]), checked=False)
    try:
        while not task.poll():
            scene.world.advance(TICK)
    except PlanningError as error:
        return f"{error.code.value}: {error}"
    for _ in range(round(HELD_SECONDS / TICK)):
        if not truth.held():
            return "lost: a pad touches the connector no more"
        scene.world.advance(TICK)
    moved = float(((truth.connector_pose().translation - start) ** 2).sum() ** 0.5)
    return "" if moved >= FOLLOWED else f"stayed: the connector came {1e3 * moved:.0f} mm along"
