"""The nine scenes in which the pose techniques are compared (Hwang 2024, tables 3 to 6), with a real cable and camera.

The connector is held by a stand near the panel's middle, 0.75 m from the rear camera; its cable runs to the right
socket. The stand is a spring clip that lets go at 3 N in every direction. Scenes 6 to 9 are scene 3 behind the tall
foam piece. The seed moves the connector a little, and draws the cell's errors, light and noise.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Self

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform, Rotation

from regrasp.app.files.findings import Findings
from regrasp.app.files.overrides import parse_overrides
from regrasp.app.files.resources import resolve
from regrasp.app.tasks.cable.cells import cable_cell
from regrasp.interfaces.cable.cell import CableCell
from regrasp.interfaces.cell import Box, FixedMount
from regrasp.interfaces.frame import RgbdFrame
from regrasp.interfaces.scene import Obstacle, SceneSetup
from regrasp.sim.cable.ground_truth import CableTruth
from regrasp.sim.cable.objects import cable_world
from regrasp.sim.render.renderer import RendererName

CAMERA = "rear"
FOAM_COLOR = (0.45, 0.20, 0.60)
_START_ASIDE = 1.0  # m to the left, where the foam piece stands while the cable is laid


@dataclass(frozen=True)
class SceneParameters:
    """Where the connector and the foam piece stand."""

    distance: float = 0.75  # m from the camera to the connector; the thesis's
    height: float = 0.29  # m above the floor; choice: the panel's middle, less a little to stay hidden
    position_jitter: float = 0.01  # m, largest on each axis; choice: as a hand would set it up
    angle_jitter: float = 5.0  # degrees, largest, about any axis; choice: as a hand would set it up
    piece_size: tuple[float, float, float] = (0.08, 0.12, 0.36)  # m; the tall foam piece of the scenarios
    piece_gap: float = 0.06  # m from its back to the connector's middle: the raised tip does not touch it
    share_tolerance: float = 0.001  # of the hidden share; choice
    bisection_steps: int = 40  # choice: from 0.4 m to far less than a pixel


_DEFAULTS = SceneParameters()


@dataclass(frozen=True)
class Configuration:
    """The connector's pose, its tip to the left, and the share of it that is hidden."""

    name: str
    toward_deg: float  # out of the image plane, towards the camera
    up_deg: float  # of the tip above the horizontal
    left: float  # m from the panel's middle to the connector's; choice: where the cable presses least on the stand
    faces_away: bool = False  # whether the side with the tag does
    hidden: float = 0.0  # share of the connector's pixels
    shadow: bool = False  # whether the visible part lies in the foam piece's depth shadow; counted separately

    @property
    def pose_name(self) -> str:
        """The name of the first configuration in the same pose, which has the same jitter."""
        return self.name if not self.hidden else "3"


_HIDDEN = {"6": 0.1, "7": 0.3, "8": 0.5, "9": 0.7}
_ALL = (
    Configuration("1", 35.0, 0.0, 0.06),
    Configuration("2", 0.0, 0.0, 0.06),
    Configuration("3", 25.0, 30.0, 0.06),
    Configuration("4", 80.0, 9.0, 0.02),
    Configuration("5", 0.0, 90.0, 0.0, faces_away=True),
    *(Configuration(name, 25.0, 30.0, 0.06, hidden=share) for name, share in _HIDDEN.items()),
    *(Configuration(f"{name} shadow", 25.0, 30.0, 0.06, hidden=share, shadow=True) for name, share in _HIDDEN.items()),
)
CONFIGURATIONS = {c.name: c for c in _ALL}
HEADLINE = tuple(c.name for c in _ALL if not c.shadow)


def study_cell(name: str = "thesis", overrides: Sequence[str] = (), cable_stiffness: float = 0.005) -> CableCell:
    """The cell of that name or file, with a softer cable and with overrides such as "key.path=value".

    `cable_stiffness` in N m2, by default a tenth of the cell's: the cell's own cable, bent into these poses, would
    press on the stand with up to 7 N.

    Raises:
        Findings: no such cell, or something wrong in it or in the overrides.
    """
    assignments, wrong = parse_overrides([f"hidden.cable.stiffness.zero={cable_stiffness}", *overrides])
    if wrong:
        raise Findings(wrong)
    return cable_cell(resolve("cell", name, Path()), assignments)


def frames(
    configuration: str, seed: int, count: int, cell: CableCell | None = None
) -> tuple[list[RgbdFrame], RigidTransform, RigidTransform]:
    """`count` frames of the rear camera, its nominal world_from_camera, and the true world_from_connector."""
    with StudyScene(cell or study_cell(), configuration, seed) as scene:
        return list(scene.frames(count)), scene.world_from_camera, scene.truth.connector_pose()


