"""The questions that the narrow phase asks a core of any kind, and which file answers them.

A support point of a core in direction d is a point of it that lies furthest along d. Each comes
with an index: which vertex it is, or ``CURVED`` where the core has infinitely many.
"""

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel
from scene_graph_ros.geometry.narrowphase.cores import (
    box,
    corners,
    cylinder,
    ellipsoid,
    hull,
    point,
    segment,
    triangle,
)
from scene_graph_ros.geometry.narrowphase.cores.growth_forms import NOTHING
from scene_graph_ros.geometry.narrowphase.cores.kinds import (
    BOX,
    CURVED,
    CYLINDER,
    ELLIPSOID,
    HULL,
    is_curved,
    ORIGIN,
    SEGMENT,
    TRIANGLE,
)
from scene_graph_ros.geometry.narrowphase.features import FACE, LINE, RIM, SMOOTH, VERTEX
from scene_graph_ros.geometry.spatial.vectors import (
    add,
    axpy,
    dot,
    rotate,
    rotate_inverse,
    subtract,
)
from scene_graph_ros.geometry.tolerances import CONTACT_MISFIT, EPSILON, TIE

__all__ = [
    "clamp",
    "corner_feature",
    "edge_count",
    "edge_of",
    "face_count",
    "face_of",
    "feature_at",
    "growth",
    "inner_radius",
    "lane_support",
    "neighbor",
    "placed_support",
    "support",
    "vertex_count",
    "vertex_of",
]


@inlined_kernel
def support(core, hulls, d, hint):
    """Return (point, index): a support point of ``core`` in direction d, without its radius.

    All vectors are in the core's frame; d need not be a unit vector. ``hint`` is an earlier index
    of the same core, or -1; it only makes large hulls faster.
    """
    kind, params = core[0], core[3]
    if kind == BOX:
        return box.support(params, d)
    if kind == HULL:
        return hull.support(hulls, core[1], d, hint)
    if kind == CYLINDER:
        return cylinder.support(params, d), CURVED
    if kind == ELLIPSOID:
        return ellipsoid.support(params, d), CURVED
    if kind == SEGMENT:
        return segment.support(params, d)
    if kind == TRIANGLE:
        return triangle.support(params, d)
    return point.support(params)


@inlined_kernel
def placed_support(core, hulls, R, p, d, hint):
    """Return (point, index) like ``support`` for a core at pose (R, p), d in the outer frame."""
    local, index = support(core, hulls, rotate_inverse(R, d), hint)
    return add(rotate(R, local), p), index


@inlined_kernel
def lane_support(core, hulls, d):
    """Return points of a core that lie furthest along d, three lanes, in the core's frame.

    Without their radius, as ``support`` of eight directions at once.
    """
    kind, params = core[0], core[3]
    if kind == BOX:
        return box.lane_support(params, d)
    if kind == HULL:
        return hull.lane_support(hulls, core[1], d)
    if kind == CYLINDER:
        return cylinder.lane_support(params, d)
    if kind == ELLIPSOID:
        return ellipsoid.lane_support(params, d)
    if kind == SEGMENT:
        return segment.lane_support(params, d)
    if kind == TRIANGLE:
        return triangle.lane_support(params, d)
    return point.lane_support(params)


@lean_kernel
def inner_radius(core, R, p, hulls, q, m):
    """Return the radius (m) of the largest ball in a core that touches its surface at q.

    m is the core's unit outward normal at q. 0 where the surface has an edge or a corner.
    """
    kind, params = core[0], core[3]
    m = rotate_inverse(R, m)
    if kind == ELLIPSOID:
        return ellipsoid.inner_radius(params, m)
    q = rotate_inverse(R, subtract(q, p))
    if kind == BOX:
        return box.inner_radius(params, q, m)
    if kind == CYLINDER:
        return cylinder.inner_radius(params, q, m)
    if kind == HULL:
        return hull.inner_radius(hulls, core[1], q, m)
    return 0.0


@inlined_kernel
def growth(core, hulls, R, p, q, m, size):
    """Return the growth of a core's extent around the outward normal m at its point q.

    ``size``: the pair's (m). The eight numbers are only for ``narrowphase.growth``, which says
    what they mean.
    """
    flat, near = TIE * EPSILON * size, CONTACT_MISFIT * size
    kind, params = core[0], core[3]
    t, u = (R[3], R[4], R[5]), (R[6], R[7], R[8])
    q = rotate_inverse(R, subtract(q, p))
    m = rotate_inverse(R, m)
    if kind == ELLIPSOID:
        return ellipsoid.growth(params, q, m, t, u, near)
    if kind == CYLINDER:
        return cylinder.growth(params[0], params[1], q, m, t, u, flat, near)
    if kind == SEGMENT:
        return segment.growth(params[0], q, m, t, u, flat)
    if kind == BOX:
        return box.growth(params, q, m, t, u, flat)
    if kind == HULL:
        return hull.growth(hulls, core[1], q, m, t, u, flat)
    return NOTHING


