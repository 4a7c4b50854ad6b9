"""The renderers' common protocol, and the choice between them."""

from typing import Literal, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform

from regrasp.interfaces.frame import Intrinsics
from regrasp.sim.render.opengl import GlRenderer
from regrasp.sim.render.picture import Image, LightState
from regrasp.sim.render.software import SoftwareRenderer
from regrasp.sim.render.visuals import Visuals

__all__ = ["Image", "LightState", "Renderer", "RendererName", "make_renderer"]

RendererName = Literal["auto", "moderngl", "software"]


class Renderer(Protocol):
    """Draws the items of `visuals`. `reason` says in words why this renderer was chosen."""

    visuals: Visuals
    name: str
    reason: str

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


def make_renderer(visuals: Visuals, choice: RendererName = "auto") -> Renderer:
    """The chosen renderer; "auto" takes moderngl where an EGL context can be made, else our own.

    Raises whatever moderngl raises if it is chosen by name and no context can be made.
    """
    if choice == "software":
        return SoftwareRenderer(visuals, "asked for")
    if choice == "moderngl":
        return GlRenderer(visuals, "asked for")
    try:
        return GlRenderer(visuals, "an EGL context can be made here")
    except Exception as error:  # moderngl and glcontext raise bare Exception
        return SoftwareRenderer(visuals, f"no EGL context can be made here ({error})")
