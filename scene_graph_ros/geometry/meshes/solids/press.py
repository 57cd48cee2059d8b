"""Press faces that face each other across a slit together, so that their union has no slit.

Faces of two parts that touch are apart, or overlap, by the rounding of their coordinates: to
float64 in a turned mesh, to float32 in most files. Each of two such faces is moved outwards by
half of the gap, and by PRESSED, which is less than the promised accuracy: then the parts overlap.

A face of a cavity that lies on one of the part that it is a cavity of is a mouth: there it is
moved out of that part, so that no skin is left over the mouth.

A body in a cavity that is flush with its wall then reaches into the wall. Where another cavity of
the same part takes both away, it has to take that, too: for what cavities have in common they are
as much larger there.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.compiled.kernel import kernel, lean_kernel
from scene_graph_ros.geometry.meshes.bvh import build_bvh, traversal_stack
from scene_graph_ros.geometry.meshes.kernel_arrays import for_kernels
from scene_graph_ros.geometry.meshes.solids.overlaps import boxes_meet
from scene_graph_ros.geometry.meshes.solids.triangle_normals import unit_normals
from scene_graph_ros.geometry.meshes.solids.winding import Tree
from scene_graph_ros.geometry.meshes.triangle_boxes import triangle_boxes
from scene_graph_ros.geometry.spatial.sums import least_squares
from scene_graph_ros.geometry.spatial.vectors import cross, dot, load_vector, norm, subtract

__all__ = [
    "PRESSED",
    "SHARED",
    "TOUCHING",
    "Pressed",
    "gap_between",
    "moved",
    "pressed_together",
]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

PRESSED = 1e-12
"""Relative to the size: how far touching faces are moved."""

TOUCHING = 5e-14
"""Relative to the size: the least gap, what rounding makes of faces that touch."""

SHARED = 1e-9
"""Relative to the size: triangles that overlap by less in their plane share an edge at most."""

_FACING = -0.99
"""The largest dot product of the normals of faces that face each other."""

_ONE_PLANE = 1e-3
"""Relative to the largest singular value of a corner's normals: planes nearer than it are one."""

_BEHIND = 5.0
"""Of the step by which touching faces are pressed: bodies reach into walls by at most 4."""


class Pressed(NamedTuple):
    """Vertices after faces were pressed together."""

    vertices: FloatArray
    """(v, 3)."""
    slits: int
    """Pairs of triangles that were apart by more than PRESSED."""
    point: FloatArray
    """(3,): a corner at the widest one, if any."""
    widest: float
    """Metres, of the same."""
    ways: list[tuple[FloatArray, FloatArray]]
    """Vertices (v, 3), the first time the same, and those of cavities as they count for what they
    have in common. What is behind a wall decides which of the ways leaves neither slit nor skin:
    whether cavities have in them what is pressed into their walls, and whether bodies reach the
    walls beside mouths."""
    tree: Tree | None
    """Of boxes around the triangles of these vertices, unless some moved out of theirs."""


@lean_kernel
def _corner(vertices, triangles, t, k):
    return load_vector(vertices, triangles[t, k])


@lean_kernel
def _heights(vertices, triangles, normals, t, s):
    """Return the least and the largest height of the corners of s above the plane of t."""
    n, origin = load_vector(normals, t), _corner(vertices, triangles, t, 0)
    a = dot(n, subtract(_corner(vertices, triangles, s, 0), origin))
    b = dot(n, subtract(_corner(vertices, triangles, s, 1), origin))
    c = dot(n, subtract(_corner(vertices, triangles, s, 2), origin))
    return min(a, b, c), max(a, b, c)


@lean_kernel
def _is_beside(vertices, triangles, normals, t, s, shared):
    """Tell whether s is beyond a side of t, or overlaps it there by no more than shared."""
    n = load_vector(normals, t)
    for k in range(3):
        start = _corner(vertices, triangles, t, k)
        out = cross(subtract(_corner(vertices, triangles, t, (k + 1) % 3), start), n)
        nearest = np.inf
        for m in range(3):
            arm = subtract(_corner(vertices, triangles, s, m), start)
            nearest = min(nearest, dot(arm, out))
        if nearest >= -shared * norm(out):
            return True
    return False


@lean_kernel
def gap_between(vertices, triangles, normals, t, s, least, most, shared):
    """Return the distance of two triangles that face each other within a gap, else -inf.

    Heights are linear where the triangles overlap, so the corners of either bound the gap there.
    """
    if dot(load_vector(normals, t), load_vector(normals, s)) > _FACING:
        return -np.inf
    low, high = _heights(vertices, triangles, normals, t, s)
    other_low, other_high = _heights(vertices, triangles, normals, s, t)
    gap = min(high, other_high)
    if not least <= gap <= most or max(low, other_low) < -most:
        return -np.inf
    if _is_beside(vertices, triangles, normals, t, s, shared):
        return -np.inf
    if _is_beside(vertices, triangles, normals, s, t, shared):
        return -np.inf
    return gap


