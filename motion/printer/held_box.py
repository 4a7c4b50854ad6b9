"""A box that a hand holds: the spheres that stand for it, and where it lies once it is let go."""

import numpy as np
from scipy.spatial.transform import RigidTransform

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cell import Box


class HeldBox:
    """A box at the pose `tool_from_box`. `spheres` (m, 4) m cover it, in the tool frame, `spacing` m apart at most.

    Each sphere covers a cell of a grid: its radius is half the cell's diagonal.
    """

    def __init__(self, box: Box, tool_from_box: RigidTransform, spacing: float) -> None:
        self.box, self.tool_from_box = box, tool_from_box
        size = np.array(box.size)
        counts = np.ceil(size / spacing).astype(int)
        cell = size / counts
        axes = [(np.arange(n) + 0.5) * edge - 0.5 * whole for n, edge, whole in zip(counts, cell, size, strict=True)]
        centers = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
        radii = np.full(len(centers), 0.5 * np.linalg.norm(cell))
        self.spheres: FloatArray = np.column_stack([tool_from_box.apply(centers), radii])

    def placed(self, world_from_tool: RigidTransform) -> Box:
        """The box with its edges along the world's axes that encloses it where the hand is."""
        pose = world_from_tool * self.tool_from_box
        size = np.abs(pose.rotation.as_matrix()) @ np.array(self.box.size)
        center, edges = pose.translation.tolist(), size.tolist()
        return self.box.model_copy(update={"center": tuple(center), "size": tuple(edges)})
