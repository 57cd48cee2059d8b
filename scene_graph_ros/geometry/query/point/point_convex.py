"""Signed distance from a point to a convex hull, solid or degenerate."""

import math

from scene_graph_ros.geometry.jit import inlined_kernel
from scene_graph_ros.geometry.meshes.hull_blocks import furthest_vertex
from scene_graph_ros.geometry.query.point.flat_features import (
    nearest_on_polygon,
    nearest_on_segment,
)
from scene_graph_ros.geometry.spatial.vectors import (
    any_orthogonal,
    axpy,
    dot,
    load_vector,
    norm,
    scale,
    subtract,
    unit,
)
from scene_graph_ros.geometry.tolerances import COINCIDENCE, EPSILON, GJK_ROUNDING

__all__ = ["point_convex"]

TURNS = 8
"""A normal has two degrees of freedom: the corners next to x that hold it are few."""


@inlined_kernel
def _highest_face(hulls, k, p):
    """Return (face, height, second): the face plane that p is highest above, and the runner-up."""
    face, height, second = -1, -math.inf, -math.inf
    for f in range(hulls.face_start[k], hulls.face_start[k + 1]):
        h = dot(load_vector(hulls.face_normals, f), p) - hulls.face_offsets[f]
        if h > height:
            face, height, second = f, h, height
        elif h > second:
            second = h
    return face, height, second


@inlined_kernel
def _nearest_beyond_face(hulls, k, p, x):
    """Return the nearest point of hull k to p outside, given one of it, x, that is near.

    Where p's foot on the highest face is not in it, the nearest point is on an edge: inside a
    face, p would be higher above that face than above the highest. Edges are skipped of which both
    ends lie further along the way from p to the best point than that point. All are looked at once
    more after a better point was found, which changes the way.
    """
    offset = subtract(p, x)
    least = dot(offset, offset)
    distance = math.sqrt(least)
    way = scale(-1.0 / distance, offset) if distance > 0.0 else (0.0, 0.0, 0.0)
    first, last = hulls.vertex_start[k], hulls.vertex_start[k + 1]
    for _ in range(first, last):
        before = least
        for v in range(first, last):
            a = load_vector(hulls.vertices, v)
            if dot(way, subtract(a, p)) >= distance:
                continue
            for slot in range(hulls.neighbor_start[v], hulls.neighbor_start[v + 1]):
                b = load_vector(hulls.vertices, hulls.neighbors[slot])
                candidate, _ = nearest_on_segment(p, a, b)
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
def _nearest_on_edges(hulls, k, p):
    """Return (x, direction): the nearest point of a hull without faces, and along its edge."""
    best, least, direction = p, math.inf, (0.0, 0.0, 0.0)
    for v in range(hulls.vertex_start[k], hulls.vertex_start[k + 1]):
        a = load_vector(hulls.vertices, v)
        offset = subtract(p, a)
        square = dot(offset, offset)
        if square < least:
            best, least = a, square
        for slot in range(hulls.neighbor_start[v], hulls.neighbor_start[v + 1]):
            b = load_vector(hulls.vertices, hulls.neighbors[slot])
            direction = subtract(b, a)
            x, _ = nearest_on_segment(p, a, b)
            offset = subtract(p, x)
            square = dot(offset, offset)
            if square < least:
                best, least = x, square
    return best, direction


@inlined_kernel
def _point_wire(hulls, k, p_GQ, tolerance):
    p_GN, direction = _nearest_on_edges(hulls, k, p_GQ)
    offset = subtract(p_GQ, p_GN)
    phi = norm(offset)
    if phi > tolerance:
        return phi, p_GN, unit(offset, (1.0, 0.0, 0.0)), True
    if dot(direction, direction) > 0.0:
        return phi, p_GN, any_orthogonal(unit(direction, (0.0, 0.0, 1.0))), False
    return phi, p_GN, (1.0, 0.0, 0.0), False


@inlined_kernel
def _into_cone(hulls, k, size, x, n):
    """Return the unit vector n turned until no corner of hull k is beyond the plane through x.

    n comes from the difference of two points: close together, rounding turns it, and squares of
    distances do not tell a corner from a point of its edge that is nearer by less than their root
    of rounding. Each corner that is beyond takes its share from n.
    """
    for _ in range(TURNS):
        v = furthest_vertex(hulls.blocks, hulls.block_start[k], n, -1)
        q = subtract((hulls.blocks[v], hulls.blocks[v + 1], hulls.blocks[v + 2]), x)
        beyond = dot(n, q)
        if beyond <= GJK_ROUNDING * EPSILON * size:
            break
        n = unit(axpy(-beyond / dot(q, q), q, n), n)
    return n


@inlined_kernel
def point_convex(hulls, k, size, p_GQ):
    """Return (phi, p_GN, grad_G, unique) of point Q and hull k, of extent ``size``.

    Inside, of equally near faces the first in the hull's order is chosen, and ``unique`` is
    False; so it is on an edge or a vertex. A flat hull is all surface: phi is nowhere negative.
    """
    tolerance = COINCIDENCE * size
    face, height, second = _highest_face(hulls, k, p_GQ)
    if face < 0:
        return _point_wire(hulls, k, p_GQ, tolerance)
    n = load_vector(hulls.face_normals, face)
    foot = axpy(-height, n, p_GQ)
    if height < -tolerance:
        return height, foot, n, second < height - tolerance
    start, end = hulls.face_vertex_start[face], hulls.face_vertex_start[face + 1]
    p_GN, is_above = nearest_on_polygon(p_GQ, hulls.vertices, hulls.face_vertices, start, end, n)
    if is_above:
        return height, foot, n, height > tolerance or second < height - tolerance
    p_GN = _nearest_beyond_face(hulls, k, p_GQ, p_GN)
    offset = subtract(p_GQ, p_GN)
    phi = norm(offset)
    if phi <= tolerance:
        return height, foot, n, False
    return phi, p_GN, _into_cone(hulls, k, size, p_GN, unit(offset, n)), True
