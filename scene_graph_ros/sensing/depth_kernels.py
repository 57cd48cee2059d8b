"""Loops over pixels: which show a body, which points they make, which old points they see through.

C is the camera's optical frame, x right, y down, z ahead; a pixel's number is that of its centre.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel
from scene_graph_ros.geometry.compiled.lanes import (
    bits_of,
    LANES,
    larger,
    load_lanes,
    root,
    select,
)
from scene_graph_ros.sensing.near_cells import OPEN, ROBOT

__all__ = [
    "CLEARED",
    "EDGE",
    "KEPT",
    "OPEN",
    "ROBOT",
    "SEEN_AGAIN",
    "Lens",
    "judge_points",
    "place_points",
    "take_nearest",
    "widen",
]

EDGE = 2
"""Of a block of pixels, beside OPEN and ROBOT: it is beside one that shows the robot."""

KEPT, CLEARED, SEEN_AGAIN = 0, 1, 2
"""Of an old point: nothing is known of it now, a ray goes on behind it, or ends at it."""

_STEEPEST = 5.67
"""Tangent of 80 degrees: neighbours that are farther apart along the view than at this angle of
incidence are on two surfaces."""

_MOST_BESIDE = 8
"""Pixels beside its own that a ball's rays are looked for in, to each side."""


class Lens(NamedTuple):
    """A lens in pixels."""

    fx: float
    fy: float
    cx: float
    cy: float


@lean_kernel
def take_nearest(depth, lens, step, near, far, planes):
    """Place the nearest pixel of each block of pixels, z 0 where a block has none in range.

    ``planes`` ``(3, rows, columns)`` are x, y and z of C.
    """
    height, width = depth.shape
    for i in range(planes.shape[1]):
        if step == 1:
            down = (i - lens.cy) / lens.fy
            for j in range(width):
                z = np.float64(depth[i, j])
                if not (z >= near and z <= far and z < np.inf):
                    z = np.float64(0.0)
                planes[0, i, j] = (j - lens.cx) / lens.fx * z
                planes[1, i, j] = down * z
                planes[2, i, j] = z
            continue
        for j in range(planes.shape[2]):
            best, best_v, best_u = np.inf, 0, 0
            for v in range(i * step, min((i + 1) * step, height)):
                for u in range(j * step, min((j + 1) * step, width)):
                    z = np.float64(depth[v, u])
                    if z < best and z >= near:
                        best, best_v, best_u = z, v, u
            if best > far or best == np.inf:
                best = 0.0
            planes[0, i, j] = (best_u - lens.cx) / lens.fx * best
            planes[1, i, j] = (best_v - lens.cy) / lens.fy * best
            planes[2, i, j] = best


@lean_kernel
def widen(mask, blocks):
    """Mark blocks within so many rows and columns of a robot's as beside one."""
    height, width = mask.shape
    for v in range(height):
        for u in range(width):
            if mask[v, u] != ROBOT:
                continue
            if 0 < u < width - 1 and 0 < v < height - 1:
                around = mask[v - 1, u] == ROBOT and mask[v + 1, u] == ROBOT
                if around and mask[v, u - 1] == ROBOT and mask[v, u + 1] == ROBOT:
                    continue
            for i in range(max(v - blocks, 0), min(v + blocks + 1, height)):
                for j in range(max(u - blocks, 0), min(u + blocks + 1, width)):
                    if mask[i, j] == OPEN:
                        mask[i, j] = EDGE


