"""ArUco tags and checkerboards, built from flat boxes because the renderers draw no textures."""

from dataclasses import dataclass

import cv2
import numpy as np
import pybullet as p
from scipy.spatial.transform import RigidTransform

from regrasp.interfaces.arrays import Mask
from regrasp.interfaces.cell import Box
from regrasp.interfaces.fields import Color
from regrasp.interfaces.tag import TAG_DICTIONARY, Tag

WHITE, BLACK = (0.92, 0.92, 0.90), (0.04, 0.04, 0.04)  # choice: about the reflectance of paper and toner
MAX_PARTS = 16  # PyBullet's limit of parts of one visual shape


@dataclass(frozen=True)
class PrintParameters:
    """Thickness of plate and print."""

    plate: float = 0.0004  # m; choice: card. The bright rim of a thicker plate spoils the fit of the tag's edges
    layer: float = 0.0001  # m between print and what lies under it: more than the depth buffer resolves at 2 m


def tag_boxes(tag: Tag, parameters: PrintParameters = PrintParameters()) -> list[Box]:
    """Boxes of a tag in the tag's frame: the plate, the black square, then the white cells of the code."""
    size, dictionary = tag.size, cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, TAG_DICTIONARY))
    cells = dictionary.markerSize + 2  # with the black border
    white = cv2.aruco.generateImageMarker(dictionary, tag.number, cells) > 0
    plate = _sheet((0.0, 0.0), (tag.plate, tag.plate), WHITE, 0, parameters)
    square = _sheet((0.0, 0.0), (size, size), BLACK, 1, parameters)
    return [plate, square, *_cells(white, size / cells, WHITE, 2, parameters)]


def checkerboard_boxes(
    columns: int, rows: int, square: float, parameters: PrintParameters = PrintParameters()
) -> list[Box]:
    """Boxes of a checkerboard with `columns` x `rows` inner corners, squares and a white border `square` m wide."""
    down, across = np.indices((rows + 1, columns + 1))
    edges = ((columns + 3) * square, (rows + 3) * square)
    plate = _sheet((0.0, 0.0), edges, WHITE, 0, parameters)
    return [plate, *_cells((down + across) % 2 == 0, square, BLACK, 1, parameters)]


def compound_visual(
    client: int,
    boxes: list[Box],
    body_from_boxes: RigidTransform,
    cylinder: tuple[float, float, Color] | None = None,
) -> int:
    """Id of one PyBullet visual shape of at most `MAX_PARTS` parts: a cylinder if given, then the boxes.

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


def _cells(inked: Mask, edge: float, color: Color, layer: int, parameters: PrintParameters) -> list[Box]:
    """Boxes of the inked cells (rows, columns), `edge` m wide, centred on the plate; one for neighbours in a row."""
    height, width = inked.shape
    boxes = []
    for row, line in enumerate(inked):
        steps = np.flatnonzero(np.diff(line.astype(int), prepend=0, append=0))
        for start, end in steps.reshape(-1, 2):
            center = (edge * ((start + end) / 2 - width / 2), edge * (height / 2 - row - 0.5))
            boxes.append(_sheet(center, (edge * (end - start), edge), color, layer, parameters))
    return boxes


def _sheet(
    center: tuple[float, float], size: tuple[float, float], color: Color, layer: int, parameters: PrintParameters
) -> Box:
    """A flat box whose front lies `layer` layers in front of the plate's, which is the plane z = 0."""
    front, thickness = layer * parameters.layer, parameters.plate
    return Box(name="sheet", center=(*center, front - thickness / 2), size=(*size, thickness), color=color)
