"""What a detector's network should answer for a picture: a CenterNet's target maps (Zhou et al. 2019)."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from regrasp.perception.detection import STRIDE, PixelBox

Thing = tuple[PixelBox, bool, tuple[float, ...]]  # its box, whether enough of it is seen to learn, its other values


def wanted_maps(things: Sequence[Thing], shape: tuple[int, int], values: int = 4) -> NDArray[np.float32]:
    """The maps (3 + values, h / 8, w / 8) of one class's `things` in a picture of `shape` (h, w) px.

    A box is (u0, v0, u1, v1) px from the picture's corner. Map 0 is the likelihood, 1 to 4 tell the box as
    `regrasp.perception.detection.peaks` reads it, and those after them hold the things' other values. The last but one
    is the weight of the values in the loss, and the last that of the likelihood: 0 where too little of a thing is seen
    to learn from it.
    """
    maps = np.zeros((3 + values, shape[0] // STRIDE, shape[1] // STRIDE), np.float32)
    heat_map, valid, weight = maps[0], maps[-2], maps[-1]
    weight[:] = 1.0
    rows, columns = (np.arange(n) + 0.5 for n in heat_map.shape)
    for box, counts, more in things:
        u0, v0, u1, v1 = np.array(box) / STRIDE
        middle, edges = ((u0 + u1) / 2, (v0 + v1) / 2), (u1 - u0, v1 - v0)
        # Gaussian that grows with the box, but at least so wide that the nearest cells get a share.
        sigma_u, sigma_v = (max(0.6, edge / 8) for edge in edges)
        du, dv = middle[0] - columns[None], middle[1] - rows[:, None]
        heat = np.exp(-0.5 * ((du / sigma_u) ** 2 + (dv / sigma_v) ** 2))
        if not counts:
            weight[heat > 0.05] = 0.0
            continue
        heat[int(min(middle[1], len(rows) - 0.5)), int(min(middle[0], len(columns) - 0.5))] = 1.0
        nearest = (heat > 0.4) & (heat > valid)
        maps[1], maps[2] = np.where(nearest, du, maps[1]), np.where(nearest, dv, maps[2])
        for k, value in enumerate((*np.log(edges), *more), start=3):
            maps[k][nearest] = value
        np.copyto(valid, heat, where=nearest)
        np.maximum(heat_map, heat, out=heat_map)
    return maps
