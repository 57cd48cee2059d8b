"""A growing convex polytope of triangles, the working state of EPA.

A face without area has the distance ``inf``: it is never chosen, and gives way to any new corner.
All planes that a corner brings are computed in lanes, and all that the nearest is chosen of.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, kernel, lean_kernel
from scene_graph_ros.geometry.compiled.lanes import (
    as_lanes,
    every,
    LANES,
    load_lanes,
    reordering,
    root,
    select,
    store_lanes,
)
from scene_graph_ros.geometry.spatial.vectors import cross, dot, scale, subtract
from scene_graph_ros.geometry.tables.vertex_scan import first_of_highest, NUMBERS
from scene_graph_ros.geometry.tolerances import FLAT_SIMPLEX

__all__ = [
    "Polytope",
    "add_corner",
    "close_face",
    "corners_of",
    "distance_of",
    "empty_polytope",
    "is_closed",
    "nearest_face",
    "new_polytope",
    "normal_of",
    "start_tetrahedron",
]

_ALIVE = 6
_CLOSED = 7
_MAX_HORIZON = 256
"""Edges of the hole that a new corner may tear; more means that rounding broke the surface."""

_PLANE = 4
"""Numbers of a plane: its outward unit normal and the origin's distance below it (m)."""
_GROUP = _PLANE * LANES
_LANE = LANES - 1
_SHIFT = LANES.bit_length() - 1

_FAN = LANES - 1
"""Faces that are made at once: between so many corners and one more."""
_ROWS = LANES + 2
"""Rows of faces for each corner: a group holds the faces of most, and is never used again."""
_BORDER = _MAX_HORIZON + LANES
"""Where the border of a hole begins in ``ring``, behind its corners."""

_one_ahead = reordering(*[(lane + 1) % LANES for lane in range(LANES)])


class Polytope(NamedTuple):
    """Arrays of a polytope; ``empty_polytope`` makes them.

    ``S`` (n, 9) and ``ids`` (n, 2) are its corners, as in ``pair.Workspace``. ``faces`` (m, 8) has
    the three corners of a face counter-clockwise seen from outside, then for its three edges
    (corner k to k+1) the neighbor's ``4 face + edge``, then if it is alive, and if closed. Rows
    that are no face of the polytope are at the distance ``inf``. ``planes`` (4 m,) has the planes
    in groups of LANES: the x, then the y, then the z of their normals, then the distances.
    ``stack`` and ``ring`` are room for a new corner: edges to look at, and the corners
    and edges around the hole that it tears. Integers are unsigned: compiled code does not ask then
    if an index counts from the end.
    """

    S: NDArray[np.float64]
    ids: NDArray[np.int64]
    faces: NDArray[np.uint32]
    planes: NDArray[np.float64]
    stack: NDArray[np.uint32]
    ring: NDArray[np.uint32]


def empty_polytope(corners):
    """Return room for so many corners."""
    rows = _ROWS * corners
    return Polytope(
        S=np.empty((corners, 9)),
        ids=np.empty((corners, 2), np.int64),
        faces=np.empty((rows, 8), np.uint32),
        planes=np.empty(_PLANE * rows),
        stack=np.empty(rows, np.uint32),
        ring=np.empty(_BORDER + _MAX_HORIZON, np.uint32),
    )


new_polytope = kernel(empty_polytope)
"""The same, for kernels."""


@inlined_kernel
def _plane_at(f):
    """Return the plane of a face."""
    return (f >> _SHIFT) * _GROUP + (f & _LANE)


@inlined_kernel
def normal_of(planes, f):
    """Return the outward unit normal of a face, zero without area."""
    at = _plane_at(f)
    return planes[at], planes[at + LANES], planes[at + 2 * LANES]


@inlined_kernel
def distance_of(planes, f):
    """Return the depth of the origin below a face (m); ``inf`` of one that is dead or flat."""
    return planes[_plane_at(f) + 3 * LANES]


@inlined_kernel
def _set_distance(planes, f, distance):
    planes[_plane_at(f) + 3 * LANES] = distance


