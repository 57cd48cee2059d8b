"""Loops over the rays of a cloud, from a sensor's origin to each of its points.

S is the sensor's frame. Directions are binned on the six faces of a cube about the origin of S:
the face of the largest coordinate, where the other two, divided by it, are within -1 and 1. A
face's window is the part of it that has rays, in square cells of one edge for all faces.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from scene_graph_ros.geometry.compiled.kernel import lean_kernel
from scene_graph_ros.sensing.depth_kernels import CLEARED, EDGE, KEPT, SEEN_AGAIN
from scene_graph_ros.sensing.near_cells import OPEN, ROBOT

__all__ = ["RayGrid", "bin_rays", "find_windows", "judge_by_rays", "place_cloud", "widen_rays"]

_MOST_BESIDE = 8
"""Cells beside its own that a ball's rays are looked for in, to each side."""


class RayGrid(NamedTuple):
    """Rays by cells: those of cell k are rows ``starts[k]`` to ``starts[k + 1]`` of ``rays``."""

    edge: float
    corners: np.ndarray
    """``(6, 2)``: where each face's window begins."""
    sizes: np.ndarray
    """``(6, 3)``: its rows, its columns, and the number of its first cell."""
    starts: np.ndarray
    rays: np.ndarray
    """``(n, 4)``: unit directions in S, and lengths, m."""
    rows: np.ndarray
    """``(n,)``: the points that they end at."""


@lean_kernel
def _face(x, y, z):
    """Return the face of a direction, and where on it: along the next axis and the one after."""
    ax, ay, az = abs(x), abs(y), abs(z)
    if ax >= ay and ax >= az:
        return int(x < 0.0), y / ax, z / ax
    if ay >= az:
        return 2 + int(y < 0.0), z / ay, x / ay
    return 4 + int(z < 0.0), x / az, y / az


@lean_kernel
def find_windows(p_SPs, near, bounds):
    """Write the least and largest place on each face, ``(6, 4)``; return how many rays there are.

    Points nearer than ``near``, m, are no rays.
    """
    for face in range(6):
        bounds[face, 0], bounds[face, 1] = np.inf, np.inf
        bounds[face, 2], bounds[face, 3] = -np.inf, -np.inf
    count = 0
    for k in range(len(p_SPs)):
        x, y, z = p_SPs[k, 0], p_SPs[k, 1], p_SPs[k, 2]
        if not x * x + y * y + z * z >= near * near:
            continue
        face, s, t = _face(x, y, z)
        bounds[face, 0], bounds[face, 1] = min(bounds[face, 0], s), min(bounds[face, 1], t)
        bounds[face, 2], bounds[face, 3] = max(bounds[face, 2], s), max(bounds[face, 3], t)
        count += 1
    return count


@lean_kernel
def bin_rays(p_SPs, near, edge, corners, sizes, cells, starts, rays, rows):
    """Sort rays by their cells; return how many cells have some.

    ``starts``, zeros, has two more than there are cells, and ``starts[1:]`` is then that of a
    `RayGrid`; ``cells`` ``(n,)`` is a scratch buffer.
    """
    for k in range(len(p_SPs)):
        x, y, z = p_SPs[k, 0], p_SPs[k, 1], p_SPs[k, 2]
        cells[k] = -1
        if not x * x + y * y + z * z >= near * near:
            continue
        face, s, t = _face(x, y, z)
        row, column = int((t - corners[face, 1]) / edge), int((s - corners[face, 0]) / edge)
        cells[k] = sizes[face, 2] + row * sizes[face, 1] + column
        starts[cells[k] + 1] += 1
    filled = 0
    for cell in range(len(starts) - 1):
        filled += int(starts[cell + 1] > 0)
        starts[cell + 1] += starts[cell]
    # Backwards, so that each cell's counter ends at its first ray.
    for k in range(len(p_SPs) - 1, -1, -1):
        if cells[k] < 0:
            continue
        x, y, z = p_SPs[k, 0], p_SPs[k, 1], p_SPs[k, 2]
        length = np.sqrt(x * x + y * y + z * z)
        starts[cells[k] + 1] -= 1
        at = starts[cells[k] + 1]
        rays[at, 0], rays[at, 1], rays[at, 2] = x / length, y / length, z / length
        rays[at, 3] = length
        rows[at] = k
    return filled


@lean_kernel
def _columns(x, z, r):
    """Return the places on a face between which a disc of the plane of x and z is seen.

    z is the distance along the face's axis; the tangents through the origin, (x z -+ r sqrt(x^2 +
    z^2 - r^2)) / (z^2 - r^2), or all of the face where they do not meet it.
    """
    if z <= r:
        return -1.0, 1.0
    root = r * np.sqrt(max(x * x + z * z - r * r, 0.0))
    below = z * z - r * r
    return (x * z - root) / below, (x * z + root) / below