class StudyScene:
    """A world with the connector in one of the `CONFIGURATIONS`. Close it, or use it as a context manager."""

    def __init__(
        self,
        cell: CableCell,
        configuration: str,
        seed: int,
        renderer: RendererName = "software",
        parameters: SceneParameters = _DEFAULTS,
    ) -> None:
        self.configuration, self.seed, self._parameters = CONFIGURATIONS[configuration], seed, parameters
        mount = cell.known.camera("rear").mount
        assert isinstance(mount, FixedMount)
        self.world_from_camera = mount.world_from_camera
        pose = connector_pose(self.configuration, self.world_from_camera.translation, seed, parameters)
        pieces = (_foam_piece(pose, parameters),) if self.configuration.hidden else ()
        self.world = cable_world(cell, "zero", seed, SceneSetup(pieces), connector_at=pose, renderer=renderer)
        self.truth = CableTruth(self.world)
        if self.configuration.hidden:
            self._hide()

    def frames(self, count: int, camera: str = CAMERA) -> Iterator[RgbdFrame]:
        """The first `count` frames of a camera, the same at every call: nothing moves."""
        return self.world.cameras[camera].static_frames(count)

    def close(self) -> None:
        """Free the world."""
        self.world.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _hide(self) -> None:
        """Move the foam piece in from one side until it hides the configuration's share (bisection).

        Raises:
            RuntimeError: no place hides that share.
        """
        pose, size = self.truth.connector_pose(), self._parameters.piece_size
        start = 0.5 * size[1] + 0.15
        outside, inside = (-start, 0.0) if self.configuration.shadow else (start, 0.0)
        for _ in range(self._parameters.bisection_steps):
            middle = (outside + inside) / 2
            self.world.place_obstacle("tall", _foam_center(pose, middle, self._parameters))
            share = self.truth.occluded_share(CAMERA)
            if abs(share - self.configuration.hidden) < self._parameters.share_tolerance:
                return
            outside, inside = (middle, inside) if share < self.configuration.hidden else (outside, middle)
        raise RuntimeError(f"no place of the foam piece hides {self.configuration.hidden:.0%} of the connector")


def connector_pose(
    configuration: Configuration,
    camera: NDArray[np.float64],
    seed: int,
    parameters: SceneParameters = _DEFAULTS,
) -> RigidTransform:
    """world_from_connector, x from cable to tip and y to the tag's side, for a camera at `camera` (3,) m, world."""
    place = np.array([0.0, configuration.left, parameters.height])
    place[0] = camera[0] + np.sqrt(parameters.distance**2 - np.sum((place - camera)[1:] ** 2))
    ahead = (place - camera) * [1.0, 1.0, 0.0]
    ahead /= np.linalg.norm(ahead)
    up = np.array([0.0, 0.0, 1.0])
    toward, raised = np.deg2rad([configuration.toward_deg, configuration.up_deg])
    level = np.cos(toward) * np.cross(up, ahead) - np.sin(toward) * ahead
    axis = np.cos(raised) * level + np.sin(raised) * up
    side = np.cross(np.cross(axis, ahead if configuration.faces_away else -ahead), axis)
    side /= np.linalg.norm(side)
    pose = Rotation.from_matrix(np.column_stack([axis, side, np.cross(axis, side)]))
    rng = np.random.default_rng([seed, 5, int(configuration.pose_name)])
    offset, about, angle = rng.uniform(-1.0, 1.0, 3), rng.normal(size=3), rng.uniform(0.0, parameters.angle_jitter)
    turn = Rotation.from_rotvec(angle * about / np.linalg.norm(about), degrees=True)
    return RigidTransform.from_components(place + parameters.position_jitter * offset, turn * pose)


def _foam_piece(pose: RigidTransform, parameters: SceneParameters) -> Obstacle:
    x, y, z = _foam_center(pose, _START_ASIDE, parameters).tolist()
    return Obstacle(Box(name="tall", center=(x, y, z), size=parameters.piece_size, color=FOAM_COLOR), 0.0, None)


def _foam_center(pose: RigidTransform, left: float, parameters: SceneParameters) -> NDArray[np.float64]:
    """The foam piece's middle (3,) m, world, `left` m beside the middle of a connector at `pose`."""
    x, y, _ = pose.translation
    depth, _, height = parameters.piece_size
    return np.array([x - parameters.piece_gap - 0.5 * depth, y + left, 0.5 * height])
