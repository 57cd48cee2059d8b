"""The questions that the narrow phase asks a core of any kind.

The file of its kind answers; `registry.asked` writes the body that finds it. A support point of a
core in direction d is a point of it that lies furthest along d. Each comes with an index: which
vertex it is, or ``CURVED`` where the core has infinitely many. Features are those of
`narrowphase.features`, simplices those of `narrowphase.pair`.

Questions to a ``core`` are in its own frame, to a ``placed`` one in that of its pose.
"""

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel
from scene_graph_ros.geometry.narrowphase.cores.kinds import ORIGIN
from scene_graph_ros.geometry.narrowphase.cores.registry import asked
from scene_graph_ros.geometry.narrowphase.features import FACE, RIM, SMOOTH, VERTEX
from scene_graph_ros.geometry.spatial.vectors import add, rotate, rotate_inverse, subtract
from scene_graph_ros.geometry.tolerances import CONTACT_MISFIT, EPSILON, TIE

__all__ = [
    "candidate",
    "clamp",
    "corner_feature",
    "corner_ways",
    "edge_count",
    "edge_feature",
    "edge_of",
    "face_count",
    "face_feature",
    "feature_at",
    "has_oblique_planes",
    "has_plane_across",
    "is_curved",
    "is_listed",
    "is_simple",
    "lane_planes",
    "lane_support",
    "lane_vertices",
    "neighbor",
    "placed_growth",
    "placed_inner_radius",
    "placed_support",
    "plane_count",
    "plane_of",
    "side",
    "support",
    "touched",
    "vertex_count",
    "vertex_of",
]


@asked(inlined_kernel)
def support(core, hulls, d):
    """Return (point, index): a support point of ``core`` in direction d, without its radius.

    All vectors are in the core's frame; d need not be a unit vector.
    """


@asked(inlined_kernel)
def lane_support(core, hulls, d):
    """Return points of a core that lie furthest along d, three lanes, in the core's frame.

    Without their radius, as ``support`` of eight directions at once.
    """


@asked(inlined_kernel)
def is_curved(core):
    """Return whether the core has infinitely many support points."""


@asked(inlined_kernel)
def is_simple(core, hulls):
    """Return whether a core's features are few enough to be guessed, and its support is fast."""


@asked(inlined_kernel)
def is_listed(core):
    """Return whether its corners, edges and planes are a list, however long."""


@asked(lean_kernel)
def inner_radius(core, hulls, q, m):
    """Return the radius (m) of the largest ball in a core that touches its surface at q.

    m is its unit outward normal at q, both in its frame. 0 at an edge or a corner, or where none
    is known.
    """


@asked(inlined_kernel)
def growth(core, hulls, q, m, t, u, flat, near):
    """Return the growth of a core's extent around the outward normal m at its point q.

    All in its frame; heights within ``flat`` (m) are taken for flat, and a point within ``near``
    (m) for one of the surface. ``narrowphase.prove.growth`` has the meaning of the eight numbers.
    """


@asked(inlined_kernel)
def edge_count(core, hulls):
    """Return the number of a polytope's edges, 0 for other cores or too many."""


@asked(inlined_kernel)
def face_count(core, hulls):
    """Return the number of a polytope's faces, to be numbered; see ``lane_planes``."""


@asked(inlined_kernel)
def vertex_count(core, hulls):
    """Return the number of a polytope's vertices."""


@asked(inlined_kernel)
def edge_of(placed, hulls, k):
    """Return (one face, the other face, a point of the edge they share) of edge k."""


@asked(inlined_kernel)
def local_vertex(core, hulls, k):
    """Return the vertex k of a polytope in its frame."""


@asked(inlined_kernel)
def lane_vertices(core, hulls, first):
    """Return three lanes of eight vertices, from the one numbered ``first``, a multiple of 8, on.

    As ``local_vertex``; indices beyond the last one repeat it.
    """


@asked(inlined_kernel)
def has_plane_across(core, k):
    """Return whether the axis k of its frame is, both ways, normal to a plane of its surface."""


@asked(inlined_kernel)
def plane_count(core, hulls):
    """Return the number of planes of its surface."""


