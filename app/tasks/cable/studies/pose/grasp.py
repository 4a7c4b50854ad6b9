"""A grasp attempt at an estimated pose by the right arm, with the leaves of the recovery, judged by ground truth."""

import logging
from dataclasses import dataclass

import structlog
from py_trees.common import Status
from scipy.spatial.transform import RigidTransform

from regrasp.app.tasks.cable.services import cable_services
from regrasp.app.tasks.cable.studies.pose.scenes import StudyScene
from regrasp.behaviors.cable.keys import FOUND, Found
from regrasp.behaviors.cable.regrasp import Regrasp
from regrasp.behaviors.cable.services import CableServices
from regrasp.behaviors.common.start_up import StartUp
from regrasp.behaviors.keys import causes, put
from regrasp.behaviors.leaf import Leaf
from regrasp.interfaces.devices import TICK
from regrasp.motion.failure import PlanningError

FRESH = 0.2  # s until the camera shows the scene as it is: its first picture is older than the foam piece's place


@dataclass(frozen=True)
class GraspTrialParameters:
    """When the connector counts as grasped."""

    retreat: float = 0.05  # m, straight back after the jaw has closed; choice
    min_followed: float = 0.04  # m that the connector must come along; choice: it may slide a little, and the arm errs
    hold_seconds: float = 2.0  # simulated, with both pads on the connector; choice


def services_of(scene: StudyScene) -> CableServices:
    """A robot in the scene, which has looked at nothing yet; its cameras show the scene as it is."""
    scene.world.advance(FRESH)
    silent = structlog.make_filtering_bound_logger(logging.CRITICAL)
    return cable_services(scene.world, scene.seed, structlog.wrap_logger(None, wrapper_class=silent))


def grasp(
    scene: StudyScene,
    services: CableServices,
    pose: RigidTransform,
    parameters: GraspTrialParameters = GraspTrialParameters(),
) -> str:
    """Let the right arm take the connector out of the stand: '' if it could, else why not.

    `pose` is the estimated world_from_connector. The connector counts as grasped when, by ground truth, it is held and
    followed the arm back. The scene's objects move.
    """
    put(FOUND, Found(pose, whole=True, camera=services.known.cable.overview))
    why = run_leaf(scene, services, StartUp(name="start_up")) or run_leaf(scene, services, Regrasp(name="regrasp"))
    return why or _pull_out(services, scene, parameters)


def run_leaf(scene: StudyScene, services: CableServices, leaf: Leaf) -> str:
    """Tick a leaf to its end while the world runs: '' if it succeeds, else why it failed."""
    leaf.setup(services=services)
    leaf.tick_once()
    while leaf.status is Status.RUNNING:
        scene.world.advance(TICK)
        leaf.tick_once()
    if leaf.status is Status.SUCCESS:
        return ""
    cause = causes()[-1]
    return f"{cause.code}: {cause.message}"


def _pull_out(services: CableServices, scene: StudyScene, parameters: GraspTrialParameters) -> str:
    """Draw the closed jaw straight back: '' if the connector follows and stays held, else what went wrong."""
    motion, truth, hand = services.motion, scene.truth, services.known.cable.hand
    start = truth.connector_pose().translation
    back = motion.tool(hand).rotation.apply([-parameters.retreat, 0.0, 0.0])
    task = motion.shift(hand, back, checked=False)
    try:
        while not task.poll():
            scene.world.advance(TICK)
    except PlanningError as error:
        return f"{error.code}: {error}"
    for _ in range(round(parameters.hold_seconds / TICK)):
        if not truth.held():
            return "lost: a pad no longer touches the connector"
        scene.world.advance(TICK)
    followed = float(((truth.connector_pose().translation - start) ** 2).sum() ** 0.5)
    return "" if followed >= parameters.min_followed else f"stayed: the connector came {1e3 * followed:.0f} mm along"