@inlined_kernel
def close_face(polytope, f, distance):
    """Let a face stay as it is, and count as that far from the origin (m)."""
    polytope.faces[f, _CLOSED] = 1
    _set_distance(polytope.planes, f, distance)


@inlined_kernel
def is_closed(polytope, f):
    """Return whether a face stays as it is."""
    return polytope.faces[f, _CLOSED] == 1


@lean_kernel
def corners_of(faces, f):
    """Return the rows of a face's corners."""
    return faces[f, 0], faces[f, 1], faces[f, 2]


@lean_kernel
def _corner(S, i):
    return (S[i, 0], S[i, 1], S[i, 2])


@inlined_kernel
def _coordinates(S, ring, k, c):
    """Return a coordinate of LANES corners of the ring, from corner k on."""
    return as_lanes(
        (
            S[ring[k], c],
            S[ring[k + 1], c],
            S[ring[k + 2], c],
            S[ring[k + 3], c],
            S[ring[k + 4], c],
            S[ring[k + 5], c],
            S[ring[k + 6], c],
            S[ring[k + 7], c],
        )
    )


@inlined_kernel
def _next(a):
    return _one_ahead(a[0]), _one_ahead(a[1]), _one_ahead(a[2])


@inlined_kernel
def _set_planes(polytope, f, count, k, tip):
    """Write the planes of ``count`` faces from f on: (corner k of the ring, the next one, tip)."""
    S, planes, ring = polytope.S, polytope.planes, polytope.ring
    a = _coordinates(S, ring, k, 0), _coordinates(S, ring, k, 1), _coordinates(S, ring, k, 2)
    e = subtract(_next(a), a)
    g = subtract(tip, a)
    n = cross(e, g)
    nn = dot(n, n)
    has_area = nn > FLAT_SIMPLEX * FLAT_SIMPLEX * dot(e, e) * dot(g, g)
    n = scale(select(has_area, 1.0 / root(select(has_area, nn, 1.0)), 0.0), n)
    is_face = (as_lanes(NUMBERS) < every(float(count))) & has_area
    at = _plane_at(f)
    store_lanes(planes, at, n[0])
    store_lanes(planes, at + LANES, n[1])
    store_lanes(planes, at + 2 * LANES, n[2])
    store_lanes(planes, at + 3 * LANES, select(is_face, dot(n, a), math.inf))


@inlined_kernel
def _set_corners(faces, f, i, j, tip):
    faces[f, 0] = i
    faces[f, 1] = j
    faces[f, 2] = tip
    faces[f, _ALIVE] = 1
    faces[f, _CLOSED] = 0


@inlined_kernel
def _link(faces, f, e, g, h):
    """Make edge e of face f and edge h of face g neighbors."""
    faces[f, 3 + e] = 4 * g + h
    faces[g, 3 + h] = 4 * f + e


@inlined_kernel
def start_tetrahedron(polytope):
    """Make the polytope of corners 0 to 3, which must not be flat; return its number of faces."""
    S, faces, ring = polytope.S, polytope.faces, polytope.ring
    i, j = 1, 2
    o = _corner(S, 0)
    e, g, h = subtract(_corner(S, 1), o), subtract(_corner(S, 2), o), subtract(_corner(S, 3), o)
    if dot(cross(e, g), h) < 0.0:
        i, j = 2, 1
    for k in range(LANES):
        ring[k] = 0
    ring[1] = j
    _set_planes(polytope, 0, 1, 0, _corner(S, i))
    ring[1] = i
    ring[2] = j
    _set_planes(polytope, LANES, 3, 0, _corner(S, 3))
    f = LANES
    _set_corners(faces, 0, 0, j, i)
    _set_corners(faces, f, 0, i, 3)
    _set_corners(faces, f + 1, i, j, 3)
    _set_corners(faces, f + 2, j, 0, 3)
    _link(faces, 0, 2, f, 0)
    _link(faces, 0, 1, f + 1, 0)
    _link(faces, 0, 0, f + 2, 0)
    _link(faces, f, 1, f + 1, 2)
    _link(faces, f + 1, 1, f + 2, 2)
    _link(faces, f + 2, 1, f, 2)
    return f + 3


