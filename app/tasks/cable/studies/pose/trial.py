"""One trial of the pose study: a technique looks at a scene; its mean pose is compared with the truth and grasped."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict, dataclass, replace

import numpy as np
from scipy.spatial.transform import RigidTransform

from regrasp.app.campaigns.digest import digest_of
from regrasp.app.files.findings import Finding, Findings
from regrasp.app.tasks.cable.studies.pose.grasp import grasp, services_of
from regrasp.app.tasks.cable.studies.pose.scenes import CAMERA, StudyScene, study_cell
from regrasp.interfaces.cable.cell import CableCell, CableKnown
from regrasp.interfaces.cell import pose_along
from regrasp.interfaces.frame import RgbdFrame
from regrasp.perception.pose.estimate import Estimate
from regrasp.perception.pose.technique import Technique, make_technique
from regrasp.sim.render.renderer import RendererName

CELL_OF_TECHNIQUE = {"fiducial": "thesis_tags"}  # the others use "thesis": a tag hides a part of the connector

Maker = Callable[[str, CableKnown], Technique]


@dataclass(frozen=True)
class TrialParameters:
    """How long a technique looks, and what counts as identified."""

    identify_seconds: float = 5.0  # simulated, to identify the connector; the thesis's
    mean_seconds: float = 3.0  # simulated, over which the estimates are averaged; the thesis's
    max_error: float = 0.10  # m from the truth; choice: an estimate a connector's length away is of something else


@dataclass(frozen=True)
class Trial:
    """The result of a technique in one configuration with one seed: a row of pose.csv. None: unknown, or not tried."""

    technique: str
    configuration: str
    seed: int
    identified: bool
    seconds: float | None = None  # simulated, until it was identified
    estimates: int = 0  # in the mean
    error_m: float | None = None  # distance from the connector's middle
    along_m: float | None = None  # the error's component along the axis, towards the tip
    toward_m: float | None = None  # the error's component towards the camera: 9 mm for one that averages the surface
    axis_error_deg: float | None = None  # between the axes as lines, 0 to 90
    way_round: bool | None = None  # whether cable and tip were told apart
    grasped: bool | None = None
    why: str = ""  # it was not identified, or not grasped
    unintended_force: float | None = None  # N, largest, of the arm against what it must not touch

    def __str__(self) -> str:
        if self.error_m is None:
            return f"{self.technique} not identified"
        grasped = {None: "", True: ", grasped", False: ", not grasped"}[self.grasped]
        return f"{self.technique} {1e3 * self.error_m:.1f} mm{grasped}"


@dataclass(frozen=True)
class MeanEstimate:
    """A technique's mean pose, or why it has none."""

    world_from_connector: RigidTransform | None
    seconds: float | None  # simulated, until the first estimate
    estimates: tuple[Estimate, ...]
    why: str


def technique_named(name: str, known: CableKnown) -> Technique:
    """A new technique. Raises ValueError where it cannot work in that cell."""
    return make_technique(name, known)


@dataclass(frozen=True)
class Setup:
    """What all scenes of a study have in common. `maker` makes the technique of a name."""

    cell: CableCell
    techniques: Sequence[str]
    grasps: bool = True
    renderer: RendererName = "software"
    maker: Maker = technique_named
    parameters: TrialParameters = TrialParameters()

    def scene(self, configuration: str, seed: int) -> StudyScene:
        """A new scene; close it."""
        return StudyScene(self.cell, configuration, seed, self.renderer)

    @property
    def digest(self) -> str:
        """A digest of all but the maker."""
        parts = self.cell.model_dump(mode="json"), list(self.techniques), self.grasps, self.renderer
        return digest_of(*parts, asdict(self.parameters))

    def technique(self, name: str) -> Technique:
        """A new technique, which has seen no frame yet."""
        return self.maker(name, self.cell.known)


def setups_of(
    techniques: Sequence[str], cell: str | None = None, *, grasps: bool = True, renderer: RendererName = "software"
) -> list[Setup]:
    """The techniques grouped by the cells that they need, or all in the `cell` of that name.

    Raises:
        Findings: no such cell, or a technique cannot work in it.
    """
    cells: dict[str, list[str]] = {}
    for name in techniques:
        cells.setdefault(cell or CELL_OF_TECHNIQUE.get(name, "thesis"), []).append(name)
    setups = [Setup(study_cell(name), names, grasps, renderer) for name, names in cells.items()]
    for setup in setups:
        for name in setup.techniques:
            try:
                setup.technique(name)
            except ValueError as error:
                raise Findings([Finding("--cell", 0, f"{name} cannot work in it: {error}")]) from None
    return setups