@kernel
def _uniform_parts(part, tree):
    """Return (n,): the part of all triangles below each node of a tree, or -1 of several."""
    _, _, left, right, order = tree
    result = np.empty(len(left), np.int64)
    for node in range(len(left) - 1, -1, -1):  # children follow their parent
        if left[node] >= 0:
            one, other = result[left[node]], result[right[node]]
            result[node] = one if one == other else -1
            continue
        first = -1 - left[node]
        result[node] = part[order[first]]
        for slot in range(first, first + right[node]):
            if part[order[slot]] != result[node]:
                result[node] = -1
    return result


@lean_kernel
def _note_gap(gaps, mouths, of, part, t, s, gap):
    """Note the gap between two triangles, or at mouths; return whether it is between solids.

    ``of`` (n,) is the part that each part is a cavity of, or -1. Two cavities of one part open
    into each other.
    """
    one, other = part[t], part[s]
    are_both = of[one] >= 0 and of[one] == of[other]
    is_one, is_other = are_both or of[one] == other, are_both or of[other] == one
    if is_one:
        mouths[t] = min(mouths[t], gap)
    if is_other:
        mouths[s] = min(mouths[s], gap)
    if is_one or is_other:
        return False
    gaps[t], gaps[s] = max(gaps[t], gap), max(gaps[s], gap)
    return True


@kernel
def _gaps(vertices, triangles, part, of, normals, lower, upper, tree, least, most, shared):
    """Return (gaps, mouths, pairs): of triangles (m,) the largest gap, and how many have a slit.

    ``mouths`` (m,) are the least gaps of a cavity's triangles, else inf. Boxes (m, 3) and their
    tree are as much larger than triangles as the largest gap.
    """
    node_lower, node_upper, left, right, order = tree
    uniform = _uniform_parts(part, tree)
    ones, others = traversal_stack(), traversal_stack()
    gaps = np.full(len(triangles), -np.inf)
    mouths = np.full(len(triangles), np.inf)
    pairs = 0
    for node in range(len(left)):
        # What is below one child against what is below the other.
        ones[0], others[0] = (node, node) if left[node] < 0 else (left[node], right[node])
        depth = 1
        while depth > 0:
            depth -= 1
            i, j = ones[depth], others[depth]
            if uniform[i] >= 0 and uniform[i] == uniform[j]:
                continue
            if not boxes_meet(i, j, node_lower, node_upper):
                continue
            if left[i] >= 0 and (left[j] < 0 or i <= j):
                ones[depth], others[depth] = right[i], j
                ones[depth + 1], others[depth + 1] = left[i], j
                depth += 2
                continue
            if left[j] >= 0:
                ones[depth], others[depth] = i, right[j]
                ones[depth + 1], others[depth + 1] = i, left[j]
                depth += 2
                continue
            for one in range(-1 - left[i], -1 - left[i] + right[i]):
                for other in range(-1 - left[j], -1 - left[j] + right[j]):
                    t, s = order[one], order[other]
                    if (i == j and other <= one) or part[s] == part[t]:
                        continue
                    if not boxes_meet(t, s, lower, upper):
                        continue
                    gap = gap_between(vertices, triangles, normals, t, s, least, most, shared)
                    if gap >= least:
                        pairs += _note_gap(gaps, mouths, of, part, t, s, gap) and gap > -least
    return gaps, mouths, pairs