@inlined_kernel
def nearest_face(planes, face_count):
    """Return (face, distance): the living face of least distance, ``inf`` if all are flat."""
    lanes = as_lanes(NUMBERS)
    least, where, start = load_lanes(planes, 3 * LANES), lanes, 0.0
    for at in range(_GROUP, _PLANE * face_count, _GROUP):
        distances = load_lanes(planes, at + 3 * LANES)
        start += LANES
        is_less = distances < least
        least = select(is_less, distances, least)
        where = select(is_less, start + lanes, where)
    f = first_of_highest(0.0 - least, where)
    return f, distance_of(planes, f)


@inlined_kernel
def _is_visible(planes, f, w, rounding):
    at = _plane_at(f)
    distance = planes[at + 3 * LANES]
    height = planes[at] * w[0] + planes[at + LANES] * w[1] + planes[at + 2 * LANES] * w[2]
    return distance == math.inf or height - distance > rounding


@inlined_kernel
def _kill(faces, planes, f):
    faces[f, _ALIVE] = 0
    _set_distance(planes, f, math.inf)


@inlined_kernel
def _tear(polytope, seed, w, rounding):
    """Remove the faces that w sees, from ``seed`` on; return the length of the hole's border.

    The border comes in order (counter-clockwise) as ``4 face + edge`` of the faces that remain,
    from _BORDER on in ``ring``; its corners are there from 0 on. -1 where it has too many edges.
    """
    faces, planes, stack, ring = polytope.faces, polytope.planes, polytope.stack, polytope.ring
    _kill(faces, planes, seed)
    depth = 3
    stack[0] = faces[seed, 5]
    stack[1] = faces[seed, 4]
    stack[2] = faces[seed, 3]
    length = 0
    while depth > 0:
        depth -= 1
        code = int(stack[depth])
        f, e = code >> 2, code & 3
        if faces[f, _ALIVE] == 0:
            continue
        if _is_visible(planes, f, w, rounding):
            _kill(faces, planes, f)
            if depth + 2 > stack.shape[0]:
                return -1
            stack[depth] = faces[f, 5 if e == 0 else 2 + e]
            stack[depth + 1] = faces[f, 3 if e == 2 else 4 + e]
            depth += 2
        else:
            if length == _MAX_HORIZON:
                return -1
            ring[_BORDER + length] = code
            ring[length] = faces[f, 0 if e == 2 else e + 1]
            length += 1
    return length


@inlined_kernel
def add_corner(polytope, face_count, seed, corner, rounding):
    """Extend the polytope by a corner beyond face ``seed``; return the new number of face rows.

    Return -1 where the rows run out or rounding has broken the surface; the polytope is then lost.
    """
    S, faces, ring = polytope.S, polytope.faces, polytope.ring
    w = _corner(S, corner)
    length = _tear(polytope, seed, w, rounding)
    fan = ((face_count + _LANE) >> _SHIFT) << _SHIFT
    start = fan
    if length < 3 or start + (length + _FAN - 1) // _FAN * LANES > faces.shape[0]:
        return -1
    for k in range(LANES):
        ring[length + k] = ring[0]
    f = start
    before = f
    for first in range(0, length, _FAN):
        count = min(_FAN, length - first)
        f = start
        _set_planes(polytope, f, count, first, w)
        for k in range(first, first + count):
            code = int(ring[_BORDER + k])
            g, e = code >> 2, code & 3
            _set_corners(faces, f, ring[k], ring[k + 1], corner)
            if faces[g, e] != ring[k + 1]:
                return -1
            _link(faces, f, 0, g, e)
            if k > 0:
                _link(faces, before, 1, f, 2)
            before = f
            f += 1
        start += LANES
    _link(faces, before, 1, fan, 2)
    return f