@inlined_kernel
def _farthest(planes, i, j, across):
    """Return the square of the distance to the farthest diagonal neighbour on the same surface."""
    rows, columns = planes.shape[1], planes.shape[2]
    x, y, z = planes[0, i, j], planes[1, i, j], planes[2, i, j]
    farthest = across
    for k in range(4):
        s, t = i - 1 + 2 * (k // 2), j - 1 + 2 * (k % 2)
        if s < 0 or s >= rows or t < 0 or t >= columns:
            continue
        dz = planes[2, s, t] - z
        if planes[2, s, t] > 0.0 and dz * dz <= _STEEPEST * _STEEPEST * across:
            dx, dy = planes[0, s, t] - x, planes[1, s, t] - y
            farthest = max(farthest, dx * dx + dy * dy + dz * dz)
    return farthest


@inlined_kernel
def _farthest_of_eight(planes, at, x, y, z, across):
    """Return `_farthest` of eight pixels that have neighbours, from a place of a plane on."""
    size, farthest = planes.shape[1] * planes.shape[2], across
    for k in range(4):
        beside = at + (2 * (k // 2) - 1) * planes.shape[2] + 2 * (k % 2) - 1
        other = load_lanes(planes, beside + 2 * size)
        dz = other - z
        dx, dy = load_lanes(planes, beside) - x, load_lanes(planes, beside + size) - y
        away = dx * dx + dy * dy + dz * dz
        is_near = (other > 0.0) & (dz * dz <= across * (_STEEPEST * _STEEPEST))
        farthest = select(is_near, larger(farthest, away), farthest)
    return farthest


@inlined_kernel
def _place_eight(planes, i, j, lens, step, X_WC, lower, upper, error, bits, count, p_WPs, radii):
    """Write those of eight pixels in a row whose bits are set, as `place_points`."""
    at, size = i * planes.shape[2] + j, planes.shape[1] * planes.shape[2]
    x, y = load_lanes(planes, at), load_lanes(planes, at + size)
    z = load_lanes(planes, at + 2 * size)
    bits &= bits_of(z > 0.0)
    if bits == 0:
        return count
    at_x = x * X_WC[0, 0] + y * X_WC[0, 1] + z * X_WC[0, 2] + X_WC[0, 3]
    at_y = x * X_WC[1, 0] + y * X_WC[1, 1] + z * X_WC[1, 2] + X_WC[1, 3]
    at_z = x * X_WC[2, 0] + y * X_WC[2, 1] + z * X_WC[2, 2] + X_WC[2, 3]
    is_in = (at_x >= lower[0]) & (at_x <= upper[0]) & (at_y >= lower[1]) & (at_y <= upper[1])
    bits &= bits_of(is_in & (at_z >= lower[2]) & (at_z <= upper[2]))
    a, b = z * float(step) / lens.fx, z * float(step) / lens.fy
    across = a * a + b * b
    own = 0.5 * root(_farthest_of_eight(planes, at, x, y, z, across)) + error
    for k in range(LANES):
        if bits >> k & 1:
            p_WPs[count, 0], p_WPs[count, 1], p_WPs[count, 2] = at_x[k], at_y[k], at_z[k]
            radii[count] = own[k]
            count += 1
    return count


@lean_kernel
def place_points(planes, mask, lens, step, X_WC, lower, upper, error, p_WPs, radii):
    """Write open points of W that are in a box, and their radii; return how many there are.

    The radius is half the distance to the farthest of the four diagonal neighbours on the same
    surface, or half a block's diagonal, and the error: the balls of four neighbours in a plane
    cover all that is between them.
    """
    rows, columns = planes.shape[1], planes.shape[2]
    count = 0
    for i in range(rows):
        j = 0
        while j < columns:
            if 0 < i < rows - 1 and 0 < j < columns - LANES:
                bits = 0
                for k in range(LANES):
                    bits |= (mask[i, j + k] == OPEN) << k
                count = _place_eight(
                    *(planes, i, j, lens, step, X_WC, lower, upper, error, bits, count),
                    *(p_WPs, radii),
                )
                j += LANES
                continue
            x, y, z = planes[0, i, j], planes[1, i, j], planes[2, i, j]
            is_in = mask[i, j] == OPEN and z > 0.0
            for axis in range(3):
                at = X_WC[axis, 0] * x + X_WC[axis, 1] * y + X_WC[axis, 2] * z + X_WC[axis, 3]
                p_WPs[count, axis] = at
                is_in &= at >= lower[axis] and at <= upper[axis]
            if is_in:
                a, b = step * z / lens.fx, step * z / lens.fy
                radii[count] = 0.5 * np.sqrt(_farthest(planes, i, j, a * a + b * b)) + error
                count += 1
            j += 1
    return count


@lean_kernel
def judge_points(p_WPs, radii, depth, mask, lens, step, X_CW, near, far, margin, verdicts):
    """Write the verdict of an image on each old point.

    It is cleared where each ray past its ball that has a depth goes on behind the ball, by more
    than the margin, and seen again where the ray through it ends in the ball or the margin.
    """
    height, width = depth.shape
    for k in range(len(p_WPs)):
        verdicts[k] = KEPT
        x, y, z = p_WPs[k, 0], p_WPs[k, 1], p_WPs[k, 2]
        at_x = X_CW[0, 0] * x + X_CW[0, 1] * y + X_CW[0, 2] * z + X_CW[0, 3]
        at_y = X_CW[1, 0] * x + X_CW[1, 1] * y + X_CW[1, 2] * z + X_CW[1, 3]
        at_z = X_CW[2, 0] * x + X_CW[2, 1] * y + X_CW[2, 2] * z + X_CW[2, 3]
        if at_z < near or at_z > far:
            continue
        across, down = lens.fx * at_x / at_z + lens.cx, lens.fy * at_y / at_z + lens.cy
        if not (across > -0.5 and down > -0.5 and across < width - 0.5 and down < height - 0.5):
            continue
        u, v = int(np.floor(across + 0.5)), int(np.floor(down + 0.5))
        shown = mask[v // step, u // step]
        if shown == EDGE or not depth[v, u] > 0.0:
            continue
        slack = radii[k] + margin
        ahead = np.float64(depth[v, u]) - at_z
        if shown == OPEN and abs(ahead) <= slack:
            verdicts[k] = SEEN_AGAIN
            continue
        beyond = at_z + slack
        if min(np.float64(depth[v, u]), far) <= beyond:
            continue
        beside = min(int(np.ceil(max(lens.fx, lens.fy) * radii[k] / at_z)), _MOST_BESIDE)
        is_free = True
        for i in range(max(v - beside, 0), min(v + beside + 1, height)):
            for j in range(max(u - beside, 0), min(u + beside + 1, width)):
                if depth[i, j] > 0.0 and depth[i, j] <= beyond:
                    is_free = False
        if is_free:
            verdicts[k] = CLEARED
