"""A grasp attempt at an estimated pose by the right arm, with the leaves of the recovery, judged by ground truth."""

import logging

import structlog
from py_trees.common import Status
from scipy.spatial.transform import RigidTransform

from regrasp.app.run.compose import build_services
from regrasp.app.studies.pose.scenes import Scene
from regrasp.behaviors.cable.hand import HAND
from regrasp.behaviors.cable.regrasp import Regrasp
from regrasp.behaviors.common.start_up import StartUp
from regrasp.behaviors.leaf import Leaf
from regrasp.behaviors.services import Services
from regrasp.interfaces.devices import TICK
from regrasp.motion.failure import PlanningError

DRAWN = 0.05  # m straight back
FOLLOWED = 0.04  # m that the connector must have come along; choice: it may slide a little, and the arm errs
HELD_SECONDS = 2.0
FRESH = 0.2  # s until the camera shows the scene as it is: its first picture is older than the foam piece's place


def services_of(scene: Scene) -> Services:
    """A robot in the scene, which has looked at nothing yet; its cameras show the scene as it is."""
    scene.world.advance(FRESH)
    silent = structlog.make_filtering_bound_logger(logging.CRITICAL)
    return build_services(scene.world, scene.seed, structlog.wrap_logger(None, wrapper_class=silent))


def grasp(scene: Scene, services: Services, pose: RigidTransform) -> str:
    """Why the right arm could not take the connector believed at `pose` out of the stand, or '' if it could.

    Grasped, drawn back 5 cm and held for 2 s, by ground truth; the scene's things move.
    """
    services.belief.connector = pose
    why = done(scene, services, StartUp(name="start_up")) or done(scene, services, Regrasp(name="regrasp"))
    return why or _drawn_back(services, scene)


def done(scene: Scene, services: Services, leaf: Leaf) -> str:
    """Tick a leaf to its end while the world runs; why it failed, or ''."""
    leaf.setup(services=services)
    leaf.tick_once()
    while leaf.status is Status.RUNNING:
        scene.world.advance(TICK)
        leaf.tick_once()
    if leaf.status is Status.SUCCESS:
        return ""
    cause = services.belief.causes[-1]
    return f"{cause.code.value}: {cause.message}"


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