def pressed_together(
    vertices: FloatArray,
    triangles: IntArray,
    part: IntArray,
    cavity_of: IntArray,
    tolerance: float,
) -> Pressed:
    """Move (v, 3) vertices where triangles (m, 3) of different parts (m,) face each other.

    ``cavity_of`` (n,) is the part that each part is a cavity of, or -1, and ``tolerance`` is the
    largest gap that is closed, metres. Each part has vertices of its own, and its triangles run
    counter-clockwise seen from outside of the solid.
    """
    lower, upper = triangle_boxes(vertices, triangles)
    size = float(max(upper.max(), -lower.min()))
    most = max(tolerance, TOUCHING * size)
    lower, upper = lower - most, upper + most
    tree: Tree = build_bvh(lower, upper)
    normals = unit_normals(vertices, triangles)
    by = PRESSED * size
    # What overlaps by as much as pressing leaves needs none.
    least = -2.0 * by
    given = (vertices, triangles, part, cavity_of, normals, lower, upper)
    arrays = map(for_kernels, given)
    gap_limits = least, most, max(SHARED * size, tolerance)
    gaps, mouths, slits = _gaps(*arrays, tree, *gap_limits)
    steps = np.where(gaps >= least, 0.5 * np.maximum(gaps, 0.0) + by, 0.0)
    # A mouth reaches further out than its part's faces are moved.
    out = np.zeros(len(cavity_of))
    np.maximum.at(out, part, steps)
    reach = out[cavity_of[part]] + 2.0 * by
    is_mouth = mouths <= reach
    steps_of_mouths = np.minimum(mouths, reach) - reach
    ways = [np.where(is_mouth, steps_of_mouths, steps)]
    rows = np.flatnonzero(ways[0])
    if not len(rows):
        return Pressed(vertices, 0, vertices[:0], 0.0, [(vertices, vertices)], tree)
    is_wall_too = is_mouth & (gaps >= least)
    if is_wall_too.any():
        further = _further(given, gaps, is_wall_too, reach + by, gap_limits)
        if (further > steps).any():
            ways.append(np.where(is_mouth, steps_of_mouths, np.maximum(further, steps)))
    found = []
    for way in ways:
        rows = np.flatnonzero(way)
        at = moved(vertices, triangles[rows], normals[rows], way[rows])
        grown = _grown(at, triangles, normals, cavity_of[part] >= 0, way, by)
        found += [(at, grown)] if grown is at else [(at, grown), (at, at)]
    is_around = all(np.abs(at - vertices).max() < 0.5 * most for at, _ in found)
    return Pressed(
        found[0][0],
        int(slits),
        vertices[triangles[gaps.argmax(), 0]],
        float(gaps.max()),
        found,
        tree if is_around else None,
    )


def _further(
    given: tuple[Any, ...],
    gaps: FloatArray,
    is_both: NDArray[np.bool_],
    needed: FloatArray,
    limits: tuple[float, float, float],
) -> FloatArray:
    """Return (m,) how far to move faces of bodies that lie on faces with a mouth beside them.

    ``is_both`` (m,) are triangles that are a mouth in part only. By what these move out, and more,
    ``needed`` (m,) metres, bodies in the cavity have to follow, so that they reach the wall.
    ``given`` and ``limits`` are as for ``_gaps``.
    """
    vertices, triangles, part, cavity_of, normals, lower, upper = given
    further = np.zeros(len(triangles))
    is_body = (cavity_of[part] < 0) & (gaps >= limits[0])
    for cavity in np.unique(part[is_both]).tolist():
        mouth = is_both & (part == cavity)
        rows = np.flatnonzero(mouth | (is_body & (part != cavity_of[cavity])))
        tree: Tree = build_bvh(lower[rows], upper[rows])
        own, none = mouth[rows].astype(np.int64), np.full(2, -1)
        chosen = triangles[rows], own, none, normals[rows], lower[rows], upper[rows]
        found = _gaps(*map(for_kernels, (vertices, *chosen)), tree, *limits)[0]
        facing = rows[(found >= limits[0]) & (own == 0)]
        further[facing] = np.maximum(gaps[facing], 0.0) + needed[mouth].max()
    return further


def _grown(
    vertices: FloatArray,
    triangles: IntArray,
    normals: FloatArray,
    is_hollow: NDArray[np.bool_],
    steps: FloatArray,
    by: float,
) -> FloatArray:
    """Return pressed vertices (v, 3), those of cavities' walls behind what is pressed into them.

    ``is_hollow`` (m,) are triangles of cavities, and ``steps`` (m,) how far each was moved. Mouths
    were moved outwards, and stay. Bodies that overlapped by up to 2 ``by`` do by 4 of them now.
    """
    rows = np.flatnonzero(is_hollow & (steps != 0.0))
    if not (steps[rows] > 0.0).any():
        return vertices
    back = np.where(steps[rows] > 0.0, -_BEHIND * by, 0.0)
    return moved(vertices, triangles[rows], normals[rows], back)


def moved(
    vertices: FloatArray, triangles: IntArray, normals: FloatArray, steps: FloatArray
) -> FloatArray:
    """Return vertices (v, 3) such that triangles (k, 3) are moved along their normals (k, 3).

    Each is moved by its step (k,), or more where it has a corner in common with others; by a
    negative step inwards.
    """
    at = triangles.reshape(-1)
    along, step = np.repeat(normals, 3, axis=0), np.repeat(steps, 3)
    order = np.argsort(at, kind="stable")
    used, starts = np.unique(at[order], return_index=True)
    result = vertices.copy()
    for vertex, planes in zip(used, np.split(order, starts[1:]), strict=True):
        # Of a corner's planes those of one face count as one.
        way = least_squares(along[planes], np.sign(step[planes]), _ONE_PLANE)
        result[vertex] += way * np.abs(step[planes]).max()
    return result
