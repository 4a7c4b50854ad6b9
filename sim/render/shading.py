"""Compiled shading: the colour of each pixel, from the triangle that it sees and the inverse of its depth.

The formula is that of the OpenGL renderer's shaders.
"""

import numba
import numpy as np
from numpy.typing import NDArray

_ROUND = np.float32(12582912.0)  # 1.5 * 2**23: a float32 that is added to it and taken away again is whole
_SINE = tuple(np.float32(c) for c in (0.9999966, -0.1666483, 0.0083063, -0.0001836))  # odd powers, -pi/2 to pi/2
_HALF, _ONE, _ZERO = np.float32(0.5), np.float32(1.0), np.float32(0.0)
_PI, _PER_PI = np.float32(np.pi), np.float32(1.0 / np.pi)


@numba.njit(cache=True, error_model="numpy", fastmath={"contract"})
def sine(x: np.float32) -> np.float32:
    """The sine to 1e-4 for |x| < 1000, by a polynomial of its angle to the next multiple of pi."""
    half_turns = (x * _PER_PI + _ROUND) - _ROUND
    odd = half_turns - np.float32(2.0) * ((half_turns * _HALF + _ROUND) - _ROUND)  # -1, 0 or 1
    r = x - half_turns * _PI
    s = r * r
    y = r * (_SINE[0] + s * (_SINE[1] + s * (_SINE[2] + s * _SINE[3])))
    return y * (_ONE - np.float32(2.0) * odd * odd)


@numba.njit(cache=True, nogil=True, error_model="numpy")
def find_runs(seen: NDArray[np.int32], first_run: NDArray[np.int32], ends: NDArray[np.int32]) -> None:
    """Write where the runs of pixels that see one triangle end, row after row.

    The runs of row v are first_run[v] to first_run[v + 1]; each begins where the one before it in its row ends.
    """
    height, width = seen.shape
    run = 0
    for v in range(height):
        first_run[v] = run
        row = seen[v]
        for u in range(1, width):
            if row[u] != row[u - 1]:
                ends[run] = u
                run += 1
        ends[run] = width
        run += 1
    first_run[height] = run


@numba.njit(cache=True, nogil=True, error_model="numpy")
def write_normals(
    corners: NDArray[np.float64],
    triangles: NDArray[np.int32],
    normals: NDArray[np.float32],
    seen: NDArray[np.int32],
    first_run: NDArray[np.int32],
    ends: NDArray[np.int32],
    ready: NDArray[np.bool_],
    planes: NDArray[np.float32],
) -> None:
    """Write the `planes` (9) of each triangle that is in `seen`: (u, v, 1) times them is normal over depth."""
    ready[:] = False
    for v in range(len(seen)):
        for run in range(first_run[v], first_run[v + 1]):
            t = seen[v, ends[run] - 1]
            if t >= 0 and not ready[t]:
                ready[t] = True
                _write_normal(corners, triangles[t], normals, planes[t])


@numba.njit(cache=True, error_model="numpy")
def _write_normal(
    corners: NDArray[np.float64], triangle: NDArray[np.int32], normals: NDArray[np.float32], out: NDArray[np.float32]
) -> None:
    p, q, r = corners[triangle[0]], corners[triangle[1]], corners[triangle[2]]
    volume = (
        p[0] * (q[1] * r[2] - q[2] * r[1]) + p[1] * (q[2] * r[0] - q[0] * r[2]) + p[2] * (q[0] * r[1] - q[1] * r[0])
    )
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        a = (q[j] * r[k] - q[k] * r[j]) / volume
        b = (r[j] * p[k] - r[k] * p[j]) / volume
        c = (p[j] * q[k] - p[k] * q[j]) / volume
        for axis in range(3):
            out[3 * axis + i] = (
                a * normals[triangle[0], axis] + b * normals[triangle[1], axis] + c * normals[triangle[2], axis]
            )


