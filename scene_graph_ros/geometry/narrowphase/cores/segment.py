"""A segment along z, around its middle."""

import math

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel
from scene_graph_ros.geometry.compiled.lanes import every, with_sign
from scene_graph_ros.geometry.narrowphase.cores.growth_forms import along, NOTHING
from scene_graph_ros.geometry.spatial.vectors import any_orthogonal, column, cross, dot, scale

__all__ = [
    "EDGES",
    "FACES",
    "VERTICES",
    "edge_of",
    "face_of",
    "growth",
    "lane_support",
    "support",
    "vertex_of",
]

EDGES = 4
FACES = 4
VERTICES = 2
"""A segment has one edge and no face: directions around it divide the circle of its normals."""


@inlined_kernel
def support(params, d):
    """Return (point, index) of an end."""
    z = math.copysign(params[0], d[2])
    return (0.0, 0.0, z), int(z > 0.0)


@inlined_kernel
def lane_support(params, d):
    """Return ends of it."""
    return every(0.0), every(0.0), with_sign(params[0], d[2])


@lean_kernel
def growth(half, q, m, t, u, flat):
    """Return the growth of the line of that half length along the third axis."""
    if abs(m[2]) * half > flat:
        return NOTHING
    kt, ku, uu = along(max(half - abs(q[2]), 0.0), t[2], u[2])
    return 0.0, 0.0, 0.0, 0.0, 0.0, kt, ku, uu


@inlined_kernel
def face_of(R, p, f):
    """Return (unit normal, offset from the origin): four directions around it stand for faces."""
    axis = column(R, 2)
    d = any_orthogonal(axis)
    if f & 1:
        d = cross(axis, d)
    if f & 2:
        d = scale(-1.0, d)
    return d, dot(p, d)


@inlined_kernel
def edge_of(p, k):
    """Return (one face, the next face around, a point of both)."""
    return k, (k + 1) % EDGES, p


@inlined_kernel
def vertex_of(params, k):
    """Return an end."""
    return (0.0, 0.0, params[0] if k & 1 else -params[0])
