"""Black and white patterns as flat boxes, since the renderers draw coloured shapes without textures."""

import cv2
import numpy as np
import pybullet as p
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform

from regrasp.interfaces.cell import TAG_DICTIONARY, Box, Tag

Color = tuple[float, float, float]
WHITE, BLACK = (0.92, 0.92, 0.90), (0.04, 0.04, 0.04)  # choice: paper and toner reflect about so much
THICKNESS = 0.0004  # m of a plate; choice: card. The bright rim of a thicker one draws the fit of the tag's edges
LAYER = 0.0001  # m by which print stands before what it is printed on: more than the depth buffer's step at 2 m


def tag_boxes(tag: Tag) -> list[Box]:
    """The tag's boxes in its own frame: the plate, the black square on it, and the white cells of its code on that."""
    size, dictionary = tag.size, cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, TAG_DICTIONARY))
    cells = dictionary.markerSize + 2  # with the black border
    white = cv2.aruco.generateImageMarker(dictionary, tag.number, cells) > 0
    plate = _sheet((0.0, 0.0), (tag.plate, tag.plate), WHITE, 0)
    return [plate, _sheet((0.0, 0.0), (size, size), BLACK, 1), *_cells(white, size / cells, WHITE, 2)]


def checkerboard_boxes(columns: int, rows: int, square: float) -> list[Box]:
    """A checkerboard of `columns` x `rows` inner corners, its squares `square` m wide, with a white border as wide."""
    down, across = np.indices((rows + 1, columns + 1))
    edges = ((columns + 3) * square, (rows + 3) * square)
    return [_sheet((0.0, 0.0), edges, WHITE, 0), *_cells((down + across) % 2 == 0, square, BLACK, 1)]


def visual(
    client: int,
    boxes: list[Box],
    body_from_boxes: RigidTransform,
    cylinder: tuple[float, float, Color] | None = None,
) -> int:
    """One PyBullet visual shape of at most 16 parts (PyBullet's limit): the boxes, and before them a cylinder.

    `cylinder` is its radius (m), length (m) and colour; it lies along the body's x axis.
    """
    parts = [(p.GEOM_BOX, [s / 2 for s in box.size], 0.0, 0.0, box.color) for box in boxes]
    places = [body_from_boxes.apply(box.center).tolist() for box in boxes]
    turns = [body_from_boxes.rotation.as_quat().tolist()] * len(boxes)
    if cylinder is not None:
        parts.insert(0, (p.GEOM_CYLINDER, [0.0] * 3, *cylinder))
        places.insert(0, [0.0] * 3)
        turns.insert(0, p.getQuaternionFromEuler([0.0, np.pi / 2, 0.0]))
    kinds, halves, radii, lengths, colors = zip(*parts, strict=True)
    return int(
        p.createVisualShapeArray(
            shapeTypes=kinds,
            halfExtents=halves,
            radii=radii,
            lengths=lengths,
            rgbaColors=[[*color, 1] for color in colors],
            visualFramePositions=places,
            visualFrameOrientations=turns,
            physicsClientId=client,
        )
    )


def _cells(inked: NDArray[np.bool_], edge: float, color: Color, layer: int) -> list[Box]:
    """The inked cells (rows, columns) in the middle of a plate, `edge` m wide each; neighbours in a row are one box."""
    height, width = inked.shape
    boxes = []
    for row, line in enumerate(inked):
        steps = np.flatnonzero(np.diff(line.astype(int), prepend=0, append=0))
        for start, end in steps.reshape(-1, 2):
            center = (edge * ((start + end) / 2 - width / 2), edge * (height / 2 - row - 0.5))
            boxes.append(_sheet(center, (edge * (end - start), edge), color, layer))
    return boxes


def _sheet(center: tuple[float, float], size: tuple[float, float], color: Color, layer: int) -> Box:
    """A flat box whose front lies `layer` layers before the plate's, which is the plane z = 0."""
    front = layer * LAYER
    return Box(name="sheet", center=(*center, front - THICKNESS / 2), size=(*size, THICKNESS), color=color)
