"""A growing convex polytope of triangles, the working state of EPA.

A face without area has the distance ``inf``: it is never chosen, and gives way to any new corner.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.compiled.kernel import lean_kernel
from scene_graph_ros.geometry.spatial.vectors import cross, dot, scale
from scene_graph_ros.geometry.tolerances import FLAT_SIMPLEX

__all__ = [
    "ALIVE",
    "CLOSED",
    "MAX_HORIZON",
    "Polytope",
    "add_corner",
    "corners_of",
    "nearest_face",
    "start_tetrahedron",
]

ALIVE = 6
CLOSED = 7
MAX_HORIZON = 256
"""Edges of the hole that a new corner may tear; more means that rounding broke the surface."""


class Polytope(NamedTuple):
    """Arrays of a polytope.

    ``S`` (n, 9) and ``ids`` (n, 2) are its corners, as in ``pair.Workspace``. ``faces`` (m, 8) has
    the three corners of a face counter-clockwise seen from outside, then for its three edges
    (corner k to k+1) the neighbor's ``4 face + edge``, then ``ALIVE`` and ``CLOSED`` flags, and
    ``planes`` (m, 4) its outward unit normal and the origin's distance below it (m). ``stack`` and
    ``horizon`` are room for a search.
    """

    S: NDArray[np.float64]
    ids: NDArray[np.int64]
    faces: NDArray[np.int64]
    planes: NDArray[np.float64]
    stack: NDArray[np.int64]
    horizon: NDArray[np.int64]


@lean_kernel
def _corner(S, i):
    return (S[i, 0], S[i, 1], S[i, 2])


@lean_kernel
def _edge(S, i, j):
    return (S[j, 0] - S[i, 0], S[j, 1] - S[i, 1], S[j, 2] - S[i, 2])


@lean_kernel
def corners_of(faces, f):
    """Return the rows of a face's corners."""
    return faces[f, 0], faces[f, 1], faces[f, 2]


@lean_kernel
def _set_face(S, faces, planes, f, i, j, k):
    """Write the corners and the plane of face f."""
    faces[f, 0] = i
    faces[f, 1] = j
    faces[f, 2] = k
    faces[f, ALIVE] = 1
    faces[f, CLOSED] = 0
    e = _edge(S, i, j)
    g = _edge(S, i, k)
    n = cross(e, g)
    nn = dot(n, n)
    planes[f, 0] = 0.0
    planes[f, 1] = 0.0
    planes[f, 2] = 0.0
    planes[f, 3] = math.inf
    if nn > FLAT_SIMPLEX * FLAT_SIMPLEX * dot(e, e) * dot(g, g):
        n = scale(1.0 / math.sqrt(nn), n)
        planes[f, 0] = n[0]
        planes[f, 1] = n[1]
        planes[f, 2] = n[2]
        planes[f, 3] = dot(n, _corner(S, i))


@lean_kernel
def _link(faces, f, e, g, h):
    """Make edge e of face f and edge h of face g neighbors."""
    faces[f, 3 + e] = 4 * g + h
    faces[g, 3 + h] = 4 * f + e


@lean_kernel
def start_tetrahedron(polytope):
    """Make the polytope of corners 0 to 3, which must not be flat; return its number of faces."""
    S, faces, planes = polytope.S, polytope.faces, polytope.planes
    i, j = 1, 2
    if dot(cross(_edge(S, 0, 1), _edge(S, 0, 2)), _edge(S, 0, 3)) < 0.0:
        i, j = 2, 1
    _set_face(S, faces, planes, 0, 0, j, i)
    _set_face(S, faces, planes, 1, 0, i, 3)
    _set_face(S, faces, planes, 2, i, j, 3)
    _set_face(S, faces, planes, 3, j, 0, 3)
    _link(faces, 0, 2, 1, 0)
    _link(faces, 0, 1, 2, 0)
    _link(faces, 0, 0, 3, 0)
    _link(faces, 1, 1, 2, 2)
    _link(faces, 2, 1, 3, 2)
    _link(faces, 3, 1, 1, 2)
    return 4


@lean_kernel
def nearest_face(planes, face_count):
    """Return the living face of least distance, or -1 where none has an area."""
    best = -1
    distance = math.inf
    for f in range(face_count):
        if planes[f, 3] < distance:  # that of a dead one is infinite
            best = f
            distance = planes[f, 3]
    return best


@lean_kernel
def _is_visible(planes, f, w, rounding):
    height = planes[f, 0] * w[0] + planes[f, 1] * w[1] + planes[f, 2] * w[2] - planes[f, 3]
    return planes[f, 3] == math.inf or height > rounding


@lean_kernel
def _tear(polytope, seed, w, rounding):
    """Remove the faces that w sees, from ``seed`` on; return the length of the hole's border.

    The border comes in order (counter-clockwise) as ``4 face + edge`` of the faces that remain.
    -1 where it is longer than ``MAX_HORIZON``.
    """
    _, _, faces, planes, stack, horizon = polytope
    faces[seed, ALIVE] = 0
    planes[seed, 3] = math.inf
    depth = 3
    stack[0] = faces[seed, 5]
    stack[1] = faces[seed, 4]
    stack[2] = faces[seed, 3]
    length = 0
    while depth > 0:
        depth -= 1
        code = stack[depth]
        f, e = code >> 2, code & 3
        if faces[f, ALIVE] == 0:
            continue
        if _is_visible(planes, f, w, rounding):
            faces[f, ALIVE] = 0
            planes[f, 3] = math.inf
            if depth + 2 > stack.shape[0]:
                return -1
            stack[depth] = faces[f, 5 if e == 0 else 2 + e]
            stack[depth + 1] = faces[f, 3 if e == 2 else 4 + e]
            depth += 2
        else:
            if length == MAX_HORIZON:
                return -1
            horizon[length] = code
            length += 1
    return length


@lean_kernel
def add_corner(polytope, face_count, seed, corner, rounding):
    """Extend the polytope by a corner beyond face ``seed``; return the new number of face rows.

    Return -1 where the rows run out or rounding has broken the surface; the polytope is then lost.
    """
    S, _, faces, planes, _, horizon = polytope
    w = _corner(S, corner)
    length = _tear(polytope, seed, w, rounding)
    if length < 3:
        return -1
    free = 0
    first = -1
    before = -1
    for k in range(length):
        while free < face_count and faces[free, ALIVE] == 1:
            free += 1
        if free == faces.shape[0]:
            return -1
        face_count = max(face_count, free + 1)
        g, e = horizon[k] >> 2, horizon[k] & 3
        after = 0 if e == 2 else e + 1
        _set_face(S, faces, planes, free, faces[g, after], faces[g, e], corner)
        _link(faces, free, 0, g, e)
        if before < 0:
            first = free
        else:
            if faces[free, 0] != faces[before, 1]:
                return -1
            _link(faces, before, 1, free, 2)
        before = free
    if faces[first, 0] != faces[before, 1]:
        return -1
    _link(faces, before, 1, first, 2)
    return face_count
