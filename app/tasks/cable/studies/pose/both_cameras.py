"""The pose study with both cameras: after the rear camera, the wrist camera looks from the best view."""

from dataclasses import replace
from typing import ClassVar

from scipy.spatial.transform import RigidTransform

from regrasp.app.tasks.cable.studies.pose.grasp import grasp, run_leaf, services_of
from regrasp.app.tasks.cable.studies.pose.scenes import StudyScene
from regrasp.app.tasks.cable.studies.pose.trial import MeanEstimate, Setup, Trial, mean_estimate, rear_mean, with_errors
from regrasp.behaviors.cable.keys import FOUND, Found
from regrasp.behaviors.cable.look import LookLeaf
from regrasp.behaviors.cable.services import CableServices
from regrasp.behaviors.common.start_up import StartUp
from regrasp.behaviors.keys import Keys, put
from regrasp.behaviors.leaf import LeafSteps
from regrasp.motion.cable.service import CableMotion
from regrasp.perception.pose.fusion import fuse
from regrasp.perception.pose.technique import Technique

BOTH = "both cameras"  # follows the technique's name in a row's title


class BestView(LookLeaf):
    """Moves the wrist camera to the best view of the connector's estimated pose."""

    NEEDS: ClassVar[Keys] = (FOUND,)
    settle_seconds = 0.5  # simulated, until the arm no longer swings

    def steps(self) -> LeafSteps:
        """See the class."""
        motion = self.services.motion
        yield motion.go_to_view(motion.best_view(self.read(FOUND).world_from_connector))
        yield from self.wait(self.settle_seconds)


class PutAway(LookLeaf):
    """Moves the left arm to its sleep pose."""

    def steps(self) -> LeafSteps:
        """See the class."""
        yield from self.go_to_sleep(self.search_arm)


def run_both(setup: Setup, configuration: str, seed: int) -> list[Trial]:
    """A trial of each technique with both cameras, each in a scene of its own."""
    return [_trial(setup, configuration, seed, name) for name in setup.techniques]


def _trial(setup: Setup, configuration: str, seed: int, name: str) -> Trial:
    trial = Trial(f"{name}, {BOTH}", configuration, seed, False)
    with setup.scene(configuration, seed) as scene:
        services = services_of(scene)
        rear = rear_mean(setup, scene, setup.technique(name))
        if rear.world_from_connector is None:
            return replace(trial, why=rear.why, grasped=False if setup.grasps else None)
        pose, missed = _fused_pose(setup, scene, services, setup.technique(name), rear)
        both = replace(rear, world_from_connector=pose)
        trial = with_errors(trial, both, scene.truth.connector_pose(), scene.world_from_camera)
        if not setup.grasps:
            return replace(trial, why=missed)
        why = run_leaf(scene, services, PutAway(name="put_away")) or grasp(scene, services, pose)
        force = max(scene.truth.contact_peaks().values(), default=0.0)
    return replace(trial, grasped=not why, why=why or missed, unintended_force=round(force, 2))


def _fused_pose(
    setup: Setup, scene: StudyScene, services: CableServices, technique: Technique, rear: MeanEstimate
) -> tuple[RigidTransform, str]:
    """world_from_connector by both cameras and ''; or the rear camera's alone, and why."""
    assert rear.world_from_connector is not None
    put(FOUND, Found(rear.world_from_connector, whole=True, camera=services.known.cable.overview))
    why = run_leaf(scene, services, StartUp(name="start_up")) or run_leaf(scene, services, BestView(name="best_view"))
    if why:
        return rear.world_from_connector, why
    frames = list(scene.frames(round(setup.parameters.mean_seconds * scene.world.cameras["wrist"].spec.rate), "wrist"))
    assert isinstance(services.motion, CableMotion)
    pose = services.motion.camera_pose(frames[0])
    wrist = mean_estimate(technique, frames, pose, scene.truth.connector_pose(), setup.parameters)
    if not wrist.estimates:
        return rear.world_from_connector, f"wrist camera: {wrist.why}"
    return fuse([*rear.estimates, *wrist.estimates]).world_from_connector, ""
