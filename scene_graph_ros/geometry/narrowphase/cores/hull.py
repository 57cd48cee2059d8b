"""A hull: a polytope whose vertices, edges and faces are in a block of numbers."""

import math

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel
from scene_graph_ros.geometry.compiled.lanes import every, load_lanes, select
from scene_graph_ros.geometry.narrowphase.cores import corners
from scene_graph_ros.geometry.narrowphase.cores.corners import clamp_to, feature_at, vertex_at
from scene_graph_ros.geometry.narrowphase.cores.growth_forms import along, NOTHING
from scene_graph_ros.geometry.narrowphase.cores.kinds import (
    CORNERS_NOWHERE,
    CORNERS_UNKNOWN,
    ORIGIN,
)
from scene_graph_ros.geometry.narrowphase.cores.without import (
    has_plane_across,
    is_curved,
    side,
)
from scene_graph_ros.geometry.narrowphase.features import FACE, LINE, NO_FEATURE
from scene_graph_ros.geometry.spatial.vectors import (
    add,
    cross,
    dot,
    norm,
    rotate,
    rotate_inverse,
    scale,
    subtract,
    unit,
)
from scene_graph_ros.geometry.tables.hull_blocks import (
    corners_of_face,
    edge_range,
    EDGE_STRIDE,
    face_place,
    furthest_face,
    furthest_vertex,
    list_of_neighbors,
    normal_of_face,
    offset_of_face,
    SCAN_LIMIT,
    vertex,
    vertex_place,
)
from scene_graph_ros.geometry.tables.vertex_scan import GROUP
from scene_graph_ros.geometry.tolerances import PARALLEL, SAME_DIRECTION

__all__ = [
    "candidate",
    "clamp_to",
    "corner_ways",
    "edge_count",
    "edge_feature",
    "edge_of",
    "face_count",
    "face_feature",
    "feature_at",
    "growth",
    "has_plane_across",
    "inner_radius",
    "is_curved",
    "is_listed",
    "is_simple",
    "lane_planes",
    "lane_support",
    "lane_vertices",
    "local_vertex",
    "neighbor",
    "plane_count",
    "plane_of",
    "side",
    "support",
    "touched",
    "vertex_count",
]


@inlined_kernel
def support(core, hulls, d):
    """Return (point, index) of a vertex."""
    k = furthest_vertex(hulls, core[1], d)
    return vertex(hulls, k), k


@inlined_kernel
def lane_support(core, hulls, d):
    """Return corners of it."""
    hull = core[1]
    height = every(-math.inf)
    x = y = z = every(0.0)
    for k in range(int(hulls[hull])):
        v = vertex(hulls, vertex_place(hull, k))
        extent = v[0] * d[0] + v[1] * d[1] + v[2] * d[2]
        is_higher = extent > height
        height = select(is_higher, extent, height)
        x, y, z = (
            select(is_higher, v[0], x),
            select(is_higher, v[1], y),
            select(is_higher, v[2], z),
        )
    return x, y, z


@lean_kernel
def inner_radius(core, hulls, q, m):
    """Return the radius (m) of the largest ball inside that touches a face at q."""
    radius, spare = math.inf, 0.0
    is_on_face = False
    for k in range(int(hulls[core[1] + 1])):
        f = face_place(hulls, core[1], k)
        n = normal_of_face(hulls, f)
        cosine = dot(n, m)
        if cosine > SAME_DIRECTION and norm(cross(n, m)) <= PARALLEL:
            is_on_face = True
            continue
        spare = offset_of_face(hulls, f) - dot(n, q)
        if spare < radius * (1.0 - cosine):
            radius = spare / (1.0 - cosine)
    return radius if is_on_face else 0.0


@lean_kernel
def _on_plane(hulls, hull, q, m, flat):
    """Return (count, sum, last, one before) of the vertices of a hull in its plane across m."""
    count, total, last, other = 0, ORIGIN, ORIGIN, ORIGIN
    for k in range(int(hulls[hull])):
        v = subtract(vertex(hulls, vertex_place(hull, k)), q)
        if dot(v, m) >= -flat:
            count += 1
            total = add(total, v)
            last, other = v, last
    return count, total, last, other


@lean_kernel
def _room_on_face(hulls, hull, q, m, middle, corners, flat):
    """Return the distance of q inside of a face's border; 0 if not all its edges are found."""
    room, count = math.inf, 0
    first, last = edge_range(hulls, hull)
    for k in range(first, last, EDGE_STRIDE):
        a = subtract(vertex(hulls, int(hulls[k])), q)
        b = subtract(vertex(hulls, int(hulls[k + 3])), q)
        if dot(a, m) >= -flat and dot(b, m) >= -flat:
            count += 1
            across = unit(cross(m, subtract(b, a)), ORIGIN)
            out = math.copysign(1.0, dot(across, subtract(a, middle)))
            room = min(room, out * dot(across, a))
    return max(room, 0.0) if count == corners else 0.0


@lean_kernel
def growth(core, hulls, q, m, t, u, flat, near):
    """Return the growth of the edge or the face of a hull that is orthogonal to m."""
    hull = core[1]
    count, total, a, b = _on_plane(hulls, hull, q, m, flat)
    if count > 2:
        middle = scale(1.0 / count, total)
        room = _room_on_face(hulls, hull, q, m, middle, count, flat)
        return 0.0, 0.0, 0.0, 0.0, 0.0, room, 0.0, room
    if count == 2:
        e = unit(subtract(b, a), ORIGIN)
        if norm(cross(e, a)) <= flat:
            kt, ku, uu = along(min(norm(a), norm(b)), dot(e, t), dot(e, u))
            return 0.0, 0.0, 0.0, 0.0, 0.0, kt, ku, uu
    return NOTHING


