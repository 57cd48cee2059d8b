"""Which normals the triangles at a point of a mesh allow, and the way from there to a point near.

Close to a mesh, the difference of a point and the nearest one of an edge or a corner has a
direction that rounding turns: that of the place and of the decision which feature is nearest,
divided by the distance. A nearest point says more: no triangle that it is on reaches beyond the
plane through it, at a right angle to the way. Those planes' directions are the normal cone, and
the direction is turned into it; the point that it belongs to differs from the one asked by no
more than rounding.
"""

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel
from scene_graph_ros.geometry.meshes.bvh import traversal_stack
from scene_graph_ros.geometry.query.point.flat_features import (
    nearest_on_segment,
    nearest_on_triangle,
    way_from_segment,
)
from scene_graph_ros.geometry.spatial.vectors import (
    axpy,
    dot,
    load_vector,
    scale,
    subtract,
    unit,
)
from scene_graph_ros.geometry.tolerances import (
    COINCIDENCE,
    EPSILON,
    GJK_ROUNDING,
    PARALLEL,
)

__all__ = [
    "bounds_solid",
    "box_square",
    "corner_at",
    "corners_at",
    "ends_of",
    "turned_into_cone",
    "way_from_feature",
]

TURNS = 16
"""Nearly all directions are right after one or two; what is left needs two edges found in turn."""

ON_IT = 4.0
"""In units of ``COINCIDENCE`` times the mesh's size: a point this near a triangle is on it."""


@lean_kernel
def box_square(p, lower, upper, node):
    """Return the squared distance from p to a node's box."""
    total = 0.0
    for axis in range(3):
        gap = max(lower[node, axis] - p[axis], p[axis] - upper[node, axis], 0.0)
        total += gap * gap
    return total


@inlined_kernel
def bounds_solid(surfaces, k, triangle):
    """Return whether a triangle of surface k is on the boundary of its solid, not on a sheet."""
    return surfaces.part[triangle] < surfaces.solid_parts[k]


@inlined_kernel
def corner_at(surfaces, triangle, k):
    """Return corner k of a triangle."""
    return load_vector(surfaces.vertices, surfaces.triangles[triangle, k])


@inlined_kernel
def corners_at(surfaces, triangle):
    """Return the three corners of a triangle."""
    a, b = corner_at(surfaces, triangle, 0), corner_at(surfaces, triangle, 1)
    return a, b, corner_at(surfaces, triangle, 2)


@inlined_kernel
def ends_of(surfaces, triangle, feature):
    """Return the numbers of the vertices that edge 1, 2 or 3 of a triangle begins and ends at."""
    first = surfaces.triangles[triangle, feature - 1]
    return first, surfaces.triangles[triangle, feature % 3]


@inlined_kernel
def way_from_feature(surfaces, triangle, feature, p):
    """Return the way to p from the nearest point of an edge or a corner of a triangle.

    From an edge it is at a right angle to it as far as its own digits go.
    """
    if feature > 3:
        return subtract(p, corner_at(surfaces, triangle, feature - 4))
    first, last = ends_of(surfaces, triangle, feature)
    a, b = load_vector(surfaces.vertices, first), load_vector(surfaces.vertices, last)
    _, t = nearest_on_segment(p, a, b)
    way, edge = way_from_segment(p, a, b, t), subtract(b, a)
    return axpy(-dot(way, edge) / dot(edge, edge), edge, way)


@lean_kernel
def _less(n, held, q, size):
    """Return (is less, n, way): n without its share along the way to a corner q that is beyond.

    It stays at a right angle to ``held``, a unit vector or zero, if it was: of two planes in turn
    each would give back to the other its part.
    """
    beyond = dot(n, q)
    if not beyond > GJK_ROUNDING * EPSILON * size:
        return False, n, held
    way = axpy(-dot(q, held), held, q)
    square = dot(way, way)
    if square <= PARALLEL * dot(q, q):
        way, square = q, dot(q, q)
    return True, unit(axpy(-beyond / square, way, n), n), unit(q, held)


@inlined_kernel
def _turned_once(surfaces, k, size, x, n, held, is_edge):
    """Return (is changed, n, held): each corner beyond the plane takes its share from n."""
    tolerance = ON_IT * COINCIDENCE * size
    near = tolerance * tolerance
    stack = traversal_stack()
    stack[0] = surfaces.node_start[k]
    depth, is_changed = 1, False
    while depth > 0:
        depth -= 1
        node = stack[depth]
        if box_square(x, surfaces.node_lower, surfaces.node_upper, node) > near:
            continue
        left, right = surfaces.node_left[node], surfaces.node_right[node]
        if left >= 0:
            stack[depth], stack[depth + 1] = right, left
            depth += 2
            continue
        for slot in range(-1 - left, -1 - left + right):
            t = surfaces.order[slot]
            a, b, c = corners_at(surfaces, t)
            _, square, _ = nearest_on_triangle(x, a, b, c, load_vector(surfaces.normals, t))
            if square > near:
                continue
            for q in (a, b, c):
                is_less, n, way = _less(n, held, subtract(q, x), size)
                is_changed = is_changed or is_less
                if not is_edge:
                    held = way
    return is_changed, n, held


@inlined_kernel
def turned_into_cone(surfaces, k, size, triangle, feature, x, n):
    """Return n turned until no triangle is beyond it of those that x is on, to rounding.

    x is on an edge or a corner, ``feature`` of ``triangle``. In a groove, where there is no such
    direction, the normal of that triangle is taken, on n's side.
    """
    held, is_edge = (0.0, 0.0, 0.0), feature <= 3
    if is_edge:
        first, last = ends_of(surfaces, triangle, feature)
        a, b = load_vector(surfaces.vertices, first), load_vector(surfaces.vertices, last)
        held = unit(subtract(b, a), held)
    for _ in range(TURNS):
        is_changed, n, held = _turned_once(surfaces, k, size, x, n, held, is_edge)
        if not is_changed:
            return n
    normal = load_vector(surfaces.normals, triangle)
    return normal if dot(normal, n) >= 0.0 else scale(-1.0, normal)