@numba.njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
def shade(
    inverse: NDArray[np.float32],
    seen: NDArray[np.int32],
    first_run: NDArray[np.int32],
    ends: NDArray[np.int32],
    planes: NDArray[np.float32],
    item_of: NDArray[np.int32],
    colors: NDArray[np.float32],
    world_rays: NDArray[np.float32],
    light_rays: NDArray[np.float32],
    shadows: NDArray[np.float32],
    strengths: tuple[np.float32, np.float32, np.float32],
    background: NDArray[np.uint8],
    channels: NDArray[np.uint8],
) -> None:
    """Write red, green and blue (3, H, W) of a picture with `inverse` depth (H, W), whose pixels see triangles or -1.

    A pixel's ray runs to rays @ (u, v, 1) at depth 1 from rays[:, 3]: in the world, and in the light's texels and
    nearness. `colors` are of items, 0 to 255; `strengths` are of ambient and diffuse light, and the offset along the
    normal, in texels.
    """
    height, width = seen.shape
    grain, facing = np.empty(width, np.float32), np.empty(width, np.float32)
    x, y, z = np.empty(width, np.float32), np.empty(width, np.float32), np.empty(width, np.float32)
    depth = np.empty(width, np.float32)
    columns, rows = np.empty(width, np.int32), np.empty(width, np.int32)
    texels, size = shadows.ravel(), np.int32(len(shadows))
    nearer = strengths[2] / np.float32(size)
    for v in range(height):
        runs = ends[first_run[v] : first_run[v + 1]]
        _invert(inverse[v], depth)
        _grain(depth, world_rays, v, grain)
        _follow(depth, light_rays, v, x, y, z)
        _face(seen[v], runs, planes, depth, v, strengths[2], nearer, facing, x, y, z)
        _find_texels(x, size, columns)
        _find_texels(y, size, rows)
        _light(x, y, z, texels, size, columns, rows)
        _brighten(x, facing, strengths[0], strengths[1], grain)
        for channel in range(3):
            _paint(seen[v], runs, item_of, colors[:, channel], background[channel], grain, channels[channel, v])


@numba.njit(cache=True, error_model="numpy", fastmath={"contract"})
def _invert(inverse: NDArray[np.float32], depth: NDArray[np.float32]) -> None:
    for u in range(len(depth)):
        depth[u] = _ONE / inverse[u]


@numba.njit(cache=True, error_model="numpy", fastmath={"contract"})
def _grain(depth: NDArray[np.float32], rays: NDArray[np.float32], v: int, grain: NDArray[np.float32]) -> None:
    """Faint grain, fixed in the world, so that surfaces are not of one colour."""
    row = np.float32(v)
    ax, ay, az = rays[0, 0], rays[1, 0], rays[2, 0]
    bx, by, bz = (rays[0, 1] * row + rays[0, 2], rays[1, 1] * row + rays[1, 2], rays[2, 1] * row + rays[2, 2])
    ox, oy, oz = rays[0, 3], rays[1, 3], rays[2, 3]
    for u in range(len(depth)):
        column, far = np.float32(u), depth[u]
        px, py, pz = ox + far * (ax * column + bx), oy + far * (ay * column + by), oz + far * (az * column + bz)
        warp = np.float32(4.0) * sine(np.float32(11.0) * pz + np.float32(7.0) * py)
        waves = sine(np.float32(90.0) * px + warp) * sine(np.float32(37.0) * (py + pz) + warp)
        grain[u] = _ONE + np.float32(0.03) * waves


@numba.njit(cache=True, error_model="numpy", fastmath={"contract"})
def _follow(
    depth: NDArray[np.float32],
    rays: NDArray[np.float32],
    v: int,
    x: NDArray[np.float32],
    y: NDArray[np.float32],
    z: NDArray[np.float32],
) -> None:
    """The places that the row's pixels see, in the light's view."""
    row = np.float32(v)
    ax, ay, az = rays[0, 0], rays[1, 0], rays[2, 0]
    bx, by, bz = (rays[0, 1] * row + rays[0, 2], rays[1, 1] * row + rays[1, 2], rays[2, 1] * row + rays[2, 2])
    ox, oy, oz = rays[0, 3], rays[1, 3], rays[2, 3]
    for u in range(len(depth)):
        column, far = np.float32(u), depth[u]
        x[u] = ox + far * (ax * column + bx)
        y[u] = oy + far * (ay * column + by)
        z[u] = oz + far * (az * column + bz)


@numba.njit(cache=True, error_model="numpy", fastmath={"contract"})
def _face(
    seen: NDArray[np.int32],
    runs: NDArray[np.int32],
    planes: NDArray[np.float32],
    depth: NDArray[np.float32],
    v: int,
    offset: np.float32,
    nearer: np.float32,
    facing: NDArray[np.float32],
    x: NDArray[np.float32],
    y: NDArray[np.float32],
    z: NDArray[np.float32],
) -> None:
    """The cosine between normal and light; and move x, y, z off the surface, which else shadows itself in stripes."""
    row, u = np.float32(v), 0
    for end in runs:
        t = seen[u]
        if t >= 0:
            plane = planes[t]
            ax, ay, az = plane[0], plane[3], plane[6]
            bx, by, bz = plane[1] * row + plane[2], plane[4] * row + plane[5], plane[7] * row + plane[8]
            # One loop for each array that is written: the compiler then works on several pixels at once.
            far, face = depth[u:end], facing[u:end]
            for i in range(end - u):
                column = np.float32(u + i)
                nx, ny, nz = far[i] * (ax * column + bx), far[i] * (ay * column + by), far[i] * (az * column + bz)
                face[i] = -nz / np.sqrt(nx * nx + ny * ny + nz * nz)
            _add_product(x[u:end], offset, far, ax, bx, u)
            _add_product(y[u:end], offset, far, ay, by, u)
            _add_product(z[u:end], -nearer, far, az, bz, u)
        else:
            facing[u:end] = _ZERO
        u = end