@inlined_kernel
def edge_count(core, hulls):
    """Return the number of its edges, 0 where they are too many to be looked at one by one."""
    hull = core[1]
    if hulls[hull] > SCAN_LIMIT:
        return 0
    first, last = edge_range(hulls, hull)
    return (last - first) // EDGE_STRIDE


@inlined_kernel
def face_count(core, hulls):
    """Return the number of its faces."""
    return int(hulls[core[1] + 1])


@inlined_kernel
def vertex_count(core, hulls):
    """Return the number of its vertices."""
    return int(hulls[core[1]])


@inlined_kernel
def edge_of(placed, hulls, k):
    """Return (one face, the other face, a point) of an edge."""
    core, R, p = placed
    e = edge_range(hulls, core[1])[0] + EDGE_STRIDE * k
    v = add(rotate(R, vertex(hulls, int(hulls[e]))), p)
    return int(hulls[e + 1]), int(hulls[e + 2]), v


@inlined_kernel
def _coordinates(hulls, at):
    """Return three lanes of a group of vertices or normals."""
    return (
        load_lanes(hulls, at),
        load_lanes(hulls, at + GROUP),
        load_lanes(hulls, at + 2 * GROUP),
    )


@inlined_kernel
def lane_vertices(core, hulls, first):
    """Return eight vertices, in the order of their numbers."""
    return _coordinates(hulls, vertex_place(core[1], first))


@inlined_kernel
def local_vertex(core, hulls, k):
    """Return a vertex."""
    return vertex(hulls, vertex_place(core[1], k))


@inlined_kernel
def is_simple(core, hulls):
    """Return whether its vertices are few."""
    return hulls[core[1]] <= SCAN_LIMIT


@inlined_kernel
def is_listed(core):
    """Return True."""
    return True


@inlined_kernel
def plane_count(core, hulls):
    """Return the number of its faces."""
    return int(hulls[core[1] + 1])


@inlined_kernel
def plane_of(core, hulls, k):
    """Return (outward unit normal, offset from the origin) of a face."""
    place = face_place(hulls, core[1], k)
    return normal_of_face(hulls, place), offset_of_face(hulls, place)


@inlined_kernel
def lane_planes(core, hulls, first):
    """Return eight faces, in the order of their numbers."""
    at = face_place(hulls, core[1], first)
    return _coordinates(hulls, at), load_lanes(hulls, at + 3 * GROUP)


@inlined_kernel
def corner_ways(core, hulls):
    """Return that there are none, unless it is flat, or has too many edges to be looked at."""
    return CORNERS_NOWHERE if edge_count(core, hulls) > 0 else CORNERS_UNKNOWN


@lean_kernel
def _face(hulls, R, p, at):
    """Return the face at a place of the block; ``low`` is that place, plus one."""
    c = vertex(hulls, int(hulls[corners_of_face(hulls, at) + 1]))
    return FACE, add(rotate(R, c), p), rotate(R, normal_of_face(hulls, at)), 0.0, at + 1.0, 0.0


@lean_kernel
def face_feature(placed, hulls, k, d):
    """Return the face k."""
    core, R, p = placed
    return _face(hulls, R, p, face_place(hulls, core[1], k))


@lean_kernel
def edge_feature(placed, hulls, k):
    """Return the edge k."""
    core, R, p = placed
    at = edge_range(hulls, core[1])[0] + EDGE_STRIDE * k
    a = add(rotate(R, vertex(hulls, int(hulls[at]))), p)
    b = add(rotate(R, vertex(hulls, int(hulls[at + 3]))), p)
    return corners.line(a, b)


@lean_kernel
def touched(placed, hulls, d, tie):
    """Return a corner."""
    core, R, p = placed
    corner, _ = support(core, hulls, rotate_inverse(R, d))
    return vertex_at(add(rotate(R, corner), p))


@lean_kernel
def neighbor(placed, hulls, now, a, d, allowed):
    """Go to an end of an edge, or along one to another corner."""
    return corners.neighbor(now, a, d, touched(placed, hulls, d, 0.0)[1], allowed)


@lean_kernel
def _edge_at(hulls, R, p, corner, index):
    """Return an edge at the vertex at ``corner``, or a feature of kind NONE."""
    neighbors = list_of_neighbors(hulls, corner)
    if index >= int(hulls[neighbors]):
        return NO_FEATURE
    a = vertex(hulls, corner)
    h = scale(0.5, subtract(vertex(hulls, int(hulls[neighbors + 1 + index])), a))
    half = norm(h)
    return LINE, add(rotate(R, add(a, h)), p), rotate(R, unit(h, ORIGIN)), 0.0, -half, half


@lean_kernel
def _face_along(hulls, hull, R, p, d):
    """Return the face that faces along d most."""
    best = furthest_face(hulls, hull, rotate_inverse(R, d))
    return _face(hulls, R, p, best) if best >= 0 else NO_FEATURE


@lean_kernel
def candidate(placed, hulls, simplex, side, d, index):
    """Return the feature of the simplex, a corner, a face, or one of the corner's edges."""
    core, R, p = placed
    if index == 0:
        return feature_at(placed, simplex, side, d)
    local, corner_at = support(core, hulls, rotate_inverse(R, d))
    if index == 1:
        return vertex_at(add(rotate(R, local), p))
    if index == 2:
        return _face_along(hulls, core[1], R, p, d)
    return _edge_at(hulls, R, p, corner_at, index - 3)
