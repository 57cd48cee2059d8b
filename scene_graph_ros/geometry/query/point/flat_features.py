"""Nearest points on segments and triangles: the flat pieces of hulls and meshes."""

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, kernel
from scene_graph_ros.geometry.compiled.lanes import select
from scene_graph_ros.geometry.spatial.vectors import axpy, cross, dot, subtract
from scene_graph_ros.geometry.tolerances import EPSILON, GJK_ROUNDING

__all__ = [
    "nearest_on_segment",
    "nearest_on_segments",
    "nearest_on_triangle",
    "way_from_segment",
]


@kernel
def nearest_on_segment(p, a, b):
    """Return (x, t): the point of segment ab nearest to p, and its place t in [0, 1]."""
    edge = subtract(b, a)
    square = dot(edge, edge)
    reach = dot(subtract(p, a), edge)
    if not reach > 0.0:
        return a, 0.0
    if reach >= square:
        return b, 1.0
    t = reach / square
    # Starting at the nearer end keeps the rounding below that of the coordinates.
    x = axpy(t, edge, a) if t <= 0.5 else axpy(t - 1.0, edge, b)
    return x, t


@inlined_kernel
def _choose(choices, a, b):
    return (
        select(choices, a[0], b[0]),
        select(choices, a[1], b[1]),
        select(choices, a[2], b[2]),
    )


@inlined_kernel
def nearest_on_segments(p, a, b):
    """Return the same as ``nearest_on_segment``, of lanes."""
    edge = subtract(b, a)
    square = dot(edge, edge)
    reach = dot(subtract(p, a), edge)
    t = reach / square
    near, far = axpy(t, edge, a), axpy(t - 1.0, edge, b)
    is_past_a, is_past_b, is_near = reach > 0.0, reach >= square, t <= 0.5
    x = _choose(is_past_a, _choose(is_past_b, b, _choose(is_near, near, far)), a)
    t = select(is_past_a, select(is_past_b, 1.0, t), 0.0)
    return x, t


@kernel
def way_from_segment(p, a, b, t):
    """Return p less the point of ab at t, from the nearer end: its rounding is that of its length.

    The difference of p and the rounded point would have that of the coordinates.
    """
    edge = subtract(b, a)
    if t <= 0.5:
        return axpy(-t, edge, subtract(p, a))
    return axpy(1.0 - t, edge, subtract(p, b))


@kernel
def nearest_on_triangle(p, a, b, c, n):
    """Return (x, square, feature): the nearest point, its squared distance, and where it lies.

    ``n`` is the unit normal of abc, or zero for a triangle without area. ``feature`` is 0 inside,
    1, 2, 3 on the edges ab, bc, ca, and 4, 5, 6 at the corners a, b, c.
    """
    if dot(n, n) > 0.0:
        outside_ab = dot(cross(n, subtract(b, a)), subtract(p, a)) < 0.0
        outside_bc = dot(cross(n, subtract(c, b)), subtract(p, b)) < 0.0
        outside_ca = dot(cross(n, subtract(a, c)), subtract(p, c)) < 0.0
        if not (outside_ab or outside_bc or outside_ca):
            height = dot(n, subtract(p, a))
            return axpy(-height, n, p), height * height, 0
    else:
        outside_ab = outside_bc = outside_ca = True
    best, least, feature = a, 1e300, 4
    for k in range(3):
        if k == 0:
            outside, start, end = outside_ab, a, b
        elif k == 1:
            outside, start, end = outside_bc, b, c
        else:
            outside, start, end = outside_ca, c, a
        if outside:
            x, t = nearest_on_segment(p, start, end)
            offset = way_from_segment(p, start, end, t)
            square = dot(offset, offset)
            # A corner and a point next to it may be equally near to rounding: the latter is right.
            is_inner, is_nearer = 0.0 < t < 1.0, square < least
            slack = GJK_ROUNDING * EPSILON * square
            if is_inner != (feature <= 3) and abs(square - least) <= slack:
                is_nearer = is_inner
            if is_nearer:
                best, least, feature = x, square, k + 1
                if t == 0.0:
                    feature = k + 4
                elif t == 1.0:
                    feature = (k + 1) % 3 + 4
    return best, least, feature