def run_trials(setup: Setup, configuration: str, seed: int) -> list[Trial]:
    """A trial of each technique on the same frames; each grasps in a new scene that is built the same way."""
    with setup.scene(configuration, seed) as scene:
        means = [rear_mean(setup, scene, setup.technique(name)) for name in setup.techniques]
        truth = scene.truth.connector_pose()
    trials = []
    for name, mean in zip(setup.techniques, means, strict=True):
        trial = with_errors(Trial(name, configuration, seed, False), mean, truth, scene.world_from_camera)
        trials.append(_grasp(setup, trial, mean.world_from_connector) if setup.grasps else trial)
    return trials


def rear_mean(setup: Setup, scene: StudyScene, technique: Technique) -> MeanEstimate:
    """A technique's mean estimate from the rear camera's frames."""
    seconds = setup.parameters.identify_seconds + setup.parameters.mean_seconds
    frames = scene.frames(round(seconds * scene.world.cameras[CAMERA].spec.rate))
    truth = scene.truth.connector_pose()
    return mean_estimate(technique, frames, scene.world_from_camera, truth, setup.parameters)


def with_errors(trial: Trial, mean: MeanEstimate, truth: RigidTransform, world_from_camera: RigidTransform) -> Trial:
    """The trial with the errors of a mean pose against `truth`, the true world_from_connector."""
    pose = mean.world_from_connector
    if pose is None:
        return replace(trial, why=mean.why)
    axis = truth.rotation.apply([1.0, 0.0, 0.0])
    cosine = float(pose.rotation.apply([1.0, 0.0, 0.0]) @ axis)
    error = pose.translation - truth.translation
    ray = truth.translation - world_from_camera.translation
    return replace(
        trial,
        identified=True,
        seconds=mean.seconds,
        estimates=len(mean.estimates),
        error_m=float(np.linalg.norm(error)),
        along_m=float(error @ axis),
        toward_m=float(-error @ ray / np.linalg.norm(ray)),
        axis_error_deg=float(np.rad2deg(np.arccos(min(1.0, abs(cosine))))),
        way_round=cosine > 0,
    )


def mean_estimate(
    technique: Technique,
    frames: Iterable[RgbdFrame],
    world_from_camera: RigidTransform,
    truth: RigidTransform,
    parameters: TrialParameters = TrialParameters(),
) -> MeanEstimate:
    """The mean over `mean_seconds` from the first estimate, which must come within `identify_seconds`.

    An estimate further than `max_error` from `truth`, the true world_from_connector, does not count.
    """
    kept: list[Estimate] = []
    start, why = 0.0, "no frame"
    for number, frame in enumerate(frames):
        start = frame.stamp if number == 0 else start
        end = kept[0].stamp + parameters.mean_seconds if kept else start + parameters.identify_seconds
        if frame.stamp >= end - 1e-9:
            break
        result = technique.estimate(frame, world_from_camera)
        if not isinstance(result, Estimate):
            why = result.message
        elif (error := float(np.linalg.norm(result.position - truth.translation))) > parameters.max_error:
            why = f"what was identified is {error:.2f} m from the connector"
        else:
            kept.append(result)
    if not kept:
        return MeanEstimate(None, None, (), why)
    return MeanEstimate(mean_pose(kept), kept[0].stamp - start, tuple(kept), "")


def mean_pose(estimates: Sequence[Estimate]) -> RigidTransform:
    """world_from_connector: the mean position, and the mean axis as a line, pointing where most axes point."""
    x, y, z = np.mean([e.position for e in estimates], axis=0).tolist()
    axes = np.array([e.axis for e in estimates])
    signs = np.where(axes @ axes[0] >= 0, 1.0, -1.0)
    ax, ay, az = ((signs @ axes) * (1.0 if signs.sum() >= 0 else -1.0)).tolist()
    return pose_along((x, y, z), (ax, ay, az))


def _grasp(setup: Setup, trial: Trial, pose: RigidTransform | None) -> Trial:
    if pose is None:
        return replace(trial, grasped=False)
    with setup.scene(trial.configuration, trial.seed) as scene:
        why = grasp(scene, services_of(scene), pose)
        force = max(scene.truth.contact_peaks().values(), default=0.0)
    return replace(trial, grasped=not why, why=why, unintended_force=round(force, 2))
