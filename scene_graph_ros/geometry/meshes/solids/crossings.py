"""Where a surface crosses itself: one point of it."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, kernel, lean_kernel
from scene_graph_ros.geometry.compiled.lanes import lowest_bit
from scene_graph_ros.geometry.meshes.bvh import build_bvh, traversal_stack
from scene_graph_ros.geometry.meshes.kernel_arrays import for_kernels
from scene_graph_ros.geometry.meshes.solids.overlaps import boxes_meet
from scene_graph_ros.geometry.meshes.solids.press import gap_between, SHARED, TOUCHING
from scene_graph_ros.geometry.meshes.solids.triangle_blocks import (
    left_of_block,
    load_block,
    triangle_blocks,
)
from scene_graph_ros.geometry.meshes.solids.triangle_normals import unit_normals
from scene_graph_ros.geometry.meshes.triangle_boxes import triangle_boxes
from scene_graph_ros.geometry.spatial.vectors import axpy, cross, dot, load_vector, norm, subtract

__all__ = ["first_crossing"]

_DEEP = 1e-9
"""Relative to the size: an edge that passes through a triangle by less only touches it."""

_REACH = 0.9 * _DEEP
"""Relative to the size: triangles that reach across each other's planes by less do not cross."""

_WEDGE = 1e-6
"""Relative to the size: planes of single precision meet in wedges of 1e-7 radians, whose ends are
thinner than TOUCHING for half as much. Triangles that lie on each other for more are a fold."""

_ROUNDING = 1e-14
"""Relative to the largest coordinate: more than that of a point's height above a plane."""

_FLAT = 5e-15
"""Relative to the size: in the end of a wedge, what is thicker has two sides that are known."""


@lean_kernel
def _plane(vertices, triangles, t):
    """Return (origin, n, length) of a triangle's plane: a corner, and a normal with its length."""
    a = load_vector(vertices, triangles[t, 0])
    n = cross(
        subtract(load_vector(vertices, triangles[t, 1]), a),
        subtract(load_vector(vertices, triangles[t, 2]), a),
    )
    return a, n, norm(n)


@lean_kernel
def _heights(vertices, triangles, t, plane):
    """Return the heights of a triangle's corners above a plane, times the length of its normal."""
    origin, n, _ = plane
    return (
        dot(n, subtract(load_vector(vertices, triangles[t, 0]), origin)),
        dot(n, subtract(load_vector(vertices, triangles[t, 1]), origin)),
        dot(n, subtract(load_vector(vertices, triangles[t, 2]), origin)),
    )


@lean_kernel
def _is_within(vertices, triangles, t, plane, x, slack):
    """Return whether a point of the plane of a triangle is inside of it, by more than slack."""
    _, n, length = plane
    for k in range(3):
        first = load_vector(vertices, triangles[t, k])
        edge = subtract(load_vector(vertices, triangles[t, (k + 1) % 3]), first)
        if dot(cross(n, edge), subtract(x, first)) <= slack * length * norm(edge):
            return False
    return True


@lean_kernel
def _pierced(vertices, triangles, t, s, heights, plane, slack):
    """Return (pierced, x): whether an edge of triangle t goes through triangle s, and where.

    ``plane`` is that of s, and ``heights`` are those of the corners of t above it.
    """
    deep = slack * plane[2]
    for k in range(3):
        above, below = heights[k], heights[(k + 1) % 3]
        if above * below >= 0.0 or min(abs(above), abs(below)) <= deep:
            continue
        i, j = triangles[t, k], triangles[t, (k + 1) % 3]
        if (
            (triangles[s, 0] == i or triangles[s, 0] == j)
            or (triangles[s, 1] == i or triangles[s, 1] == j)
            or (triangles[s, 2] == i or triangles[s, 2] == j)
        ):
            continue
        p, q = load_vector(vertices, i), load_vector(vertices, j)
        x = axpy(above / (above - below), subtract(q, p), p)
        if _is_within(vertices, triangles, s, plane, x, slack):
            return True, x
    return False, plane[0]


@lean_kernel
def _cut_by_plane(vertices, triangles, t, heights):
    """Return the ends of the segment of a triangle in a plane that it reaches across."""
    p = q = load_vector(vertices, triangles[t, 0])
    for k in range(3):
        start, end = heights[k], heights[(k + 1) % 3]
        if (start > 0.0) == (end > 0.0):
            continue
        corner = load_vector(vertices, triangles[t, k])
        side = subtract(load_vector(vertices, triangles[t, (k + 1) % 3]), corner)
        q, p = p, axpy(start / (start - end), side, corner)
    return p, q


@lean_kernel
def _share_segment(vertices, triangles, t, s, heights_t, heights_s, planes, slack):
    """Return (shares, x): whether two triangles have a segment in common that is inside of both.

    Its ends may be on edges, or at a corner of both: then no edge goes through either. Each
    reaches across the plane of the other; ``planes`` are those of t and s.
    """
    plane_t, plane_s = planes
    p, q = _cut_by_plane(vertices, triangles, t, heights_t)
    u, v = _cut_by_plane(vertices, triangles, s, heights_s)
    along = subtract(q, p)
    extent = norm(along)
    if extent <= slack:
        return False, p
    one = dot(subtract(u, p), along) / extent
    other = dot(subtract(v, p), along) / extent
    start, end = max(0.0, min(one, other)), min(extent, max(one, other))
    if end - start <= slack:
        return False, p
    x = axpy(0.5 * (start + end) / extent, along, p)
    is_inside = _is_within(vertices, triangles, t, plane_t, x, slack)
    return is_inside and _is_within(vertices, triangles, s, plane_s, x, slack), x


