"""One trial of the pose study: a technique looks at a scene, its mean pose is held against the truth and grasped."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import RigidTransform

from regrasp.app.files.findings import Finding, Findings
from regrasp.app.studies.pose.grasp import grasp, services_of
from regrasp.app.studies.pose.scenes import CAMERA, Scene, study_cell
from regrasp.interfaces.cell import Cell, KnownCell, pose_along
from regrasp.interfaces.frame import RgbdFrame
from regrasp.perception.pose.estimate import Estimate
from regrasp.perception.pose.technique import Technique, make_technique
from regrasp.sim.render.renderer import RendererName

LOOK_SECONDS, MEAN_SECONDS = 5.0, 3.0  # to identify it, and then over which poses are averaged: the thesis's
FAR = 0.10  # m from the truth; choice: what is seen further than a connector's length away is something else

CELLS = {"fiducial": "thesis_tags"}  # the others' is the thesis's: a tag hides a part of the connector

Maker = Callable[[str, KnownCell], Technique]


@dataclass(frozen=True)
class Trial:
    """What a technique made of one configuration with one seed. None: not known, or not tried."""

    technique: str
    configuration: str
    seed: int
    identified: bool
    seconds: float | None = None  # until it was
    estimates: int = 0  # of the frames in the mean
    error_m: float | None = None  # from the connector's middle
    along_m: float | None = None  # its part along the axis, towards the tip
    toward_m: float | None = None  # its part towards the camera: 9 mm for a technique that sees the surface
    axis_error_deg: float | None = None  # between the axes' lines
    way_round: bool | None = None  # cable and tip are told apart
    grasped: bool | None = None
    why: str = ""  # not identified, or not grasped
    unintended_force: float | None = None  # N, the largest of the arm against what it must not touch

    def __str__(self) -> str:
        if self.error_m is None:
            return f"{self.technique} not identified"
        grasped = {None: "", True: ", grasped", False: ", not grasped"}[self.grasped]
        return f"{self.technique} {1e3 * self.error_m:.1f} mm{grasped}"


@dataclass(frozen=True)
class Looked:
    """A technique's mean pose, or why it has none."""

    world_from_connector: RigidTransform | None
    seconds: float | None
    estimates: tuple[Estimate, ...]
    why: str


def make(name: str, known: KnownCell) -> Technique:
    """The technique of that name. Raises KeyError."""
    return make_technique(name, known)  # type: ignore[arg-type]  # names come checked from the command line


@dataclass(frozen=True)
class Setup:
    """What all scenes of a study have in common. `maker` makes a technique of its name."""

    cell: Cell
    techniques: Sequence[str]
    grasps: bool = True
    renderer: RendererName = "auto"
    maker: Maker = make

    def scene(self, configuration: str, seed: int) -> Scene:
        """A new scene; close it."""
        return Scene(self.cell, configuration, seed, self.renderer)

    def technique(self, name: str) -> Technique:
        """A new technique, which has seen nothing."""
        return self.maker(name, self.cell.known)


def setups_of(
    techniques: Sequence[str], cell: str | None = None, *, grasps: bool = True, renderer: RendererName = "auto"
) -> list[Setup]:
    """The techniques by the cells that they need, or all in the `cell` of that name. Raises `Findings`."""
    cells: dict[str, list[str]] = {}
    for name in techniques:
        cells.setdefault(cell or CELLS.get(name, "thesis"), []).append(name)
    setups = [Setup(study_cell(name), names, grasps, renderer) for name, names in cells.items()]
    for setup in setups:
        for name in setup.techniques:
            try:
                setup.technique(name)
            except ValueError as error:
                raise Findings([Finding("--cell", 0, f"{name} cannot work in it: {error}")]) from None
    return setups


def run_trials(setup: Setup, configuration: str, seed: int) -> list[Trial]:
    """A trial of each technique, on the same frames; each grasps in a scene of its own that is built alike."""
    with setup.scene(configuration, seed) as scene:
        looks = [look(scene, setup.technique(name)) for name in setup.techniques]
        truth = scene.truth.connector_pose()
    trials = []
    for name, seen in zip(setup.techniques, looks, strict=True):
        trial = measured(Trial(name, configuration, seed, False), seen, truth, scene.world_from_camera)
        trials.append(_grasp(setup, trial, seen.world_from_connector) if setup.grasps else trial)
    return trials


def look(scene: Scene, technique: Technique) -> Looked:
    """What a technique makes of the rear camera's frames."""
    frames = scene.frames(round((LOOK_SECONDS + MEAN_SECONDS) * scene.world.cameras[CAMERA].spec.rate))
    return looked(technique, frames, scene.world_from_camera, scene.truth.connector_pose())


def measured(trial: Trial, seen: Looked, truth: RigidTransform, world_from_camera: RigidTransform) -> Trial:
    """The trial with what was `seen` held against the truth."""
    pose = seen.world_from_connector
    if pose is None:
        return replace(trial, why=seen.why)
    axis = truth.rotation.apply([1.0, 0.0, 0.0])
    cosine = float(pose.rotation.apply([1.0, 0.0, 0.0]) @ axis)
    away = pose.translation - truth.translation
    sight = truth.translation - world_from_camera.translation
    return replace(
        trial,
        identified=True,
        seconds=seen.seconds,
        estimates=len(seen.estimates),
        error_m=float(np.linalg.norm(away)),
        along_m=float(away @ axis),
        toward_m=float(-away @ sight / np.linalg.norm(sight)),
        axis_error_deg=float(np.rad2deg(np.arccos(min(1.0, abs(cosine))))),
        way_round=cosine > 0,
    )


def looked(
    technique: Technique, frames: Iterable[RgbdFrame], world_from_camera: RigidTransform, truth: RigidTransform
) -> Looked:
    """The mean over `MEAN_SECONDS` from the first estimate within `LOOK_SECONDS`; one `FAR` from `truth` is none."""
    seen: list[Estimate] = []
    start, why = 0.0, "no frame"
    for number, frame in enumerate(frames):
        start = frame.stamp if number == 0 else start
        end = seen[0].stamp + MEAN_SECONDS if seen else start + LOOK_SECONDS
        if frame.stamp >= end - 1e-9:
            break
        found = technique.estimate(frame, world_from_camera)
        if not isinstance(found, Estimate):
            why = found.message
        elif (away := float(np.linalg.norm(found.position - truth.translation))) > FAR:
            why = f"what was identified is {away:.2f} m from the connector"
        else:
            seen.append(found)
    if not seen:
        return Looked(None, None, (), why)
    return Looked(mean(seen), seen[0].stamp - start, tuple(seen), "")


def mean(seen: Sequence[Estimate]) -> RigidTransform:
    """world_from_connector: mean position and mean line of the axis, pointing where most do."""
    x, y, z = np.mean([e.position for e in seen], axis=0).tolist()
    axes = np.array([e.axis for e in seen])
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
