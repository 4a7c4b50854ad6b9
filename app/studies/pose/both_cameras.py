"""The pose study with both cameras: after the rear camera's look, the left arm brings its own to the best view."""

from dataclasses import replace

from scipy.spatial.transform import RigidTransform

from regrasp.app.studies.pose.grasp import done, grasp, services_of
from regrasp.app.studies.pose.scenes import Scene
from regrasp.app.studies.pose.trial import MEAN_SECONDS, Looked, Setup, Trial, look, looked, measured
from regrasp.behaviors.cable.hand import CAMERA_ARM
from regrasp.behaviors.cable.look import LookLeaf
from regrasp.behaviors.common.start_up import StartUp
from regrasp.behaviors.leaf import LeafSteps
from regrasp.behaviors.services import Services
from regrasp.perception.pose.fusion import fuse
from regrasp.perception.pose.technique import Technique

BOTH = "both cameras"  # what stands behind the technique's name
SETTLE_SECONDS = 0.5  # until the arm swings no more


class BestView(LookLeaf):
    """Brings the wrist camera to where it sees the whole of the connector that is believed in."""

    def steps(self) -> LeafSteps:
        """See the class."""
        connector = self.services.belief.connector
        assert connector is not None
        _, goals = self.best_view(connector)
        yield self.services.motion.move(CAMERA_ARM, goals, margin=self.view.margin, tight=False)
        yield from self.wait(SETTLE_SECONDS)


class PutAway(LookLeaf):
    """Brings the left arm to sleep."""

    def steps(self) -> LeafSteps:
        """See the class."""
        yield from self.go_to_sleep(CAMERA_ARM)


def run_both(setup: Setup, configuration: str, seed: int) -> list[Trial]:
    """A trial of each technique with both cameras, each in a scene of its own."""
    return [_trial(setup, configuration, seed, name) for name in setup.techniques]


def _trial(setup: Setup, configuration: str, seed: int, name: str) -> Trial:
    trial = Trial(f"{name}, {BOTH}", configuration, seed, False)
    with setup.scene(configuration, seed) as scene:
        services = services_of(scene)
        seen = look(scene, setup.technique(name))
        if seen.world_from_connector is None:
            return replace(trial, why=seen.why, grasped=False if setup.grasps else None)
        pose, missed = _with_wrist(scene, services, setup.technique(name), seen)
        both = replace(seen, world_from_connector=pose)
        trial = measured(trial, both, scene.truth.connector_pose(), scene.world_from_camera)
        if not setup.grasps:
            return replace(trial, why=missed)
        why = done(scene, services, PutAway(name="put_away")) or grasp(scene, services, pose)
        force = max(scene.truth.contact_peaks().values(), default=0.0)
    return replace(trial, grasped=not why, why=why or missed, unintended_force=round(force, 2))


def _with_wrist(scene: Scene, services: Services, technique: Technique, rear: Looked) -> tuple[RigidTransform, str]:
    """The pose by both cameras, and why it is the rear camera's alone if it is."""
    assert rear.world_from_connector is not None
    services.belief.connector = rear.world_from_connector
    why = done(scene, services, StartUp(name="start_up")) or done(scene, services, BestView(name="best_view"))
    if why:
        return rear.world_from_connector, why
    frames = list(scene.frames(round(MEAN_SECONDS * scene.world.cameras["wrist"].spec.rate), "wrist"))
    pose = services.motion.camera_pose(frames[0])
    wrist = looked(technique, frames, pose, scene.truth.connector_pose())
    if not wrist.estimates:
        return rear.world_from_connector, f"wrist camera: {wrist.why}"
    return fuse([*rear.estimates, *wrist.estimates]).world_from_connector, ""
