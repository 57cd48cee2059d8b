"""Signed distance from a point to a convex hull, solid or degenerate.

Hulls are read from ``Hulls.blocks`` (``tables.hull_blocks``): ``start`` is where a block begins,
and a place that of a vertex in the array.
"""

import math

from scene_graph_ros.geometry.compiled.division import reciprocal
from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel
from scene_graph_ros.geometry.query.point.flat_features import (
    nearest_on_segment,
    way_from_segment,
)
from scene_graph_ros.geometry.spatial.vectors import (
    any_orthogonal,
    axpy,
    cross,
    dot,
    norm,
    scale,
    subtract,
    unit,
)
from scene_graph_ros.geometry.tables.hull_blocks import (
    corners_of_face,
    furthest_vertex,
    highest_face,
    likely_vertex,
    list_of_neighbors,
    normal_of_face,
    vertex,
    vertex_place,
)
from scene_graph_ros.geometry.tolerances import COINCIDENCE, EPSILON, GJK_ROUNDING

__all__ = ["FAR", "leave_corner", "leave_hull", "point_convex", "point_hull"]

TURNS = 8
"""A normal has two degrees of freedom: the corners next to x that hold it are few."""

FAR = 0.25
"""Relative to a hull's extent: a point further away than this has the way from its nearest point
for a normal, of which rounding of the coordinates then turns not even the last digits."""

_CORNER_STEPS = 8
"""Bounds the descent to the nearest corner or edge; of points around hulls it takes two or three,
and a point that needs more is looked at face by face."""


@inlined_kernel
def _nearest_on_face(blocks, face, p, n):
    """Return (x, is_inside): the point nearest to p of a face with unit normal n.

    ``is_inside`` tells that p projects into the polygon; then x is left to the caller, which has
    the plane.
    """
    x, least, is_inside = p, math.inf, True
    corners = corners_of_face(blocks, face)
    count = int(blocks[corners])
    a = vertex(blocks, int(blocks[corners + count]))
    for slot in range(corners + 1, corners + 1 + count):
        b = vertex(blocks, int(blocks[slot]))
        if dot(cross(n, subtract(b, a)), subtract(p, a)) < 0.0:
            is_inside = False
            candidate, t = nearest_on_segment(p, a, b)
            offset = way_from_segment(p, a, b, t)
            square = dot(offset, offset)
            if square < least:
                x, least = candidate, square
        a = b
    return x, is_inside


@inlined_kernel
def _nearest_beyond_face(blocks, start, p, x):
    """Return the nearest point of a hull to p outside, given one of it, x, that is near.

    Where p's foot on the highest face is not in it, the nearest point is on an edge: inside a
    face, p would be higher above that face than above the highest. Edges are skipped of which both
    ends lie further along the way from p to the best point than that point. All are looked at once
    more after a better point was found, which changes the way.
    """
    offset = subtract(p, x)
    least = dot(offset, offset)
    distance = math.sqrt(least)
    way = scale(-1.0 / distance, offset) if distance > 0.0 else (0.0, 0.0, 0.0)
    count = int(blocks[start])
    for _ in range(count):
        before = least
        for k in range(count):
            v = vertex_place(start, k)
            a = vertex(blocks, v)
            if dot(way, subtract(a, p)) >= distance:
                continue
            neighbors = list_of_neighbors(blocks, v)
            for slot in range(neighbors + 1, neighbors + 1 + int(blocks[neighbors])):
                candidate, _ = nearest_on_segment(p, a, vertex(blocks, int(blocks[slot])))
                offset = subtract(p, candidate)
                square = dot(offset, offset)
                if square < least:
                    x, least = candidate, square
                    distance = math.sqrt(least)
                    way = scale(-1.0 / distance, offset) if distance > 0.0 else way
        if least == before:
            break
    return x


@inlined_kernel
def _nearest_on_edges(blocks, start, p):
    """Return (x, direction): the nearest point of a hull without faces, and along its edge."""
    best, least, direction = p, math.inf, (0.0, 0.0, 0.0)
    for k in range(int(blocks[start])):
        v = vertex_place(start, k)
        a = vertex(blocks, v)
        offset = subtract(p, a)
        square = dot(offset, offset)
        if square < least:
            best, least = a, square
        neighbors = list_of_neighbors(blocks, v)
        for slot in range(neighbors + 1, neighbors + 1 + int(blocks[neighbors])):
            b = vertex(blocks, int(blocks[slot]))
            direction = subtract(b, a)
            x, _ = nearest_on_segment(p, a, b)
            offset = subtract(p, x)
            square = dot(offset, offset)
            if square < least:
                best, least = x, square
    return best, direction


@inlined_kernel
def _point_wire(blocks, start, p_GQ, tolerance):
    p_GN, direction = _nearest_on_edges(blocks, start, p_GQ)
    offset = subtract(p_GQ, p_GN)
    phi = norm(offset)
    if phi > tolerance:
        return phi, p_GN, unit(offset, (1.0, 0.0, 0.0)), True
    if dot(direction, direction) > 0.0:
        return phi, p_GN, any_orthogonal(unit(direction, (0.0, 0.0, 1.0))), False
    return phi, p_GN, (1.0, 0.0, 0.0), False


