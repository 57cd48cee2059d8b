"""Convex shapes as cores with a radius, and the support points of cores.

A core is the tuple ``(core_kind, hull, radius, params)``: an integer of this module, where its
hull's block starts in the array ``hulls`` (see ``meshes.hull_blocks``; or -1), the radius by which
the core is inflated (m) and nine floats (m, in the core's own frame):

========== ==================================================================
POINT      the point's coordinates (zeros for a sphere)
SEGMENT    half length along z
BOX        half extents
CYLINDER   radius, half length along z
ELLIPSOID  semi-axes
HULL       nothing: the vertices are those of the block that starts at ``hull``
TRIANGLE   its three vertices
========== ==================================================================

A support point of a core in direction d is a point of it that lies furthest along d. Each comes
with an index: which vertex it is, or ``CURVED`` where the core has infinitely many.
"""

import math

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel
from scene_graph_ros.geometry.spatial.vectors import add, rotate, rotate_inverse
from scene_graph_ros.geometry.tables.hull_blocks import furthest_vertex, vertex

__all__ = [
    "BOX",
    "CURVED",
    "CYLINDER",
    "ELLIPSOID",
    "HULL",
    "IDENTITY",
    "ORIGIN",
    "POINT",
    "SEGMENT",
    "TRIANGLE",
    "is_curved",
    "placed_support",
    "support",
    "triangle_corners",
]

POINT = 0
SEGMENT = 1
BOX = 2
CYLINDER = 3
ELLIPSOID = 4
HULL = 5
TRIANGLE = 6

CURVED = -1

IDENTITY = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)
ORIGIN = (0.0, 0.0, 0.0)


@lean_kernel
def is_curved(core):
    """Return whether the core has infinitely many support points."""
    return core[0] == CYLINDER or core[0] == ELLIPSOID


@lean_kernel
def _support_cylinder(params, d):
    z = math.copysign(params[1], d[2])
    radial = math.sqrt(d[0] * d[0] + d[1] * d[1])
    if radial > 0.0:
        return (params[0] * d[0] / radial, params[0] * d[1] / radial, z)
    return (0.0, 0.0, z)


@lean_kernel
def _support_ellipsoid(params, d):
    x, y, z = params[0] * d[0], params[1] * d[1], params[2] * d[2]
    length = math.sqrt(x * x + y * y + z * z)
    if length > 0.0:
        return (params[0] * x / length, params[1] * y / length, params[2] * z / length)
    return (params[0], 0.0, 0.0)


@lean_kernel
def _support_triangle(params, d):
    h0 = params[0] * d[0] + params[1] * d[1] + params[2] * d[2]
    h1 = params[3] * d[0] + params[4] * d[1] + params[5] * d[2]
    h2 = params[6] * d[0] + params[7] * d[1] + params[8] * d[2]
    if h0 >= h1 and h0 >= h2:
        return (params[0], params[1], params[2]), 0
    if h1 >= h2:
        return (params[3], params[4], params[5]), 1
    return (params[6], params[7], params[8]), 2


@inlined_kernel
def support(core, hulls, d, hint):
    """Return (point, index): a support point of ``core`` in direction d, without its radius.

    All vectors are in the core's frame; d need not be a unit vector. ``hint`` is an earlier index
    of the same core, or -1; it only makes large hulls faster.
    """
    kind = core[0]
    params = core[3]
    if kind == BOX:
        x = math.copysign(params[0], d[0])
        y = math.copysign(params[1], d[1])
        z = math.copysign(params[2], d[2])
        return (x, y, z), int(x > 0.0) + 2 * int(y > 0.0) + 4 * int(z > 0.0)
    if kind == HULL:
        k = furthest_vertex(hulls, core[1], d, hint)
        return vertex(hulls, k), k
    if kind == CYLINDER:
        return _support_cylinder(params, d), CURVED
    if kind == ELLIPSOID:
        return _support_ellipsoid(params, d), CURVED
    if kind == SEGMENT:
        z = math.copysign(params[0], d[2])
        return (0.0, 0.0, z), int(z > 0.0)
    if kind == TRIANGLE:
        return _support_triangle(params, d)
    return (params[0], params[1], params[2]), 0


@inlined_kernel
def placed_support(core, hulls, R, p, d, hint):
    """Return (point, index) like ``support`` for a core at pose (R, p), d in the outer frame."""
    local, index = support(core, hulls, rotate_inverse(R, d), hint)
    return add(rotate(R, local), p), index


@lean_kernel
def triangle_corners(core, R, p):
    """Return the corners of a TRIANGLE at pose (R, p)."""
    c = core[3]
    return (
        add(rotate(R, (c[0], c[1], c[2])), p),
        add(rotate(R, (c[3], c[4], c[5])), p),
        add(rotate(R, (c[6], c[7], c[8])), p),
    )