@lean_kernel
def _window(grid, face, x, y, z, r):
    """Return first and last row and column of the cells of a face that a ball of S may cover."""
    axis = face // 2
    if axis == 0:
        ahead, first, second = x, y, z
    elif axis == 1:
        ahead, first, second = y, z, x
    else:
        ahead, first, second = z, x, y
    ahead = -ahead if face % 2 else ahead
    rows, columns = grid.sizes[face, 0], grid.sizes[face, 1]
    if rows == 0 or ahead <= -r:
        return 0, -1, 0, -1
    s_low, s_high = _columns(first, ahead, r)
    t_low, t_high = _columns(second, ahead, r)
    edge, s, t = grid.edge, grid.corners[face, 0], grid.corners[face, 1]
    # Clipped as floats: far outside of the window no integer has them.
    row = int(min(max((t_low - t) / edge - 1.0, 0.0), float(rows)))
    column = int(min(max((s_low - s) / edge - 1.0, 0.0), float(columns)))
    last_row = int(min(max((t_high - t) / edge + 1.0, -1.0), rows - 1.0))
    last_column = int(min(max((s_high - s) / edge + 1.0, -1.0), columns - 1.0))
    return row, last_row, column, last_column


@lean_kernel
def judge_by_rays(p_WPs, radii, grid, mask, X_SW, near, far, margin, verdicts):
    """Write the verdict of a cloud on each old point.

    It is cleared where at least one ray goes through its ball, and each one that does goes on
    behind it by more than the margin; it is seen again where the ray nearest to its centre ends in
    the ball or the margin.
    """
    for k in range(len(p_WPs)):
        verdicts[k] = KEPT
        px, py, pz = p_WPs[k, 0], p_WPs[k, 1], p_WPs[k, 2]
        x = X_SW[0, 0] * px + X_SW[0, 1] * py + X_SW[0, 2] * pz + X_SW[0, 3]
        y = X_SW[1, 0] * px + X_SW[1, 1] * py + X_SW[1, 2] * pz + X_SW[1, 3]
        z = X_SW[2, 0] * px + X_SW[2, 1] * py + X_SW[2, 2] * pz + X_SW[2, 3]
        square = x * x + y * y + z * z
        away = np.sqrt(square)
        if away < near or away > far:
            continue
        r, slack = min(radii[k], _MOST_BESIDE * grid.edge * away), radii[k] + margin
        nearest, shown, ends, is_free = np.inf, EDGE, 0.0, True
        for face in range(6):
            row, last_row, column, last_column = _window(grid, face, x, y, z, r)
            if last_column < column:
                continue
            for i in range(row, last_row + 1):
                first = grid.sizes[face, 2] + i * grid.sizes[face, 1]
                for j in range(grid.starts[first + column], grid.starts[first + last_column + 1]):
                    ray = grid.rays[j]
                    along = ray[0] * x + ray[1] * y + ray[2] * z
                    # The square of the cross product: exact also where the ray goes through it.
                    cx = ray[1] * z - ray[2] * y
                    cy = ray[2] * x - ray[0] * z
                    cz = ray[0] * y - ray[1] * x
                    off = cx * cx + cy * cy + cz * cz
                    if along <= 0.0 or off > r * r:
                        continue
                    is_free &= min(ray[3], far) > along + slack
                    if off < nearest:
                        nearest, shown, ends = off, mask[grid.rows[j]], ray[3] - along
        if shown == EDGE:
            continue
        if shown == OPEN and abs(ends) <= slack:
            verdicts[k] = SEEN_AGAIN
        elif is_free:
            verdicts[k] = CLEARED


@lean_kernel
def widen_rays(grid, angle, mask):
    """Mark the ends of rays within an angle, as its tangent, of a robot's as beside it."""
    for k in range(len(grid.rays)):
        row = grid.rows[k]
        if mask[row] != ROBOT:
            continue
        x, y, z = grid.rays[k, 0], grid.rays[k, 1], grid.rays[k, 2]
        for face in range(6):
            first_row, last_row, column, last_column = _window(grid, face, x, y, z, angle)
            if last_column < column:
                continue
            for i in range(first_row, last_row + 1):
                first = grid.sizes[face, 2] + i * grid.sizes[face, 1]
                for j in range(grid.starts[first + column], grid.starts[first + last_column + 1]):
                    if mask[grid.rows[j]] != OPEN:
                        continue
                    ray = grid.rays[j]
                    along = ray[0] * x + ray[1] * y + ray[2] * z
                    if along > 0.0 and 1.0 - along * along <= angle * angle * along * along:
                        mask[grid.rows[j]] = EDGE


@lean_kernel
def place_cloud(p_SPs, mask, near, far, X_WS, lower, upper, p_WPs):
    """Write open points of W that are in range and in a box; return how many there are."""
    count = 0
    for k in range(len(p_SPs)):
        x, y, z = p_SPs[k, 0], p_SPs[k, 1], p_SPs[k, 2]
        square = x * x + y * y + z * z
        is_in = mask[k] == OPEN and square >= near * near and square <= far * far
        for axis in range(3):
            at = X_WS[axis, 0] * x + X_WS[axis, 1] * y + X_WS[axis, 2] * z + X_WS[axis, 3]
            p_WPs[count, axis] = at
            is_in &= at >= lower[axis] and at <= upper[axis]
        count += int(is_in)
    return count