@inlined_kernel
def _into_cone(blocks, start, size, x, n):
    """Return the unit vector n turned until no corner of a hull is beyond the plane through x.

    n comes from the difference of two points: close together, rounding turns it, and squares of
    distances do not tell a corner from a point of its edge that is nearer by less than their root
    of rounding. Each corner that is beyond takes its share from n.
    """
    for _ in range(TURNS):
        v = furthest_vertex(blocks, start, n)
        q = subtract(vertex(blocks, v), x)
        beyond = dot(n, q)
        if beyond <= GJK_ROUNDING * EPSILON * size:
            break
        n = unit(axpy(-beyond / dot(q, q), q, n), n)
    return n


@inlined_kernel
def _nearest_corner(blocks, start, size, p, a):
    """Return (is_found, x): the corner, or the point of an edge, of a hull nearest to p far away.

    Steps lead from corner ``a``, probably the nearest one, to the one furthest towards p; between
    two corners x is on their segment, and a third that is further towards p than x makes one of
    its segments with them the next. Where no corner is, x is the nearest point, because the hull
    is convex. Not found are points nearer than ``size`` to the first corner, and those that are
    nearest to a face, where no segment is nearer than the last.
    """
    p_A = vertex(blocks, a)
    n = subtract(p, p_A)
    least = dot(n, n)
    if not least > size * size:
        return False, p
    b, p_B, x = a, p_A, p_A
    for _ in range(_CORNER_STEPS):
        c = furthest_vertex(blocks, start, n)
        p_C = vertex(blocks, c)
        if c in (a, b) or (a == b and dot(p_C, n) <= dot(p_A, n)):
            return True, x
        from_a, t = nearest_on_segment(p, p_A, p_C)
        n_a = subtract(p, from_a)
        square = dot(n_a, n_a)
        if a != b:
            from_b, s = nearest_on_segment(p, p_B, p_C)
            n_b = subtract(p, from_b)
            if dot(n_b, n_b) < square:
                a, p_A, from_a, t, n_a, square = b, p_B, from_b, s, n_b, dot(n_b, n_b)
        if not square < least:
            break
        b, p_B, x, n, least = c, p_C, from_a, n_a, square
        if t == 1.0:
            a, p_A = b, p_B
        elif t == 0.0:
            b, p_B = a, p_A
    return False, x


@lean_kernel
def _point_near_hull(blocks, start, size, p_GQ):
    """Return ``point_hull`` of any point, by the faces."""
    tolerance = COINCIDENCE * size
    face, height, second = highest_face(blocks, start, p_GQ)
    if face < 0:
        return _point_wire(blocks, start, p_GQ, tolerance)
    n = normal_of_face(blocks, face)
    foot = axpy(-height, n, p_GQ)
    if height < -tolerance:
        return height, foot, n, second < height - tolerance
    p_GN, is_above = _nearest_on_face(blocks, face, p_GQ, n)
    if is_above:
        return height, foot, n, height > tolerance or second < height - tolerance
    p_GN = _nearest_beyond_face(blocks, start, p_GQ, p_GN)
    offset = subtract(p_GQ, p_GN)
    phi = norm(offset)
    if phi <= tolerance:
        return height, foot, n, False
    return phi, p_GN, _into_cone(blocks, start, size, p_GN, unit(offset, n)), True


@inlined_kernel
def leave_hull(p_GQ, p_GN, size):
    """Return (phi, grad_G, is_far): the way out to Q, and whether it may be taken for a normal."""
    offset = subtract(p_GQ, p_GN)
    phi = norm(offset)
    return phi, scale(reciprocal(phi), offset), phi > FAR * size


@inlined_kernel
def point_hull(blocks, start, size, p_GQ):
    """Return (phi, p_GN, grad_G, unique) of point Q and the hull in a block, of extent ``size``.

    Inside, of equally near faces the first in the hull's order is chosen, and ``unique`` is
    False; so it is on an edge or a vertex. A flat hull is all surface: phi is nowhere negative.
    """
    return leave_corner(blocks, start, size, p_GQ, likely_vertex(blocks, start, p_GQ))


@lean_kernel
def leave_corner(blocks, start, size, p_GQ, a):
    """Return the answer of ``point_hull``, given the ``likely_vertex``, a."""
    is_found, p_GN = _nearest_corner(blocks, start, size, p_GQ, a)
    if is_found:
        phi, grad_G, is_far = leave_hull(p_GQ, p_GN, size)
        if is_far:
            return phi, p_GN, grad_G, True
    return _point_near_hull(blocks, start, size, p_GQ)


@inlined_kernel
def point_convex(hulls, k, size, p_GQ):
    """Return (phi, p_GN, grad_G, unique) of point Q and hull k as ``point_hull`` does."""
    return point_hull(hulls.blocks, hulls.block_start[k], size, p_GQ)
