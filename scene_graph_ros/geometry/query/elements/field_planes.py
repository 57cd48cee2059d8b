"""Planes between a shape and prisms of a height field, which no prism behind them reaches.

A plane is a direction m of F, a unit vector, and the least ``h = m . x`` of the shape, both from
the shape's origin on: a prism whose corners are all at ``m . x <= c`` is no nearer than ``h - c``.
"""

import math

import numpy as np

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel
from scene_graph_ros.geometry.compiled.lanes import every, LANES, larger, select, smaller
from scene_graph_ros.geometry.narrowphase.cores.questions import lane_planes, plane_count, support
from scene_graph_ros.geometry.query.distance.dispatch import core_of
from scene_graph_ros.geometry.query.elements.element_search import plane_of
from scene_graph_ros.geometry.spatial.vectors import (
    cross,
    dot,
    rotate,
    rotate_inverse,
    scale,
    subtract,
    unit,
)
from scene_graph_ros.geometry.tables.height_grid import FLOOR, x_of, y_of
from scene_graph_ros.geometry.tables.vertex_scan import lane_of_largest

__all__ = ["FIXED", "NUM_DIRECTIONS", "plane_before", "write_extents", "write_planes"]

DIRECTIONS = np.array(
    [
        [0.0, 0.0, 1.0],
        [0.0, 0.0, -1.0],
        [1.0, 0.0, 0.0],
        [-1.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.0, -1.0, 0.0],
        [2 / 7, 3 / 7, 6 / 7],
        [-3 / 7, 2 / 7, 6 / 7],
        [-2 / 7, -3 / 7, 6 / 7],
        [3 / 7, -2 / 7, 6 / 7],
    ]
)
"""Along which a shape's extents are known: up, down, along x and y, and four that are tilted."""
NUM_DIRECTIONS = len(DIRECTIONS)
FIXED = 5
"""Planes that every search has: that across z, and across the tilted directions."""
MOST_FACES = 256
"""Of a shape with more of them, none is looked at."""


@inlined_kernel
def write_extents(table, j, R_FB, lows):
    """Write how far a shape begins along each of DIRECTIONS, from its origin.

    Returns its lowest point: from its origin, in F.
    """
    core = core_of(table, j)
    lowest = (0.0, 0.0, 0.0)
    for k in range(NUM_DIRECTIONS):
        x = DIRECTIONS[k, 0], DIRECTIONS[k, 1], DIRECTIONS[k, 2]
        p_B, _ = support(core, table.hulls.blocks, rotate_inverse(R_FB, (-x[0], -x[1], -x[2])))
        p = rotate(R_FB, p_B)
        lows[k] = dot(x, p) - core[2]
        if k == 0:
            lowest = p[0], p[1], lows[0]
    return lowest


@inlined_kernel
def write_planes(lows, planes):
    """Write the planes of the shape across the directions that point up."""
    planes[0, 0], planes[0, 1], planes[0, 2], planes[0, 3] = 0.0, 0.0, 1.0, lows[0]
    for k in range(1, FIXED):
        at = NUM_DIRECTIONS - FIXED + k
        for c in range(3):
            planes[k, c] = DIRECTIONS[at, c]
        planes[k, 3] = lows[at]


@inlined_kernel
def _top_corners(grid, prism, p):
    """Return the corners of a prism's upper triangle from p on, counter-clockwise from above."""
    cell, cols = prism // 2, grid.counts[0, 1]
    i, j = cell // cols, cell % cols
    x0, x1 = x_of(grid, j) - p[0], x_of(grid, j + 1) - p[0]
    y0, y1 = y_of(grid, i) - p[1], y_of(grid, i + 1) - p[1]
    at = i * (cols + 1) + j
    a = x0, y0, grid.heights[at] - p[2]
    c = x1, y1, grid.heights[at + cols + 2] - p[2]
    if prism % 2 == 0:
        return a, (x1, y0, grid.heights[at + 1] - p[2]), c
    return a, c, (x0, y1, grid.heights[at + cols + 1] - p[2])


@inlined_kernel
def _before_faces(core, hulls, R_FB, corners, floor):
    """Return (bound, normal, offset) of the face of a shape that a prism is farthest beyond.

    ``floor`` is how high the floor is from the shape's origin on; without faces, or with more than
    MOST_FACES, the bound is -inf.
    """
    count = plane_count(core, hulls)
    if count == 0 or count > MOST_FACES:
        return -math.inf, (0.0, 0.0, 1.0), 0.0
    best, where = every(-math.inf), every(0.0)
    up = R_FB[6], R_FB[7], R_FB[8]
    a, b, c = (
        rotate_inverse(R_FB, corners[0]),
        rotate_inverse(R_FB, corners[1]),
        rotate_inverse(R_FB, corners[2]),
    )
    for first in range(0, count, LANES):
        out, offset = lane_planes(core, hulls, first)
        rise = dot(out, up)
        # Each corner, or the one below it.
        beyond = (
            smaller(
                smaller(
                    dot(out, a) + smaller(rise * (floor - corners[0][2]), every(0.0)),
                    dot(out, b) + smaller(rise * (floor - corners[1][2]), every(0.0)),
                ),
                dot(out, c) + smaller(rise * (floor - corners[2][2]), every(0.0)),
            )
            - offset
        )
        where = select(beyond > best, every(np.float64(first)), where)
        best = larger(beyond, best)
    k = lane_of_largest(best)
    out, offset = lane_planes(core, hulls, int(where[k]))
    return best[k], (out[0][k], out[1][k], out[2][k]), offset[k]


@inlined_kernel
def plane_before(table, j, X_FB, grid, prism):
    """Return (how near a prism is at least to the shape of row j, a plane that tells so).

    The plane is that of a face of the shape, or is parallel to the prism's upper triangle.
    """
    core, (R_FB, p_FB) = core_of(table, j), X_FB
    corners, floor = _top_corners(grid, prism, p_FB), grid.numbers[FLOOR] - p_FB[2]
    bound, out, offset = _before_faces(core, table.hulls.blocks, R_FB, corners, floor)
    m = rotate(R_FB, out)
    plane = -m[0], -m[1], -m[2], -offset
    up = cross(subtract(corners[1], corners[0]), subtract(corners[2], corners[0]))
    up = unit(up, (0.0, 0.0, 1.0))
    _, own = plane_of(table, j, R_FB, scale(-1.0, up))
    above = own[3] - dot(up, corners[0])
    if above > bound:
        return above, own
    return bound, plane
