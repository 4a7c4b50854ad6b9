"""Films a run: overview, rear and wrist camera side by side, the active leaf and the clock."""

from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from types import TracebackType
from typing import Self

import numpy as np

from regrasp.app.run.video import OVERVIEW_SIZE, RgbImage, VideoWriter, compose
from regrasp.interfaces.cell import FixedMount
from regrasp.interfaces.frame import Intrinsics
from regrasp.interfaces.wall_time import counts_as
from regrasp.sim.world import World


@dataclass(frozen=True)
class FilmParameters:
    """How a run is filmed."""

    rate: int = 10  # frames per simulated second; choice: every other tick
    overview: FixedMount = field(  # behind and above the right arm
        default_factory=lambda: FixedMount(position=(-0.55, -0.75, 0.85), pitch_down_deg=30.0, yaw_deg=38.0)
    )
    shrink: int = 2  # of the cameras' pictures, which are shown this much smaller
    overview_fov: float = 0.95  # rad, horizontal; the whole cell is in the picture


class Film:
    """Films a world while the context is open; with None as the path it does nothing."""

    def __init__(self, path: Path | None, world: World, parameters: FilmParameters = FilmParameters()) -> None:
        self._path, self._world, self._parameters = path, world, parameters
        self._stack = ExitStack()
        self._writer: VideoWriter | None = None
        self._frames = 0

    def __enter__(self) -> Self:
        if self._path is not None:
            self._writer = self._stack.enter_context(VideoWriter(self._path, self._parameters.rate))
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._stack.close()

    @counts_as("film")
    def show(self, leaf: str) -> None:
        """Write a frame of the present instant if one is due; `leaf` is the active leaf's name."""
        world = self._world
        if self._writer is None or world.now() * self._parameters.rate < self._frames - 1e-6:
            return
        self._frames += 1
        rear, wrist = (world.cameras[name].preview(self._parameters.shrink) for name in ("rear", "wrist"))
        lines = [
            f"{world.now():6.1f} s",
            f"{leaf}",
            f"gravity: {world.gravity}",
            f"renderer: {world.renderer.name}",
        ]
        overview = render_overview(world, self._parameters)
        self._writer.write(compose(overview, rear, wrist, lines))


def render_overview(world: World, parameters: FilmParameters = FilmParameters()) -> RgbImage:
    """The whole cell from behind and above the right arm: (480, 856, 3) uint8 RGB."""
    pose = parameters.overview.world_from_camera
    intrinsics = Intrinsics.from_fov(*OVERVIEW_SIZE, parameters.overview_fov)
    return np.asarray(world.renderer.render_color(world.visuals.snapshot(), pose, intrinsics, world.light))