@inlined_kernel
def edge_count(core, hulls):
    """Return how many edges a polytope has, 0 for what is none or has too many."""
    if core[0] == SEGMENT:
        return segment.EDGES
    if core[0] == BOX:
        return box.EDGES
    if core[0] == HULL:
        return hull.edge_count(hulls, core[1])
    return 0


@inlined_kernel
def face_count(core, hulls):
    """Return how many faces a polytope has."""
    if core[0] == HULL:
        return hull.face_count(hulls, core[1])
    return box.FACES if core[0] == BOX else segment.FACES


@inlined_kernel
def vertex_count(core, hulls):
    """Return how many vertices a polytope has."""
    if core[0] == HULL:
        return hull.vertex_count(hulls, core[1])
    return box.VERTICES if core[0] == BOX else segment.VERTICES


@inlined_kernel
def face_of(core, R, p, hulls, f):
    """Return (outward normal, offset from the origin) of a polytope's face f."""
    if core[0] == HULL:
        return hull.face_of(hulls, core[1], R, p, f)
    if core[0] == BOX:
        return box.face_of(core[3], R, p, f)
    return segment.face_of(R, p, f)


@inlined_kernel
def edge_of(core, R, p, hulls, k):
    """Return (one face, the other face, a point of the edge they share) of edge k."""
    if core[0] == SEGMENT:
        return segment.edge_of(p, k)
    if core[0] == BOX:
        return box.edge_of(core[3], R, p, k)
    return hull.edge_of(hulls, core[1], R, p, k)


@inlined_kernel
def vertex_of(core, R, p, hulls, k):
    """Return the vertex k of a placed polytope or segment."""
    if core[0] == HULL:
        q = hull.vertex_of(hulls, core[1], k)
    elif core[0] == BOX:
        q = box.vertex_of(core[3], k)
    else:
        q = segment.vertex_of(core[3], k)
    return add(rotate(R, q), p)


@inlined_kernel
def feature_at(core, R, p, S, ids, lam, count, side, d):
    """Return the feature of a core that a simplex of the Minkowski difference points to.

    ``side`` is the first column of the core's points in S (3 for A, 6 for B), ``d`` the direction
    out of the core at the contact.
    """
    kind = core[0]
    if kind == ELLIPSOID:
        return SMOOTH, p, ORIGIN, 0.0, 0.0, 0.0
    if kind == CYLINDER:
        return cylinder.feature_at(core, R, p, S, lam, count, side)
    if kind == BOX:
        return box.feature_at(core, R, p, S, ids, count, side)
    return corners.feature_at(S, ids, count, side, d)


@inlined_kernel
def clamp(core, R, p, feature, S, ids, count, side, a):
    """Return the point a moved onto the feature's extent on the core."""
    kind = core[0]
    if feature[0] == VERTEX or kind == ELLIPSOID or feature[0] == RIM:
        return a
    if feature[0] == FACE and feature[4] > 0.0:  # its row is known: see all_features
        return a
    if kind == BOX:
        return box.clamp(core[3], R, p, a)
    if feature[0] == LINE:
        q = subtract(a, feature[1])
        s = dot(feature[2], q)
        return axpy(max(feature[4], min(feature[5], s)) - s, feature[2], a)
    if kind == CYLINDER:
        return cylinder.clamp_to_end(feature, a)
    if kind == TRIANGLE:
        o, u, v = triangle.triangle_corners(core, R, p)
        return corners.clamp_to_triangle(o, u, v, a)
    return corners.clamp_to_simplex(S, ids, count, side, a)


@lean_kernel
def neighbor(core, hulls, R, p, feature, a, d, allowed):
    """Return the neighboring feature that a rejected contact at a, outward d, points to."""
    if core[0] == CYLINDER:
        return cylinder.neighbor(core, R, p, feature, a, d, allowed)
    if core[0] == BOX:
        return box.neighbor(core, R, p, feature, a, d, allowed)
    if core[0] == ELLIPSOID:
        return feature
    furthest, _ = placed_support(core, hulls, R, p, d, -1)
    return corners.neighbor(feature, a, d, furthest, allowed)


@lean_kernel
def corner_feature(core, hulls, R, p, feature, d):
    """Return the corner of a polytope that lies furthest along d; ``feature`` if it has none."""
    if is_curved(core):
        return feature
    corner, _ = placed_support(core, hulls, R, p, d, -1)
    return VERTEX, corner, ORIGIN, 0.0, 0.0, 0.0
