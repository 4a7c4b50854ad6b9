"""Forward kinematics, compiled: where the links of a chain are, and the spheres on them."""

import numba as nb
import numpy as np
from numpy.typing import NDArray

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.robot.chain import Chain
from regrasp.motion.robots.poses import multiply

ANY_AXIS, SLIDE = 3, 4  # kinds of joints; 0, 1 and 2 turn about x, y and z
# Columns of a joint table; compiled functions take one array in half the time that they take four.
AXIS, KIND, SIGN, LOWER, UPPER = 3, 6, 7, 8, 9


def joint_table(chain: Chain) -> FloatArray:
    """A chain (n, 10) as compiled functions take it, see `Chain`: origin, axis, kind, sign and limits of each joint.

    The sign is -1 for joints that turn about a coordinate axis the other way.
    """
    along = np.abs(chain.axes) == 1.0
    kinds = np.where(along.any(axis=1), along.argmax(axis=1), ANY_AXIS)
    kinds[chain.slides] = SLIDE
    signs = np.where(kinds < ANY_AXIS, chain.axes.sum(axis=1), 1.0)
    return np.column_stack([chain.origins, chain.axes, kinds, signs, chain.lower, chain.upper])


def joint_kinds(joints: FloatArray) -> NDArray[np.int64]:
    """The kinds (n,) in a joint table."""
    return joints[:, KIND].astype(np.int64)


@nb.njit(cache=True)  # type: ignore[untyped-decorator,unused-ignore]
def link_frames_in(base: FloatArray, joints: FloatArray, q: FloatArray) -> FloatArray:
    """Frames of the base and the links (n + 1, 4, 4) for a base frame (4, 4), a joint table and positions (n,)."""
    out = np.zeros((len(q) + 1, 4, 4))
    out[0], out[1:, 3, 3] = base, 1.0
    place_links(out, joints, q)
    return out


@nb.njit(cache=True)  # type: ignore[untyped-decorator,unused-ignore]
def place_links(frames: FloatArray, joints: FloatArray, q: FloatArray) -> None:
    """Write the frames of the links, but for their last rows, behind that of the base; see `link_frames_in`."""
    for i in range(len(q)):
        x, y, z = joints[i, 0], joints[i, 1], joints[i, 2]
        for r in range(3):
            frames[i + 1, r, 3] = frames[i, r, 3] + frames[i, r, 0] * x + frames[i, r, 1] * y + frames[i, r, 2] * z
        a = int(joints[i, KIND])
        if a < ANY_AXIS:
            angle = joints[i, SIGN] * q[i]
            c, s = np.cos(angle), np.sin(angle)
            u, v = a + 1 if a < 2 else 0, a - 1 if a > 0 else 2
            for r in range(3):
                frames[i + 1, r, a] = frames[i, r, a]
                frames[i + 1, r, u] = c * frames[i, r, u] + s * frames[i, r, v]
                frames[i + 1, r, v] = c * frames[i, r, v] - s * frames[i, r, u]
        elif a == SLIDE:
            for r in range(3):
                for k in range(3):
                    frames[i + 1, r, k] = frames[i, r, k]
                    frames[i + 1, r, 3] += frames[i, r, k] * joints[i, AXIS + k] * q[i]
        else:
            _turn_about(joints[i, AXIS : AXIS + 3], np.cos(q[i]), np.sin(q[i]), frames, i)


@nb.njit(cache=True)  # type: ignore[untyped-decorator,unused-ignore]
def _turn_about(axis: FloatArray, c: float, s: float, frames: FloatArray, i: int) -> None:
    r"""Turn frame i + 1 as frame i, and about a unit vector (3,) by an angle with that cosine and sine.

    By Rodrigues' formula for a row of the matrix: :math:`v c + v \times a s + a (a v) (1 - c)`.
    """
    u, v, w = axis
    for r in range(3):
        x, y, z = frames[i, r, 0], frames[i, r, 1], frames[i, r, 2]
        along = (1 - c) * (x * u + y * v + z * w)
        frames[i + 1, r, 0] = c * x + s * (y * w - z * v) + along * u
        frames[i + 1, r, 1] = c * y + s * (z * u - x * w) + along * v
        frames[i + 1, r, 2] = c * z + s * (x * v - y * u) + along * w


@nb.njit(cache=True)  # type: ignore[untyped-decorator,unused-ignore]
def tool_frame(base: FloatArray, joints: FloatArray, last_from_tool: FloatArray, q: FloatArray) -> FloatArray:
    """world_from_tool (4, 4) at positions (n,)."""
    return multiply(link_frames_in(base, joints, q)[len(q)], last_from_tool)


@nb.njit(cache=True)  # type: ignore[untyped-decorator,unused-ignore]
def world_spheres(
    base: FloatArray, joints: FloatArray, q: FloatArray, links: NDArray[np.int64], local: FloatArray
) -> FloatArray:
    """Spheres (m, 4) m in the world, from those in the frames of their `links` (m,)."""
    return spheres_in(link_frames_in(base, joints, q), links, local)


@nb.njit(cache=True)  # type: ignore[untyped-decorator,unused-ignore]
def spheres_in(frames: FloatArray, links: NDArray[np.int64], local: FloatArray) -> FloatArray:
    """`world_spheres` with the frames (n + 1, 4, 4) of the links."""
    out = np.empty_like(local)
    for n in range(local.shape[0]):
        f = frames[links[n]]
        for r in range(3):
            out[n, r] = f[r, 0] * local[n, 0] + f[r, 1] * local[n, 1] + f[r, 2] * local[n, 2] + f[r, 3]
        out[n, 3] = local[n, 3]
    return out


@nb.njit(cache=True)  # type: ignore[untyped-decorator,unused-ignore]
def tool_jacobian(base: FloatArray, joints: FloatArray, last_from_tool: FloatArray, q: FloatArray) -> FloatArray:
    """Derivative (6, n) of the tool's position (m) and rotation (rad), in the world, by the joints."""
    frames = link_frames_in(base, joints, q)
    tool = multiply(frames[len(q)], last_from_tool)
    out = np.zeros((6, len(q)))
    for i in range(len(q)):
        axis = np.zeros(3)
        for r in range(3):
            for k in range(3):
                axis[r] += frames[i, r, k] * joints[i, AXIS + k]
        if joints[i, KIND] == SLIDE:
            out[:3, i] = axis
        else:
            out[:3, i] = np.cross(axis, tool[:3, 3] - frames[i + 1, :3, 3])
            out[3:, i] = axis
    return out
