"""Pictures of a checkerboard by a simulated camera, from many sides."""

from collections.abc import Iterator, Sequence

import numpy as np
import pybullet as p
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform, Rotation

from regrasp.interfaces.frame import Intrinsics
from regrasp.sim.render.picture import LightState
from regrasp.sim.render.printed import checkerboard_boxes, visual
from regrasp.sim.render.renderer import RendererName, make_renderer
from regrasp.sim.render.visuals import Visuals

PARTS = 16  # PyBullet's limit of boxes a body
MARGIN = 4  # pixels between the board and the picture's edge
SHARES = (
    0.4,
    0.9,
)  # of the picture's width or height; choice: large ones show distortion, small ones reach into the corners
TILT = np.deg2rad(45.0)  # choice: without tilt distance and focal length are one, beyond it the corners blur
LIGHT = LightState((-0.3, -0.5, -1.0), 0.45, 0.55)  # from behind the camera, in its optical frame


def board_poses(
    k: Intrinsics, columns: int, rows: int, square: float, count: int, rng: np.random.Generator
) -> list[RigidTransform]:
    """Poses camera_from_board of `count` views with the whole board in the picture, tilted and spread over it.

    The board has `columns` x `rows` inner corners, its squares are `square` m wide. Its frame is in its middle, x to
    the right, y up, z towards who looks at it.
    """
    return [_pose(k, (columns + 3) * square, (rows + 3) * square, rng) for _ in range(count)]


def _pose(k: Intrinsics, width: float, height: float, rng: np.random.Generator) -> RigidTransform:
    corners = 0.5 * np.array([[x * width, y * height, 0.0] for x in (-1, 1) for y in (-1, 1)])
    while True:  # a board in the middle fits
        distance = max(k.fx * width / k.width, k.fy * height / k.height) / rng.uniform(*SHARES)
        u, v = rng.uniform([0, 0], [k.width, k.height])
        place = distance * np.array([(u - k.cx) / k.fx, (v - k.cy) / k.fy, 1.0])
        side = rng.uniform(-np.pi, np.pi)
        lean = Rotation.from_rotvec(rng.uniform(0.0, TILT) * np.array([np.cos(side), np.sin(side), 0.0]))
        turn = Rotation.from_euler("xz", [np.pi, rng.uniform(-0.5, 0.5)])  # the picture's y runs down
        pose = RigidTransform.from_components(place, lean * turn)
        x, y, z = pose.apply(corners).T
        seen = np.column_stack([k.fx * x / z + k.cx, k.fy * y / z + k.cy])
        if z.min() > 0 and np.all((seen > MARGIN) & (seen < np.array([k.width, k.height]) - MARGIN)):
            return pose


def board_pictures(
    k: Intrinsics,
    poses: Sequence[RigidTransform],
    columns: int,
    rows: int,
    square: float,
    renderer: RendererName = "auto",
) -> Iterator[NDArray[np.uint8]]:
    """The picture (H, W, 3) of the board at each of `poses`, as `board_poses` gives them."""
    client = p.connect(p.DIRECT)
    boxes = checkerboard_boxes(columns, rows, square)
    for start in range(0, len(boxes), PARTS):
        shape = visual(client, boxes[start : start + PARTS], RigidTransform.identity())
        p.createMultiBody(0, -1, shape, physicsClientId=client)
    visuals = Visuals(client)
    drawer = make_renderer(visuals, renderer)
    try:
        for pose in poses:  # all of the board stands still: the camera moves round it
            light = LightState(pose.inv().rotation.apply(np.asarray(LIGHT.direction)), LIGHT.ambient, LIGHT.diffuse)
            yield drawer.render(visuals.snapshot(), pose.inv(), k, light).rgb
    finally:
        drawer.close()
        p.disconnect(client)
