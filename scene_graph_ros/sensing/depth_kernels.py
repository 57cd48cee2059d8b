"""Loops over pixels: which show a body, which points they make, which old points they see through.

C is the camera's optical frame, x right, y down, z ahead; a pixel's number is that of its centre.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from scene_graph_ros.geometry.compiled.kernel import lean_kernel

__all__ = [
    "CLEARED",
    "EDGE",
    "KEPT",
    "OPEN",
    "ROBOT",
    "SEEN_AGAIN",
    "Lens",
    "judge_points",
    "mark_in_box",
    "place_points",
    "take_nearest",
    "widen",
]

OPEN, ROBOT, EDGE = 0, 1, 2
"""Of a block of pixels: it shows something else, a body of the robot, or is beside one."""

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
def take_nearest(depth, lens, step, near, far, p_CPs):
    """Place the nearest pixel of each block of pixels, z 0 where a block has none in range."""
    height, width = depth.shape
    for i in range(p_CPs.shape[0]):
        for j in range(p_CPs.shape[1]):
            best, best_v, best_u = np.inf, 0, 0
            for v in range(i * step, min((i + 1) * step, height)):
                for u in range(j * step, min((j + 1) * step, width)):
                    z = np.float64(depth[v, u])
                    if z < best and z >= near:
                        best, best_v, best_u = z, v, u
            if best > far:
                best = 0.0
            p_CPs[i, j, 0] = (best_u - lens.cx) / lens.fx * best
            p_CPs[i, j, 1] = (best_v - lens.cy) / lens.fy * best
            p_CPs[i, j, 2] = best


@lean_kernel
def mark_in_box(p_CPs, X_BC, center, half, window, mask):
    """Mark points of a window of blocks that are in a box of B; return how many are new."""
    count = 0
    for i in range(window[0], window[1]):
        for j in range(window[2], window[3]):
            x, y, z = p_CPs[i, j, 0], p_CPs[i, j, 1], p_CPs[i, j, 2]
            if mask[i, j] != OPEN or not z > 0.0:
                continue
            is_in = True
            for axis in range(3):
                at = X_BC[axis, 0] * x + X_BC[axis, 1] * y + X_BC[axis, 2] * z + X_BC[axis, 3]
                is_in &= abs(at - center[axis]) <= half[axis]
            if is_in:
                mask[i, j] = ROBOT
                count += 1
    return count


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


@lean_kernel
def place_points(p_CPs, mask, lens, step, X_WC, lower, upper, error, p_WPs, radii):
    """Write open points of W that are in a box, and their radii; return how many there are.

    The radius is half the distance to the farthest of the four diagonal neighbours on the same
    surface, or half a block's diagonal, and the error: the balls of four neighbours in a plane
    cover all that is between them.
    """
    rows, columns = p_CPs.shape[0], p_CPs.shape[1]
    count = 0
    for i in range(rows):
        for j in range(columns):
            x, y, z = p_CPs[i, j, 0], p_CPs[i, j, 1], p_CPs[i, j, 2]
            if mask[i, j] != OPEN or not z > 0.0:
                continue
            is_in = True
            for axis in range(3):
                at = X_WC[axis, 0] * x + X_WC[axis, 1] * y + X_WC[axis, 2] * z + X_WC[axis, 3]
                p_WPs[count, axis] = at
                is_in &= at >= lower[axis] and at <= upper[axis]
            if not is_in:
                continue
            a, b = step * z / lens.fx, step * z / lens.fy
            across = a * a + b * b
            farthest = across
            for k in range(4):
                s, t = i - 1 + 2 * (k // 2), j - 1 + 2 * (k % 2)
                if s < 0 or s >= rows or t < 0 or t >= columns:
                    continue
                dz = p_CPs[s, t, 2] - z
                if p_CPs[s, t, 2] > 0.0 and dz * dz <= _STEEPEST * _STEEPEST * across:
                    dx, dy = p_CPs[s, t, 0] - x, p_CPs[s, t, 1] - y
                    farthest = max(farthest, dx * dx + dy * dy + dz * dz)
            radii[count] = 0.5 * np.sqrt(farthest) + error
            count += 1
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
