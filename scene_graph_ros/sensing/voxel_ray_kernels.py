"""Loops over voxels and pixels: space that an image of depth sees through, and its rays' ends.

C is the camera's optical frame, x right, y down, z ahead; a pixel's number is that of its centre.
The least depth in a rectangle of pixels is that of a few squares that cover it, of edges that are
powers of two and whose least depths are known (Bender and Farach-Colton, *The LCA Problem
Revisited*, 2000, for rows).
"""

import math

import numpy as np

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel
from scene_graph_ros.geometry.shapes.voxel_grid import Voxel
from scene_graph_ros.sensing.depth_kernels import EDGE, OPEN

__all__ = [
    "BLOCK",
    "LEVELS",
    "TILE",
    "cast_on_face",
    "mark_hits",
    "mark_point_hits",
    "mark_seen_through",
    "take_depths",
]

BLOCK = 8
"""Voxels along an edge of a block that is looked at as a whole first."""
LEVELS = 7
"""Of squares of pixels: the largest have an edge of 64."""
TILE = 16
"""Pixels along an edge of a square whose largest depth is known."""
_FREE, _OCCUPIED = int(Voxel.FREE), int(Voxel.OCCUPIED)
_OUTWARD = 1e-9
"""A projection is made wider by so many pixels, beyond all rounding."""
_SINGLE = 2e-7
"""Of a depth in single precision: it is made nearer by more than rounding."""