@lean_kernel
def _pass_through(vertices, triangles, t, s, slack):
    """Return (crosses, x): whether one of two triangles passes through the other, and where."""
    plane_t, plane_s = _plane(vertices, triangles, t), _plane(vertices, triangles, s)
    heights_t = _heights(vertices, triangles, t, plane_s)
    heights_s = _heights(vertices, triangles, s, plane_t)
    deep_t, deep_s = slack * plane_s[2], slack * plane_t[2]
    t_reaches = max(heights_t) > deep_t and min(heights_t) < -deep_t
    s_reaches = max(heights_s) > deep_s and min(heights_s) < -deep_s
    crosses, x = False, plane_t[0]
    if t_reaches:
        crosses, x = _pierced(vertices, triangles, t, s, heights_t, plane_s, slack)
    if s_reaches and not crosses:
        crosses, x = _pierced(vertices, triangles, s, t, heights_s, plane_t, slack)
    if t_reaches and s_reaches and not crosses:
        planes = plane_t, plane_s
        crosses, x = _share_segment(vertices, triangles, t, s, heights_t, heights_s, planes, slack)
    return crosses, x


@lean_kernel
def _cross(vertices, triangles, normals, t, s, size, shared):
    """Return (crosses, x) of two triangles; those with an edge in common can only fold."""
    flat, thin, slack = TOUCHING * size, _FLAT * size, _DEEP * size
    folded = gap_between(vertices, triangles, normals, t, s, -flat, flat, _WEDGE * size) >= -flat
    if not folded:
        gap = gap_between(vertices, triangles, normals, t, s, -thin, thin, shared * size)
        folded = gap >= -thin
    if folded:
        return True, load_vector(vertices, triangles[s, 0])
    corners = 0
    for k in range(3):
        for m in range(3):
            corners += triangles[t, k] == triangles[s, m]
    if corners > 1:
        return False, (0.0, 0.0, 0.0)
    return _pass_through(vertices, triangles, t, s, slack)


@inlined_kernel
def _leaves_cross(vertices, triangles, normals, blocks, place, tree, i, j, scales):
    """Return (crosses, x) of the triangles of two leaves, or of one with itself."""
    _, _, left, right, order = tree
    size, shared, deep = scales
    block = load_block(blocks, place[j])
    for one in range(right[i]):
        bits = left_of_block(blocks, place[i], one, block, deep)
        if i == j:
            bits &= -2 << one
        while bits != 0:
            t, s = order[one - 1 - left[i]], order[lowest_bit(bits) - 1 - left[j]]
            crosses, x = _cross(vertices, triangles, normals, t, s, size, shared)
            if crosses:
                return True, x
            bits &= bits - 1
    return False, (0.0, 0.0, 0.0)


@kernel
def _first(vertices, triangles, normals, tree, scales):
    """Return (found, point) of the first two triangles, in the order of a walk, that cross.

    ``scales`` are the size, how wide a fold is relative to it, and by how much a triangle that
    crosses another one reaches across the other's plane, but for rounding.
    """
    node_lower, node_upper, left, right, _ = tree
    blocks, place = triangle_blocks(vertices, triangles, normals, tree)
    ones, others = traversal_stack(), traversal_stack()
    point = np.zeros(3)
    for node in range(len(left)):
        # What is below one child against what is below the other.
        ones[0], others[0] = (node, node) if left[node] < 0 else (left[node], right[node])
        depth = 1
        while depth > 0:
            depth -= 1
            i, j = ones[depth], others[depth]
            if not boxes_meet(i, j, node_lower, node_upper):
                continue
            if left[i] < 0 and left[j] < 0:
                crosses, x = _leaves_cross(
                    vertices, triangles, normals, blocks, place, tree, i, j, scales
                )
                if crosses:
                    point[0], point[1], point[2] = x
                    return True, point
            elif left[i] < 0 or (left[j] >= 0 and j < i):
                ones[depth], others[depth] = i, right[j]
                ones[depth + 1], others[depth + 1] = i, left[j]
                depth += 2
            else:
                ones[depth], others[depth] = right[i], j
                ones[depth + 1], others[depth + 1] = left[i], j
                depth += 2
    return False, point


def first_crossing(
    vertices: NDArray[np.float64],
    triangles: NDArray[np.int64],
    tree: tuple[Any, ...] | None = None,
    shared: float = SHARED,
) -> NDArray[np.float64] | None:
    """Return a point (3,) where a triangle passes through another one, or lies on it, or None.

    Triangles lie on each other where a surface is folded flat, so that it has nothing between its
    sides: near it neither the one nor the other normal tells the inside.

    Args:
        vertices: (v, 3).
        triangles: (m, 3).
        tree: the hierarchy of their boxes, where it is known.
        shared: relative to the size; triangles that overlap by less share an edge at most.

    """
    if not len(triangles):
        return None
    if tree is None:
        tree = build_bvh(*triangle_boxes(vertices, triangles))
    low, high = tree[0][0], tree[1][0]
    size = float((high - low).max())
    deep = _REACH * size - _ROUNDING * float(max(high.max(), -low.min()))
    at, rows = for_kernels(vertices), for_kernels(triangles)
    found, point = _first(at, rows, unit_normals(at, rows), tree, (size, shared, deep))
    return np.asarray(point) if found else None
