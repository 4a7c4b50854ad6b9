"""Pictures of a checkerboard from many sides by a simulated camera."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import pybullet as p
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform, Rotation

from regrasp.interfaces.frame import Intrinsics
from regrasp.sim.render.fiducials import MAX_PARTS, checkerboard_boxes, compound_visual
from regrasp.sim.render.picture import LightState
from regrasp.sim.render.renderer import RendererName, make_renderer
from regrasp.sim.render.visuals import Visuals

BOARD_LIGHT = LightState((-0.3, -0.5, -1.0), 0.45, 0.55)  # from behind the camera, in its optical frame


@dataclass(frozen=True)
class BoardViewParameters:
    """Range of the random views of a board."""

    margin: float = 4  # px between the board and the picture's edge
    # Board's size over the picture's, in the tighter direction. Choice: large boards show the distortion, small ones
    # reach into the corners.
    smallest: float = 0.4
    largest: float = 0.9
    # Choice: without tilt distance and focal length cannot be told apart; with more the corners blur.
    max_tilt_deg: float = 45.0
    max_roll: float = 0.5  # rad about the optical axis; choice


def board_poses(
    k: Intrinsics,
    columns: int,
    rows: int,
    square: float,
    count: int,
    rng: np.random.Generator,
    parameters: BoardViewParameters = BoardViewParameters(),
) -> list[RigidTransform]:
    """Random poses camera_from_board of `count` tilted views, each with the whole board in the picture.

    The board has `columns` x `rows` inner corners and squares `square` m wide. Its frame is at its centre: x to the
    right, y up, z towards the viewer.
    """
    return [_pose(k, (columns + 3) * square, (rows + 3) * square, rng, parameters) for _ in range(count)]


def _pose(
    k: Intrinsics, width: float, height: float, rng: np.random.Generator, parameters: BoardViewParameters
) -> RigidTransform:
    margin, max_roll = parameters.margin, parameters.max_roll
    max_tilt = np.deg2rad(parameters.max_tilt_deg)
    corners = 0.5 * np.array([[x * width, y * height, 0.0] for x in (-1, 1) for y in (-1, 1)])
    while True:  # it ends: a board in the middle of the picture fits
        distance = max(k.fx * width / k.width, k.fy * height / k.height) / rng.uniform(
            parameters.smallest, parameters.largest
        )
        u, v = rng.uniform([0, 0], [k.width, k.height])
        place = distance * np.array([(u - k.cx) / k.fx, (v - k.cy) / k.fy, 1.0])
        side = rng.uniform(-np.pi, np.pi)
        lean = Rotation.from_rotvec(rng.uniform(0.0, max_tilt) * np.array([np.cos(side), np.sin(side), 0.0]))
        turn = Rotation.from_euler("xz", [np.pi, rng.uniform(-max_roll, max_roll)])  # image rows run downwards
        pose = RigidTransform.from_components(place, lean * turn)
        x, y, z = pose.apply(corners).T
        seen = np.column_stack([k.fx * x / z + k.cx, k.fy * y / z + k.cy])
        if z.min() > 0 and np.all((seen > margin) & (seen < np.array([k.width, k.height]) - margin)):
            return pose


def board_pictures(
    k: Intrinsics,
    poses: Sequence[RigidTransform],
    columns: int,
    rows: int,
    square: float,
    renderer: RendererName = "software",
    light: LightState = BOARD_LIGHT,
) -> Iterator[NDArray[np.uint8]]:
    """Pictures (H, W, 3) uint8 of the board at `poses`, as from `board_poses`; `light` is in the optical frame."""
    client = p.connect(p.DIRECT)
    boxes = checkerboard_boxes(columns, rows, square)
    for start in range(0, len(boxes), MAX_PARTS):
        shape = compound_visual(client, boxes[start : start + MAX_PARTS], RigidTransform.identity())
        p.createMultiBody(0, -1, shape, physicsClientId=client)
    visuals = Visuals(client)
    drawer = make_renderer(visuals, renderer)
    try:
        for pose in poses:  # the board's many bodies stay in place, and the camera moves round them
            direction = pose.inv().rotation.apply(np.asarray(light.direction))
            light_on_board = LightState(direction, light.ambient, light.diffuse)
            yield drawer.render(visuals.snapshot(), pose.inv(), k, light_on_board).rgb
    finally:
        drawer.close()
        p.disconnect(client)
