"""Films a run: overview, rear and wrist camera side by side, the active leaf and the clock."""

from contextlib import ExitStack
from pathlib import Path
from types import TracebackType
from typing import Self

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform

from regrasp.app.run.video import OVERVIEW_SIZE, VideoWriter, compose
from regrasp.interfaces.cell import FixedMount
from regrasp.interfaces.frame import Intrinsics
from regrasp.sim.world import World

RATE = 10  # frames a simulated second
OVERVIEW = FixedMount(position=(-0.55, -0.75, 0.85), pitch_down_deg=30.0, yaw_deg=38.0)
OVERVIEW_FOV = 0.95  # rad


class Film:
    """A context manager; with None as the path it does nothing."""

    def __init__(self, path: Path | None, world: World) -> None:
        self._path, self._world = path, world
        self._stack = ExitStack()
        self._writer: VideoWriter | None = None
        self._frames = 0

    def __enter__(self) -> Self:
        if self._path is not None:
            self._writer = self._stack.enter_context(VideoWriter(self._path, RATE))
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._stack.close()

    def show(self, leaf: str) -> None:
        """Write a frame of the present instant when one is due."""
        world = self._world
        if self._writer is None or world.now() * RATE < self._frames - 1e-6:
            return
        self._frames += 1
        rear, wrist = (world.cameras[name].latest() for name in ("rear", "wrist"))
        lines = [
            f"{world.now():6.1f} s",
            f"{leaf}",
            f"gravity: {world.gravity}",
            f"renderer: {world.renderer.name}",
        ]
        self._writer.write(compose(overview(world), rear.rgb if rear else None, wrist.rgb if wrist else None, lines))


def overview(world: World) -> NDArray[np.uint8]:
    """The whole cell from behind and above the right arm: (480, 856, 3) uint8 RGB."""
    pose: RigidTransform = OVERVIEW.world_from_camera
    intrinsics = Intrinsics.from_fov(*OVERVIEW_SIZE, OVERVIEW_FOV)
    return np.asarray(world.renderer.render(world.visuals.snapshot(), pose, intrinsics, world.light).rgb)
