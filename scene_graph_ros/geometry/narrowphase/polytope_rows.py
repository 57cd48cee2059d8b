"""The features of a small polytope by number, and rows of a workspace for its faces.

P is the polytope, Q another core in whose frame everything is. A segment has one edge and no
face: four directions around it divide the circle of its normals instead.
"""

import math

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel
from scene_graph_ros.geometry.narrowphase.cores import BOX, HULL, SEGMENT, support
from scene_graph_ros.geometry.spatial.vectors import (
    add,
    any_orthogonal,
    axpy,
    column,
    cross,
    dot,
    rotate,
    scale,
    subtract,
)
from scene_graph_ros.geometry.tables.hull_blocks import (
    edge_range,
    EDGE_STRIDE,
    face_range,
    FACE_STRIDE,
    SCAN_LIMIT,
    vertex,
    vertex_place,
)

__all__ = [
    "BELOW",
    "BELOW_CENTRE",
    "DEPTH",
    "FIRST_FACE",
    "LAST",
    "MAX_FACES",
    "edge_count",
    "edge_of",
    "face_count",
    "face_of",
    "fill",
    "vertex_count",
    "vertex_of",
]

FIRST_FACE = 36
"""The row of the workspace where faces begin; before it is a stack of directions on an arc."""

LAST = FIRST_FACE - 1
"""The row before the faces."""

MAX_FACES = 2 * SCAN_LIMIT - 4
"""A hull that is scanned has no more (Euler)."""

DEPTH = 6
BELOW = 7
BELOW_CENTRE = 8
"""Columns of a row: the direction, Q's support point against it, D (infinite: not visited), and
how far Q's witness and Q's centre are below the face."""


@inlined_kernel
def edge_count(core, hulls):
    """Return how many edges a polytope has, 0 for what is none or has too many."""
    if core[0] == SEGMENT:
        return 4
    if core[0] == BOX:
        return 12
    if core[0] == HULL and hulls[core[1]] <= SCAN_LIMIT:
        first, last = edge_range(hulls, core[1])
        return (last - first) // EDGE_STRIDE
    return 0


@inlined_kernel
def face_count(core, hulls):
    """Return how many faces a polytope has."""
    if core[0] == HULL:
        return int(hulls[core[1] + 1])
    return 6 if core[0] == BOX else 4


@inlined_kernel
def face_of(core, R, p, hulls, f):
    """Return (outward normal, offset from the origin) of a polytope's face f."""
    if core[0] == HULL:
        k = face_range(hulls, core[1])[0] + FACE_STRIDE * f
        d = rotate(R, (hulls[k], hulls[k + 1], hulls[k + 2]))
        return d, hulls[k + 3] + dot(p, d)
    if core[0] == BOX:
        d = column(R, f // 2)
        if f & 1:
            d = scale(-1.0, d)
        return d, core[3][f // 2] + dot(p, d)
    axis = column(R, 2)
    d = any_orthogonal(axis)
    if f & 1:
        d = cross(axis, d)
    if f & 2:
        d = scale(-1.0, d)
    return d, dot(p, d)


@inlined_kernel
def edge_of(core, R, p, hulls, k):
    """Return (row of one face, row of the other, a point of the edge they share) of edge k."""
    if core[0] == SEGMENT:
        return FIRST_FACE + k, FIRST_FACE + (k + 1) % 4, p
    if core[0] == BOX:
        i, j = (k // 4 + 1) % 3, (k // 4 + 2) % 3
        h = core[3]
        v = axpy(-h[i] if k & 1 else h[i], column(R, i), p)
        v = axpy(-h[j] if k & 2 else h[j], column(R, j), v)
        return FIRST_FACE + 2 * i + (k & 1), FIRST_FACE + 2 * j + (k & 2) // 2, v
    e = edge_range(hulls, core[1])[0] + EDGE_STRIDE * k
    v = int(hulls[e])
    v = add(rotate(R, vertex(hulls, v)), p)
    return FIRST_FACE + int(hulls[e + 1]), FIRST_FACE + int(hulls[e + 2]), v


@inlined_kernel
def vertex_count(core, hulls):
    """Return how many vertices a polytope has."""
    if core[0] == HULL:
        return int(hulls[core[1]])
    return 8 if core[0] == BOX else 2


@inlined_kernel
def vertex_of(core, R, p, hulls, k):
    """Return the vertex k of a placed polytope or segment."""
    h = core[3]
    if core[0] == HULL:
        q = vertex(hulls, vertex_place(core[1], k))
    elif core[0] == BOX:
        q = (
            h[0] if k & 1 else -h[0],
            h[1] if k & 2 else -h[1],
            h[2] if k & 4 else -h[2],
        )
    else:
        q = (0.0, 0.0, h[0] if k & 1 else -h[0])
    return add(rotate(R, q), p)


@inlined_kernel
def fill(core_Q, hulls, v, S, row):
    """Find the support point of Q for the row of a face that v is a point of, unless known."""
    if S[row, DEPTH] == math.inf:
        d = (S[row, 0], S[row, 1], S[row, 2])
        q, _ = support(core_Q, hulls, scale(-1.0, d), -1)
        for c in range(3):
            S[row, 3 + c] = q[c]
        S[row, DEPTH] = dot(subtract(v, q), d)
