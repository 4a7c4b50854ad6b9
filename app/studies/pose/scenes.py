"""The nine scenes in which the pose techniques are compared (Hwang 2024, tables 3 to 6), with a real cable and camera.

The connector sits on a stand near the panel's middle, 0.75 m from the rear camera, its cable running to the right
socket: a spring clip that lets go at 3 N, whichever way it is pulled. Scenes 6 to 9 are scene 3 behind the tall
foam piece. A seed moves the connector a little, and draws the cell's errors, light and noise.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Self

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform, Rotation

from regrasp.app.files.findings import Findings
from regrasp.app.files.overrides import read
from regrasp.app.files.resources import resolve
from regrasp.app.scenario.cell_file import load_cell
from regrasp.interfaces.cell import Box, Cell, FixedMount
from regrasp.interfaces.frame import RgbdFrame
from regrasp.interfaces.scene import Obstacle, SceneSetup
from regrasp.sim.ground_truth import GroundTruth
from regrasp.sim.render.renderer import RendererName
from regrasp.sim.world import World

FloatArray = NDArray[np.float64]

CAMERA = "rear"
DISTANCE, HEIGHT = 0.75, 0.29  # m from the camera; m above the floor; choice: the panel's middle, less to stay hidden
POSITION_JITTER, ANGLE_JITTER = 0.01, 5.0  # m on each axis, degrees about any axis; choice: as a hand would set it up
# N m2; choice: a tenth of the cell's, whose cable, bent into these poses, presses on the stand with up to 7 N
STIFFNESS = 0.005
# The tall foam piece of the scenarios: size, and m from its back to the connector's middle: a tilted tip is free of it.
PIECE, GAP = (0.08, 0.12, 0.36), 0.06
COLOR = (0.45, 0.20, 0.60)
ASIDE = 1.0  # m to the left, while the cable is laid
SHARE_ERROR = 0.001  # of the hidden share
STEPS = 40  # bisections: from 0.4 m to below any pixel


@dataclass(frozen=True)
class Configuration:
    """How the connector lies: its tip to the left, turned towards the camera and raised; how much of it is hidden."""

    name: str
    toward_deg: float  # out of the image plane, towards the camera
    up_deg: float
    left: float  # m of the connector's middle from the panel's; choice: where the cable presses least
    faces_away: bool = False  # the side with the tag
    hidden: float = 0.0  # share of what the camera would see
    shadow: bool = False  # what stays visible lies in the foam piece's depth shadow: reported apart

    @property
    def pose_name(self) -> str:
        """The first of those in the same pose: the jitter is the same."""
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


def study_cell(name: str = "thesis", overrides: Sequence[str] = ()) -> Cell:
    """The cell of that name, or file, with the cable slack and "key.path=value" texts laid over. Raises `Findings`."""
    assignments, wrong = read([f"hidden.cable.stiffness.zero={STIFFNESS}", *overrides])
    if wrong:
        raise Findings(wrong)
    return load_cell(resolve("cell", name, Path()), assignments)


def frames(
    configuration: str, seed: int, count: int, cell: Cell | None = None
) -> tuple[list[RgbdFrame], RigidTransform, RigidTransform]:
    """`count` frames of the rear camera, its world_from_camera as believed, and the true world_from_connector."""
    with Scene(cell or study_cell(), configuration, seed) as scene:
        return list(scene.frames(count)), scene.world_from_camera, scene.truth.connector_pose()


class Scene:
    """A world with the connector in one of the `CONFIGURATIONS`. Close it, or use it in a `with`."""

    def __init__(self, cell: Cell, configuration: str, seed: int, renderer: RendererName = "auto") -> None:
        self.configuration, self.seed = CONFIGURATIONS[configuration], seed
        mount = cell.known.camera("rear").mount
        assert isinstance(mount, FixedMount)
        self.world_from_camera = mount.world_from_camera
        pose = connector_pose(self.configuration, self.world_from_camera.translation, seed)
        pieces = (_foam_piece(pose),) if self.configuration.hidden else ()
        self.world = World(cell, "zero", seed, SceneSetup(pieces, connector_at=pose), renderer)
        self.truth = GroundTruth(self.world)
        if self.configuration.hidden:
            self._hide()

    def frames(self, count: int, camera: str = CAMERA) -> Iterator[RgbdFrame]:
        """The first frames of a camera, the same ones at every call: nothing moves."""
        return self.world.cameras[camera].static_frames(count)

    def close(self) -> None:
        """Free the world."""
        self.world.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _hide(self) -> None:
        """Push the foam piece in from one side until it hides the share asked for."""
        pose = self.truth.connector_pose()
        start = 0.5 * PIECE[1] + 0.15
        outside, inside = (-start, 0.0) if self.configuration.shadow else (start, 0.0)
        for _ in range(STEPS):
            middle = (outside + inside) / 2
            self.world.place_obstacle("tall", _center(pose, middle))
            share = self.truth.occluded_share(CAMERA)
            if abs(share - self.configuration.hidden) < SHARE_ERROR:
                return
            outside, inside = (middle, inside) if share < self.configuration.hidden else (outside, middle)
        raise RuntimeError(f"no place of the foam piece hides {self.configuration.hidden:.0%} of the connector")


def connector_pose(configuration: Configuration, camera: FloatArray, seed: int) -> RigidTransform:
    """world_from_connector, x from cable to tip and y to the tag's side, for a camera at `camera` (3,) m."""
    place = np.array([0.0, configuration.left, HEIGHT])
    place[0] = camera[0] + np.sqrt(DISTANCE**2 - np.sum((place - camera)[1:] ** 2))
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
    offset, about, angle = rng.uniform(-1.0, 1.0, 3), rng.normal(size=3), rng.uniform(0.0, ANGLE_JITTER)
    turn = Rotation.from_rotvec(angle * about / np.linalg.norm(about), degrees=True)
    return RigidTransform.from_components(place + POSITION_JITTER * offset, turn * pose)


def _foam_piece(pose: RigidTransform) -> Obstacle:
    x, y, z = _center(pose, ASIDE).tolist()
    return Obstacle(Box(name="tall", center=(x, y, z), size=PIECE, color=COLOR), 0.0, None)


def _center(pose: RigidTransform, left: float) -> FloatArray:
    """The foam piece's middle (3,) m, `left` m beside a connector's middle."""
    x, y, _ = pose.translation
    return np.array([x - GAP - 0.5 * PIECE[0], y + left, 0.5 * PIECE[2]])
