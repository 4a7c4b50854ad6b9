"""The renderers' common protocol, and the choice between them."""

from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform

from regrasp.interfaces.frame import Intrinsics
from regrasp.sim.render.picture import Image, LightState, RendererName
from regrasp.sim.render.software import SoftwareRenderer
from regrasp.sim.render.visuals import Visuals

__all__ = ["Image", "LightState", "Renderer", "RendererName", "make_renderer"]


class Renderer(Protocol):
    """Draws the items of `visuals`. `device` says in words what draws."""

    visuals: Visuals
    name: RendererName
    device: str

    def render(
        self, poses: NDArray[np.float32], world_from_camera: RigidTransform, intrinsics: Intrinsics, light: LightState
    ) -> Image:
        """The picture of the items at `poses`, a `Visuals.snapshot`, from an optical frame (x right, y down)."""
        ...

    def render_color(
        self, poses: NDArray[np.float32], world_from_camera: RigidTransform, intrinsics: Intrinsics, light: LightState
    ) -> NDArray[np.uint8]:
        """As `render`, but only the picture's `rgb`, for films."""
        ...

    def close(self) -> None:
        """Free the renderer's context."""
        ...


def make_renderer(visuals: Visuals, choice: RendererName = "software") -> Renderer:
    """The chosen renderer. The software one draws the same pictures on every machine, and is faster than Mesa's.

    Raises whatever moderngl raises if it is chosen and no EGL context can be made.
    """
    if choice == "moderngl":
        from regrasp.sim.render.opengl import GlRenderer  # late: few ask for it, and it takes 30 MB

        return GlRenderer(visuals)
    return SoftwareRenderer(visuals)
