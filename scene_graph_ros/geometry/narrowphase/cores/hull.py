"""A hull: a polytope whose vertices, edges and faces are in a block of numbers."""

import math

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel
from scene_graph_ros.geometry.compiled.lanes import every, select
from scene_graph_ros.geometry.narrowphase.cores.growth_forms import along, NOTHING
from scene_graph_ros.geometry.narrowphase.cores.kinds import ORIGIN
from scene_graph_ros.geometry.spatial.vectors import (
    add,
    cross,
    dot,
    norm,
    rotate,
    scale,
    subtract,
    unit,
)
from scene_graph_ros.geometry.tables.hull_blocks import (
    edge_range,
    EDGE_STRIDE,
    face_range,
    FACE_STRIDE,
    furthest_vertex,
    SCAN_LIMIT,
    vertex,
    vertex_place,
)
from scene_graph_ros.geometry.tolerances import PARALLEL, SAME_DIRECTION

__all__ = [
    "edge_count",
    "edge_of",
    "face_count",
    "face_of",
    "growth",
    "inner_radius",
    "lane_support",
    "support",
    "vertex_count",
    "vertex_of",
]


@inlined_kernel
def support(hulls, hull, d, hint):
    """Return (point, index) of a vertex."""
    k = furthest_vertex(hulls, hull, d, hint)
    return vertex(hulls, k), k


@inlined_kernel
def lane_support(hulls, hull, d):
    """Return the corners of a hull that lie furthest along directions d."""
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
def inner_radius(hulls, hull, q, m):
    """Return the radius (m) of the largest ball inside that touches a face at q."""
    radius, spare = math.inf, 0.0
    is_on_face = False
    first, last = face_range(hulls, hull)
    for f in range(first, last, FACE_STRIDE):
        n = (hulls[f], hulls[f + 1], hulls[f + 2])
        cosine = dot(n, m)
        if cosine > SAME_DIRECTION and norm(cross(n, m)) <= PARALLEL:
            is_on_face = True
            continue
        spare = hulls[f + 3] - dot(n, q)
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
    """Return how far q is inside of the border of a face; 0 if not all its edges are found."""
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
def growth(hulls, hull, q, m, t, u, flat):
    """Return the growth of the edge or the face of a hull that is orthogonal to m."""
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
def edge_count(hulls, hull):
    """Return how many edges it has, 0 where they are too many to be looked at one by one."""
    if hulls[hull] > SCAN_LIMIT:
        return 0
    first, last = edge_range(hulls, hull)
    return (last - first) // EDGE_STRIDE


@inlined_kernel
def face_count(hulls, hull):
    """Return how many faces it has."""
    return int(hulls[hull + 1])


@inlined_kernel
def vertex_count(hulls, hull):
    """Return how many vertices it has."""
    return int(hulls[hull])


@inlined_kernel
def face_of(hulls, hull, R, p, f):
    """Return (outward unit normal, offset from the origin) of a face."""
    k = face_range(hulls, hull)[0] + FACE_STRIDE * f
    d = rotate(R, (hulls[k], hulls[k + 1], hulls[k + 2]))
    return d, hulls[k + 3] + dot(p, d)


@inlined_kernel
def edge_of(hulls, hull, R, p, k):
    """Return (one face, the other face, a point) of an edge."""
    e = edge_range(hulls, hull)[0] + EDGE_STRIDE * k
    v = add(rotate(R, vertex(hulls, int(hulls[e]))), p)
    return int(hulls[e + 1]), int(hulls[e + 2]), v


@inlined_kernel
def vertex_of(hulls, hull, k):
    """Return a vertex."""
    return vertex(hulls, vertex_place(hull, k))
