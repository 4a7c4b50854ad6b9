"""The pose study's configurations as one image, colour above depth.

python -m regrasp.app.tasks.cable.studies.pose.sheet FILE
"""

import sys

import cv2
import numpy as np
from numpy.typing import NDArray

from regrasp.app.tasks.cable.studies.pose.scenes import StudyScene, study_cell
from regrasp.interfaces.frame import RgbdFrame

SHEET_CONFIGURATIONS = ("1", "2", "3", "4", "5", "6", "7", "8", "9", "9 shadow")
_ROWS, _COLUMNS = slice(70, 400), slice(190, 660)  # of the rear camera's 848x480
_TILE_WIDTH, _TILES_PER_ROW = 260, 5  # px
_NEAREST_DEPTH, _FARTHEST_DEPTH = 0.5, 1.0  # m, drawn dark and bright; black is no reading


def sheet(seed: int = 0) -> NDArray[np.uint8]:
    """The sheet (H, W, 3), BGR."""
    cell = study_cell()
    tiles = []
    for name in SHEET_CONFIGURATIONS:
        with StudyScene(cell, name, seed) as scene:
            tiles.append(_tile(name, next(scene.frames(1))))
    return np.vstack([np.hstack(tiles[i : i + _TILES_PER_ROW]) for i in range(0, len(tiles), _TILES_PER_ROW)])


def _tile(name: str, frame: RgbdFrame) -> NDArray[np.uint8]:
    scaled = np.clip(255 * (frame.depth - _NEAREST_DEPTH) / (_FARTHEST_DEPTH - _NEAREST_DEPTH), 0, 255).astype(np.uint8)
    depth = cv2.applyColorMap(scaled, cv2.COLORMAP_VIRIDIS)
    depth[frame.depth == 0] = 0
    pair = np.vstack([picture[_ROWS, _COLUMNS] for picture in (cv2.cvtColor(frame.rgb, cv2.COLOR_RGB2BGR), depth)])
    tile = cv2.resize(
        pair, (_TILE_WIDTH, round(_TILE_WIDTH * pair.shape[0] / pair.shape[1])), interpolation=cv2.INTER_AREA
    )
    cv2.putText(tile, name, (8, 22), cv2.FONT_HERSHEY_SIMPLEX, 0.6, (0, 0, 0), 2, cv2.LINE_AA)
    return np.asarray(tile, np.uint8)


if __name__ == "__main__":
    cv2.imwrite(sys.argv[1], sheet(), [cv2.IMWRITE_JPEG_QUALITY, 85])
