"""Films a run: overview and the cell's first two cameras side by side, the active leaf and the clock."""

import sys
from collections import deque
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from regrasp.app.run.video import OVERVIEW_SIZE, RgbImage, VideoWriter, compose
from regrasp.interfaces.frame import Intrinsics
from regrasp.interfaces.wall_time import counts_as
from regrasp.sim.render.picture import LightState
from regrasp.sim.render.renderer import Renderer, make_renderer
from regrasp.sim.world import World

Preview = Callable[[Renderer], RgbImage] | None


@dataclass(frozen=True)
class FilmParameters:
    """How a run is filmed."""

    rate: int = 10  # frames per simulated second; choice: every other tick
    cameras: int = 2  # that are shown, at most; the picture has room for two
    shrink: int = 2  # of the cameras' pictures, which are shown this much smaller
    overview_fov: float = 0.95  # rad, horizontal; the whole cell is in the picture
    max_waiting: int = 8  # frames that wait to be drawn before the run waits for them
    # s after which the run's thread must let the film's go on; Python's own 5 ms would add up to more than the drawing
    switch_interval: float = 1e-4


class Film:
    """Films a world while the context is open; with None as the path it does nothing.

    A thread of its own draws and encodes the frames, with a renderer of its own, while the run goes on: `show` only
    notes what is to be seen. It waits while too many frames are not drawn yet, and raises what went wrong in the
    thread.
    """

    def __init__(self, path: Path | None, world: World[Any], parameters: FilmParameters = FilmParameters()) -> None:
        self._path, self._world, self._parameters = path, world, parameters
        self._stack = ExitStack()
        self._writer: VideoWriter | None = None
        self._thread: ThreadPoolExecutor
        self._renderer: Future[Renderer]
        self._waiting: deque[Future[None]] = deque()
        self._frames = 0

    def __enter__(self) -> Self:
        if self._path is None:
            return self
        with ExitStack() as stack:  # undoes what is done if a step fails
            self._writer = stack.enter_context(VideoWriter(self._path, self._parameters.rate))
            stack.callback(sys.setswitchinterval, sys.getswitchinterval())
            sys.setswitchinterval(self._parameters.switch_interval)
            self._thread = stack.enter_context(ThreadPoolExecutor(1, "film"))
            self._renderer = self._thread.submit(make_renderer, self._world.visuals, self._world.renderer.name)
            stack.callback(self._close_renderer)
            self._stack = stack.pop_all()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._stack.close()

    def finish(self) -> None:
        """Wait until all frames are drawn. Raises what went wrong in the thread."""
        self._wait(0)

    @counts_as("film")
    def show(self, leaf: str) -> None:
        """Take a frame of the present instant if one is due; `leaf` is the active leaf's name."""
        world = self._world
        if self._writer is None or world.now() * self._parameters.rate < self._frames - 1e-6:
            return
        self._frames += 1
        shown = [*world.cameras.items()][: self._parameters.cameras]
        previews = [(name, camera.deferred_preview(self._parameters.shrink)) for name, camera in shown]
        lines = [
            f"{world.now():6.1f} s",
            f"{leaf}",
            f"gravity: {world.gravity}",
            f"renderer: {world.renderer.name}",
        ]
        poses, light = world.visuals.deferred_snapshot(), world.light
        self._waiting.append(self._thread.submit(self._draw, self._writer, poses, light, previews, lines))
        self._wait(self._parameters.max_waiting)

    def _draw(
        self,
        writer: VideoWriter,
        poses: Callable[[], NDArray[np.float32]],
        light: LightState,
        previews: list[tuple[str, Preview]],
        lines: list[str],
    ) -> None:
        renderer = self._renderer.result()
        cameras = [(name, None if preview is None else preview(renderer)) for name, preview in previews]
        writer.write(compose(self._overview(renderer, poses(), light), cameras, lines))

    def _overview(self, renderer: Renderer, poses: NDArray[np.float32], light: LightState) -> RgbImage:
        """The cell from its viewpoint: (480, 856, 3) uint8 RGB; `poses` are a `Visuals.snapshot`."""
        intrinsics = Intrinsics.from_fov(*OVERVIEW_SIZE, self._parameters.overview_fov)
        viewpoint = self._world.cell.viewpoint.world_from_camera
        return np.asarray(renderer.render_color(poses, viewpoint, intrinsics, light))

    def _wait(self, count: int) -> None:
        """Wait until no more than `count` frames wait to be drawn. Raises, once, what went wrong in the thread."""
        while self._waiting and (len(self._waiting) > count or self._waiting[0].done()):
            try:
                self._waiting.popleft().result()
            except Exception:
                self._waiting.clear()
                raise

    def _close_renderer(self) -> None:
        """Close the renderer in the thread that made it, as OpenGL wants it."""
        with suppress(Exception):  # if it could not be made, a frame has raised that
            self._thread.submit(lambda: self._renderer.result().close()).result()