@asked(inlined_kernel)
def plane_of(core, hulls, k):
    """Return (outward unit normal, offset from the origin) of a plane of it, in its frame."""


@asked(inlined_kernel)
def lane_planes(core, hulls, first):
    """Return (normals, offsets) of eight planes, from the one numbered ``first`` on.

    In lanes, as ``plane_of``, or of a core with faces these. ``first`` is a multiple of 8. Where
    there is none any more, the offset is inf.
    """


@asked(inlined_kernel)
def corner_ways(core, hulls):
    """Return in which directions a corner may leave it: one of ``kinds.CORNERS_...``."""


@asked(inlined_kernel)
def side(placed):
    """Return the side around its third axis as a LINE with a radius, or a feature of kind NONE."""


@asked(inlined_kernel)
def feature_at(placed, simplex, side, d):
    """Return the feature of a core that a simplex of the Minkowski difference points to.

    ``side`` is ``A_SIDE`` or ``B_SIDE``, ``d`` the direction out of the core at the contact.
    """


@asked(lean_kernel)
def neighbor(placed, hulls, now, a, d, allowed):
    """Return the feature next to ``now`` that a rejected contact at a, outward d, points to."""


@asked(lean_kernel)
def touched(placed, hulls, d, tie):
    """Return the feature that a plane or an edge touches, outward d: a corner, a rim, a side."""


@asked(lean_kernel)
def face_feature(placed, hulls, k, d):
    """Return the face or the plane k as a feature; of two ends, the one that faces along d."""


@asked(lean_kernel)
def edge_feature(placed, hulls, k):
    """Return the edge k of a polytope as a feature."""


@asked(lean_kernel)
def candidate(placed, hulls, simplex, side, d, index):
    """Return a feature of a core that may face along d, or one of kind NONE.

    See ``feature_at`` for the simplex. The index runs up to ``all_features.CANDIDATES``.
    """


@asked(inlined_kernel)
def clamp_to(placed, feature, simplex, side, a):
    """Return the point a of a line or a plane moved onto the core's part of it."""


@inlined_kernel
def has_oblique_planes(core, hulls):
    """Return whether its surface has planes that are not across its frame's axes."""
    return plane_count(core, hulls) > 0 and not has_plane_across(core, 2)


@inlined_kernel
def clamp(placed, feature, simplex, side, a):
    """Return the point a moved onto the feature's extent on the core."""
    if feature[0] == VERTEX or feature[0] == RIM or feature[0] == SMOOTH:
        return a
    if feature[0] == FACE and feature[4] > 0.0:  # its row is known: see all_features
        return a
    return clamp_to(placed, feature, simplex, side, a)


@inlined_kernel
def placed_support(placed, hulls, d):
    """Return (point, index) like ``support`` of a placed core, all in the outer frame."""
    core, R, p = placed
    local, index = support(core, hulls, rotate_inverse(R, d))
    return add(rotate(R, local), p), index


@inlined_kernel
def placed_inner_radius(placed, hulls, q, m):
    """Return ``inner_radius`` of a placed core, q and m in the outer frame."""
    core, R, p = placed
    return inner_radius(core, hulls, rotate_inverse(R, subtract(q, p)), rotate_inverse(R, m))


@inlined_kernel
def placed_growth(placed, hulls, q, m, size):
    """Return ``growth`` of a placed core along the rows of R; ``size``: the pair's (m)."""
    core, R, p = placed
    t, u = (R[3], R[4], R[5]), (R[6], R[7], R[8])
    q, m = rotate_inverse(R, subtract(q, p)), rotate_inverse(R, m)
    return growth(core, hulls, q, m, t, u, TIE * EPSILON * size, CONTACT_MISFIT * size)


@inlined_kernel
def vertex_of(placed, hulls, k):
    """Return the vertex k of a placed polytope or segment."""
    return add(rotate(placed.R, local_vertex(placed.core, hulls, k)), placed.p)


@lean_kernel
def corner_feature(placed, hulls, feature, d):
    """Return the corner of a polytope that lies furthest along d; ``feature`` if it has none."""
    if is_curved(placed.core):
        return feature
    corner, _ = placed_support(placed, hulls, d)
    return VERTEX, corner, ORIGIN, 0.0, 0.0, 0.0