@numba.njit(cache=True, error_model="numpy", fastmath={"contract"})
def _add_product(
    out: NDArray[np.float32], factor: np.float32, far: NDArray[np.float32], a: np.float32, b: np.float32, begin: int
) -> None:
    for i in range(len(out)):
        out[i] += factor * (far[i] * (a * np.float32(begin + i) + b))


@numba.njit(cache=True, error_model="numpy", fastmath={"contract"})
def _find_texels(at: NDArray[np.float32], size: np.int32, texel: NDArray[np.int32]) -> None:
    """Write the columns, or the rows, of the texels before `at`, and leave in `at` how far beyond them it lies.

    What lies outside the map, or is no number, goes to its border. Comparisons are written out here, since Python's
    min and max keep the compiler from working on several pixels at once.
    """
    last, corner = np.float32(size - 1), np.int32(size - 2)
    for u in range(len(at)):
        inside = at[u] if at[u] > _ZERO else _ZERO
        inside = inside if inside < last else last
        before = np.int32(inside)
        before = before if before < corner else corner
        at[u] = inside - np.float32(before)
        texel[u] = before


@numba.njit(cache=True, error_model="numpy", fastmath={"contract"})
def _light(
    x: NDArray[np.float32],
    y: NDArray[np.float32],
    z: NDArray[np.float32],
    texels: NDArray[np.float32],
    size: np.int32,
    columns: NDArray[np.int32],
    rows: NDArray[np.int32],
) -> None:
    """Write to x the share of light: of the four texels from column and row on, weighted by x, y, those behind z."""
    for u in range(len(x)):
        at = np.uint32(rows[u] * size + columns[u])
        near = z[u] if z[u] > _ZERO else _ZERO
        a = np.float32(near >= texels[at])
        b = np.float32(near >= texels[at + np.uint32(1)])
        c = np.float32(near >= texels[at + np.uint32(size)])
        d = np.float32(near >= texels[at + np.uint32(size + 1)])
        upper, lower = a + x[u] * (b - a), c + x[u] * (d - c)
        x[u] = upper + y[u] * (lower - upper)


@numba.njit(cache=True, error_model="numpy", fastmath={"contract"})
def _brighten(
    lit: NDArray[np.float32],
    facing: NDArray[np.float32],
    ambient: np.float32,
    diffuse: np.float32,
    grain: NDArray[np.float32],
) -> None:
    for u in range(len(lit)):
        cosine = facing[u] if facing[u] > _ZERO else _ZERO
        grain[u] *= ambient + diffuse * lit[u] * cosine


@numba.njit(cache=True, error_model="numpy", fastmath={"contract"})
def _paint(
    seen: NDArray[np.int32],
    runs: NDArray[np.int32],
    item_of: NDArray[np.int32],
    colors: NDArray[np.float32],
    background: np.uint8,
    brightness: NDArray[np.float32],
    out: NDArray[np.uint8],
) -> None:
    """One channel of a row: its items' colours times brightness."""
    top, u = np.float32(255.0), 0
    for end in runs:
        if seen[u] >= 0:
            color = colors[item_of[seen[u]]]
            part, light = out[u:end], brightness[u:end]
            for i in range(end - u):
                value = color * light[i]
                part[i] = np.uint8(np.int32((value if value < top else top) + _HALF))
        else:
            out[u:end] = background
        u = end


@numba.njit(cache=True, error_model="numpy")
def read_out(
    inverse: NDArray[np.float32],
    seen: NDArray[np.int32],
    first_run: NDArray[np.int32],
    ends: NDArray[np.int32],
    item_of: NDArray[np.int32],
    ids_of: NDArray[np.int32],
    depth: NDArray[np.float32],
    ids: NDArray[np.int32],
) -> None:
    """Write depth, 0 for none, and ids, -1 for none, of all pixels."""
    for v in range(len(seen)):
        u = 0
        for end in ends[first_run[v] : first_run[v + 1]]:
            t = seen[v, u]
            if t >= 0:
                ids[v, u:end] = ids_of[item_of[t]]
                part, row = depth[v, u:end], inverse[v, u:end]
                for i in range(end - u):
                    part[i] = _ONE / row[i]
            else:
                ids[v, u:end], depth[v, u:end] = -1, _ZERO
            u = end