@lean_kernel
def take_depths(depth, mask, step, near, far, least, largest):
    """Write the least depths of squares ``(LEVELS, h, w)``, and the largest ones of tiles.

    Pixels without a depth, or beside the robot, have 0; those beyond ``far`` have that.
    Squares end at the image's border.
    """
    height, width = depth.shape
    for v in range(height):
        for u in range(width):
            z = depth[v, u]
            if not z >= near or mask[v // step, u // step] == EDGE:
                z = np.float32(0.0)
            elif z > far:
                z = np.float32(far)
            least[0, v, u] = z
            i, j = v // TILE, u // TILE
            if (v % TILE == 0 and u % TILE == 0) or z > largest[i, j]:
                largest[i, j] = z
    for level in range(1, LEVELS):
        half = 1 << (level - 1)
        for v in range(height):
            below = min(v + half, height - 1)
            for u in range(width):
                beside = min(u + half, width - 1)
                one = min(least[level - 1, v, u], least[level - 1, v, beside])
                other = min(least[level - 1, below, u], least[level - 1, below, beside])
                least[level, v, u] = min(one, other)


@inlined_kernel
def _least_depth(least, rows, columns):
    """Return the least depth in rows and columns ``(first, last)`` of pixels."""
    smaller, level = min(rows[1] - rows[0], columns[1] - columns[0]) + 1, 0
    while level + 1 < LEVELS and (2 << level) <= smaller:
        level += 1
    edge, result, v, is_last = 1 << level, np.float32(math.inf), rows[0], False
    while not is_last:
        if v + edge > rows[1]:
            v, is_last = rows[1] + 1 - edge, True
        u, is_end = columns[0], False
        while not is_end:
            if u + edge > columns[1]:
                u, is_end = columns[1] + 1 - edge, True
            result = min(result, least[level, v, u])
            u += edge
        v += edge
    return result


@inlined_kernel
def _largest_depth(largest, rows, columns):
    """Return the largest depth in the tiles that have these pixels."""
    result = np.float32(0.0)
    for i in range(rows[0] // TILE, rows[1] // TILE + 1):
        for j in range(columns[0] // TILE, columns[1] // TILE + 1):
            result = max(result, largest[i, j])
    return result


@inlined_kernel
def _depths(X_CG, low, high):
    """Return (least, largest z in C) of a box of G by its corners."""
    least, largest = X_CG[2, 3], X_CG[2, 3]
    for axis in range(3):
        a, b = X_CG[2, axis] * low[axis], X_CG[2, axis] * high[axis]
        least, largest = least + min(a, b), largest + max(a, b)
    return least, largest


@inlined_kernel
def _pixels(lens, X_CG, low, high):
    """Return first and last rows, and columns, that a box ahead of the camera is seen in.

    They are floats, as far outside of the image as may be.
    """
    u_least, u_most, v_least, v_most = math.inf, -math.inf, math.inf, -math.inf
    for corner in range(8):
        x = high[0] if corner & 1 else low[0]
        y = high[1] if corner & 2 else low[1]
        z = high[2] if corner & 4 else low[2]
        p = X_CG[0, 0] * x + X_CG[0, 1] * y + X_CG[0, 2] * z + X_CG[0, 3]
        q = X_CG[1, 0] * x + X_CG[1, 1] * y + X_CG[1, 2] * z + X_CG[1, 3]
        r = X_CG[2, 0] * x + X_CG[2, 1] * y + X_CG[2, 2] * z + X_CG[2, 3]
        u, v = lens.fx * p / r + lens.cx, lens.fy * q / r + lens.cy
        u_least, u_most = min(u_least, u), max(u_most, u)
        v_least, v_most = min(v_least, v), max(v_most, v)
    rows = np.floor(v_least + 0.5 - _OUTWARD), np.floor(v_most + 0.5 + _OUTWARD)
    return rows, (np.floor(u_least + 0.5 - _OUTWARD), np.floor(u_most + 0.5 + _OUTWARD))


@inlined_kernel
def _is_inside(rows, columns, height, width):
    return rows[0] >= 0.0 and columns[0] >= 0.0 and rows[1] < height and columns[1] < width


@inlined_kernel
def _clipped(pair, count):
    """Return first and last pixel, of those that there are."""
    return int(min(max(pair[0], 0.0), count - 1.0)), int(min(max(pair[1], 0.0), count - 1.0))


@inlined_kernel
def _is_seen_through(lens, X_CG, near, margin, least, low, high):
    """Return True for a box wholly in view, if all rays through it go on behind it."""
    nearest, farthest = _depths(X_CG, low, high)
    if not nearest >= near:
        return False
    rows, columns = _pixels(lens, X_CG, low, high)
    height, width = least.shape[1], least.shape[2]
    if not _is_inside(rows, columns, height, width):
        return False
    seen = _least_depth(least, _clipped(rows, height), _clipped(columns, width))
    return seen > farthest + margin


@inlined_kernel
def _is_hidden(lens, X_CG, near, largest, size, low, high):
    """Return True for a box without a part that is seen through: out of view, or behind all."""
    nearest, farthest = _depths(X_CG, low, high)
    if farthest < near:
        return True
    if not nearest >= near:
        return False
    rows, columns = _pixels(lens, X_CG, low, high)
    if rows[1] < 0.0 or columns[1] < 0.0 or rows[0] >= size[0] or columns[0] >= size[1]:
        return True
    seen = _largest_depth(largest, _clipped(rows, size[0]), _clipped(columns, size[1]))
    return seen <= nearest


@lean_kernel
def mark_seen_through(least, largest, lens, X_CG, voxel, near, margin, states):
    """Mark voxels as free that are seen through, blocks of them first; return how many were not.

    ``least`` and ``largest`` are those of ``take_depths``.
    """
    nx, ny, nz = states.shape
    size, count = (least.shape[1], least.shape[2]), 0
    for i in range(0, nx, BLOCK):
        for j in range(0, ny, BLOCK):
            for k in range(0, nz, BLOCK):
                end = min(i + BLOCK, nx), min(j + BLOCK, ny), min(k + BLOCK, nz)
                low = i * voxel, j * voxel, k * voxel
                high = end[0] * voxel, end[1] * voxel, end[2] * voxel
                if _is_hidden(lens, X_CG, near, largest, size, low, high):
                    continue
                is_free = _is_seen_through(lens, X_CG, near, margin, least, low, high)
                for a in range(i, end[0]):
                    for b in range(j, end[1]):
                        for c in range(k, end[2]):
                            if states[a, b, c] == _FREE:
                                continue
                            low = a * voxel, b * voxel, c * voxel
                            high = (a + 1) * voxel, (b + 1) * voxel, (c + 1) * voxel
                            if is_free or _is_seen_through(
                                lens, X_CG, near, margin, least, low, high
                            ):
                                states[a, b, c] = _FREE
                                count += 1
    return count


@inlined_kernel
def _hit(p_C, X_WC, X_GW, region, voxel, states):
    """Mark the voxel of a point as occupied; return 1 where it was not."""
    x, y, z = p_C
    p = X_WC[0, 0] * x + X_WC[0, 1] * y + X_WC[0, 2] * z + X_WC[0, 3]
    q = X_WC[1, 0] * x + X_WC[1, 1] * y + X_WC[1, 2] * z + X_WC[1, 3]
    r = X_WC[2, 0] * x + X_WC[2, 1] * y + X_WC[2, 2] * z + X_WC[2, 3]
    if p < region[0, 0] or q < region[0, 1] or r < region[0, 2]:
        return 0
    if p > region[1, 0] or q > region[1, 1] or r > region[1, 2]:
        return 0
    a = (X_GW[0, 0] * p + X_GW[0, 1] * q + X_GW[0, 2] * r + X_GW[0, 3]) / voxel
    b = (X_GW[1, 0] * p + X_GW[1, 1] * q + X_GW[1, 2] * r + X_GW[1, 3]) / voxel
    c = (X_GW[2, 0] * p + X_GW[2, 1] * q + X_GW[2, 2] * r + X_GW[2, 3]) / voxel
    nx, ny, nz = states.shape
    if a < 0.0 or b < 0.0 or c < 0.0 or a >= nx or b >= ny or c >= nz:
        return 0
    if states[int(a), int(b), int(c)] == _OCCUPIED:
        return 0
    states[int(a), int(b), int(c)] = _OCCUPIED
    return 1


@lean_kernel
def mark_hits(depth, mask, step, lens, ranges, X_WC, X_GW, region, voxel, states):
    """Mark voxels that have a pixel's point as occupied; return how many were not.

    ``ranges`` are the least and the largest depth that the camera sees; ``region`` ``(2, 3)``
    are the corners of a box of W: outside of it there is no point.
    """
    height, width = depth.shape
    count = 0
    for v in range(height):
        for u in range(width):
            z = np.float64(depth[v, u])
            if not z >= ranges[0] or z > ranges[1] or mask[v // step, u // step] != OPEN:
                continue
            x, y = (u - lens.cx) / lens.fx * z, (v - lens.cy) / lens.fy * z
            count += _hit((x, y, z), X_WC, X_GW, region, voxel, states)
    return count


@lean_kernel
def mark_point_hits(p_SPs, mask, ranges, X_WS, X_GW, region, voxel, states):
    """Mark voxels that have one of a sensor's points as `mark_hits` does; ranges are distances."""
    count = 0
    for k in range(len(p_SPs)):
        x, y, z = p_SPs[k, 0], p_SPs[k, 1], p_SPs[k, 2]
        distance = math.sqrt(x * x + y * y + z * z)
        if mask[k] == OPEN and ranges[0] <= distance <= ranges[1]:
            count += _hit((x, y, z), X_WS, X_GW, region, voxel, states)
    return count


@lean_kernel
def cast_on_face(p_SPs, mask, ranges, R_CS, lens, depth):
    """Write the least depth of the rays in each pixel ``(h, w)`` of a camera C at S.

    It is 0 where there is no ray, or one beside the robot, or one that ends too near. Returns how
    many rays are in view.
    """
    height, width = depth.shape
    depth[:, :] = np.float32(math.inf)
    count = 0
    for k in range(len(p_SPs)):
        x, y, z = p_SPs[k, 0], p_SPs[k, 1], p_SPs[k, 2]
        ahead = R_CS[2, 0] * x + R_CS[2, 1] * y + R_CS[2, 2] * z
        if not ahead > 0.0:
            continue
        u = lens.fx * ((R_CS[0, 0] * x + R_CS[0, 1] * y + R_CS[0, 2] * z) / ahead) + lens.cx
        v = lens.fy * ((R_CS[1, 0] * x + R_CS[1, 1] * y + R_CS[1, 2] * z) / ahead) + lens.cy
        u, v = np.floor(u + 0.5), np.floor(v + 0.5)
        if not (0.0 <= u < width and 0.0 <= v < height):
            continue
        count += 1
        distance = math.sqrt(x * x + y * y + z * z)
        if mask[k] == EDGE or not distance >= ranges[0]:
            ahead = 0.0
        elif distance > ranges[1]:
            ahead *= ranges[1] / distance
        end = np.float32(ahead * (1.0 - _SINGLE))
        depth[int(v), int(u)] = min(depth[int(v), int(u)], end)
    for i in range(height):
        for j in range(width):
            if depth[i, j] == np.float32(math.inf):
                depth[i, j] = np.float32(0.0)
    return count
