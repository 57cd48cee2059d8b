"""Cutting tetrahedra and convex polygons with planes, with one rule for all ties.

A polygon is ``count`` rows of one of the two halves of a ``polygon_buffer``; its corners run
counter-clockwise about its normal. Nothing here allocates.

Ties follow from one picture: a cutting plane or level set f = 0 is meant to lie at f = -0,
just on its negative side. So

- a corner of a tetrahedron with f = 0 is on the positive side: of two tetrahedra that share a
  face with f = 0 the one on the negative side is cut, along the whole face, and the other isn't;
- a polygon that lies in a face of a tetrahedron counts if the tetrahedron is on the polygon's
  negative side, against its normal, and not if it is on the other.

No part of a surface is counted twice or lost where elements share a face, and a body that only
touches a mesh from outside has no contact. A length up to ``slack`` counts as zero, so that
rounding decides none of this and leaves no slivers.
"""

import numpy as np

from scene_graph_ros.geometry.compiled.kernel import lean_kernel
from scene_graph_ros.geometry.cutting.polygons import POLYGON_CORNERS
from scene_graph_ros.geometry.spatial.vectors import (
    axpy,
    dot,
    load_vector,
    scale,
    store_vector,
    subtract,
)

__all__ = [
    "clip_by_half_space",
    "clip_by_tetrahedron",
    "clip_by_values",
    "drop_short_edges",
    "measure",
    "planes_that_cut",
    "side_mask",
    "slice_tetrahedron",
    "snapped",
]

# The edges that a level set crosses, by the set of corners on its negative side (bit i: corner
# i), each from its negative to its positive end, counter-clockwise about the gradient; -1 ends a
# row. With i, j, k, l an even permutation of the corners: i negative alone gives ij, ik, il; i
# positive alone gives ji, li, ki; i and j negative give ik, il, jl, jk.
_NEGATIVE_ENDS = np.array(
    (
        (-1, -1, -1, -1),
        (0, 0, 0, -1),
        (1, 1, 1, -1),
        (0, 0, 1, 1),
        (2, 2, 2, -1),
        (0, 0, 2, 2),
        (1, 1, 2, 2),
        (2, 0, 1, -1),
        (3, 3, 3, -1),
        (0, 0, 3, 3),
        (1, 1, 3, 3),
        (1, 0, 3, -1),
        (2, 2, 3, 3),
        (0, 2, 3, -1),
        (1, 3, 2, -1),
        (-1, -1, -1, -1),
    )
)
_POSITIVE_ENDS = np.array(
    (
        (-1, -1, -1, -1),
        (1, 2, 3, -1),
        (0, 3, 2, -1),
        (2, 3, 3, 2),
        (3, 0, 1, -1),
        (3, 1, 1, 3),
        (0, 3, 3, 0),
        (3, 3, 3, -1),
        (2, 1, 0, -1),
        (1, 2, 2, 1),
        (2, 0, 0, 2),
        (2, 2, 2, -1),
        (0, 1, 1, 0),
        (1, 1, 1, -1),
        (0, 0, 0, -1),
        (-1, -1, -1, -1),
    )
)


@lean_kernel
def snapped(value, slack):
    """Return ``value``, or 0 where it is no larger than ``slack``."""
    return value if abs(value) > slack else 0.0


@lean_kernel
def side_mask(f):
    """Return the set of negative ones of four values, as bits: 0 and 15 are no cut."""
    return (f[0] < 0.0) + 2 * (f[1] < 0.0) + 4 * (f[2] < 0.0) + 8 * (f[3] < 0.0)


@lean_kernel
def slice_tetrahedron(corners, f, mask, polygon):
    """Cut a tetrahedron where a linear function is zero.

    Args:
        corners: (12,) or more: x, then y, then z of the four corners, positively oriented.
        f: the four values at the corners, those up to the slack being exactly zero.
        mask: their ``side_mask``.
        polygon: (8, 3) filled with the cut, counter-clockwise about the gradient of f.

    Returns:
        the number of corners: 0, 3 or 4.

    """
    count = 0
    for k in range(4):
        i, j = _NEGATIVE_ENDS[mask, k], _POSITIVE_ENDS[mask, k]
        if i < 0:
            break
        t = f[i] / (f[i] - f[j])
        for axis in range(3):
            x = corners[4 * axis + i]
            polygon[k, axis] = x + t * (corners[4 * axis + j] - x)
        count += 1
    return count


@lean_kernel
def clip_by_values(polygon, count, heights, result):
    """Keep the part of a polygon where a function, linear on it, is not negative.

    Args:
        polygon: (8, 3) of which ``count`` rows are used.
        count: corners.
        heights: (8,) the values at the corners, those up to the slack being exactly zero.
        result: (8, 3) other than ``polygon``: the part that is kept.

    Returns:
        the number of corners kept.

    """
    kept = 0
    previous = count - 1
    for k in range(count):
        h, g = heights[k], heights[previous]
        if h * g < 0.0 and kept < POLYGON_CORNERS:
            # From the inner to the outer corner: the same point from both sides of the plane.
            inner, outer = (k, previous) if h > 0.0 else (previous, k)
            t = heights[inner] / (heights[inner] - heights[outer])
            for axis in range(3):
                x = polygon[inner, axis]
                result[kept, axis] = x + t * (polygon[outer, axis] - x)
            kept += 1
        if h >= 0.0 and kept < POLYGON_CORNERS:
            for axis in range(3):
                result[kept, axis] = polygon[k, axis]
            kept += 1
        previous = k
    return kept


@lean_kernel
def clip_by_half_space(buffer, side, count, normal, inward, offset, slack, heights):
    """Keep the part of a polygon in the half space ``inward . x + offset >= 0``.

    A polygon in its boundary counts if the half space is on the polygon's negative side.

    Args:
        buffer: a ``polygon_buffer``.
        side: the half of it with the polygon, 0 or 1.
        count: corners.
        normal: of the polygon, of any length.
        inward: unit vector.
        offset: metres.
        slack: metres.
        heights: (8,) scratch.

    Returns:
        (side, count) of the kept polygon.

    """
    above, below = 0, 0
    for k in range(count):
        h = dot(inward, load_vector(buffer[side], k)) + offset
        if h > slack:
            above += 1
        elif h < -slack:
            below += 1
        else:
            h = 0.0
        heights[k] = h
    if above == 0:
        if below == 0 and dot(inward, normal) < 0.0:
            return side, count
        return side, 0
    if below == 0:
        return side, count
    return 1 - side, clip_by_values(buffer[side], count, heights, buffer[1 - side])


@lean_kernel
def _face_heights(planes, x, y, z):
    """Return the heights of a point above the four faces."""
    return (
        planes[0] * x + planes[4] * y + planes[8] * z + planes[12],
        planes[1] * x + planes[5] * y + planes[9] * z + planes[13],
        planes[2] * x + planes[6] * y + planes[10] * z + planes[14],
        planes[3] * x + planes[7] * y + planes[11] * z + planes[15],
    )


@lean_kernel
def planes_that_cut(polygon, count, normal, planes, slack):
    """Mark the faces of a tetrahedron that cut a polygon, before anything is cut.

    Most polygons that are tried lie beyond one of the faces.

    Args:
        polygon: (8, 3) of which ``count`` rows are used.
        count: corners.
        normal: of the polygon, of any length.
        planes: (16,) the faces' unit normals into the tetrahedron, their four x, y and z, and
            four offsets.
        slack: metres.

    Returns:
        the faces that cut it, as bits; -1 if nothing of it counts.

    """
    h = _face_heights(planes, polygon[0, 0], polygon[0, 1], polygon[0, 2])
    low, high = h, h
    for k in range(1, count):
        h = _face_heights(planes, polygon[k, 0], polygon[k, 1], polygon[k, 2])
        low = (min(low[0], h[0]), min(low[1], h[1]), min(low[2], h[2]), min(low[3], h[3]))
        high = (max(high[0], h[0]), max(high[1], h[1]), max(high[2], h[2]), max(high[3], h[3]))
    cutting = 0
    for k in range(4):
        if high[k] <= slack:
            # Beyond the face or, if in it, a matter of the tie.
            along = planes[k] * normal[0] + planes[4 + k] * normal[1] + planes[8 + k] * normal[2]
            if low[k] < -slack or along >= 0.0:
                return -1
        elif low[k] < -slack:
            cutting |= 1 << k
    return cutting


@lean_kernel
def clip_by_tetrahedron(buffer, count, normal, planes, cutting, slack, heights):
    """Keep the part of a polygon inside a tetrahedron.

    Args:
        buffer: a ``polygon_buffer`` with the polygon in its first half.
        count: corners, at most 4 (then at most 8 are kept).
        normal: of the polygon, of any length.
        planes: (16,) as for
        cutting: ``planes_that_cut``, not -1.
        slack: metres.
        heights: (8,) scratch.

    Returns:
        (side, count): the half of the buffer with the kept polygon.

    """
    side = 0
    for k in range(4):
        if cutting & (1 << k) and count > 0:
            inward = (planes[k], planes[4 + k], planes[8 + k])
            side, count = clip_by_half_space(
                buffer, side, count, normal, inward, planes[12 + k], slack, heights
            )
    return side, count


@lean_kernel
def drop_short_edges(polygon, count, shortest):
    """Drop, in place, each corner nearer than ``shortest`` to the one before; return the rest.

    A polygon that is left with less than three corners is none.
    """
    kept = 0
    limit = shortest * shortest
    for k in range(count):
        x = load_vector(polygon, k)
        if kept > 0:
            d = subtract(x, load_vector(polygon, kept - 1))
            if dot(d, d) <= limit:
                continue
        store_vector(polygon, kept, x)
        kept += 1
    while kept > 1:
        d = subtract(load_vector(polygon, kept - 1), load_vector(polygon, 0))
        if dot(d, d) > limit:
            break
        kept -= 1
    return kept if kept >= 3 else 0


@lean_kernel
def measure(polygon, count, normal):
    """Return (area, centroid) of a polygon, the area with the sign its order has about ``normal``.

    A fan of triangles about corner 0: areas add up, centroids are weighted with them.
    """
    a = load_vector(polygon, 0)
    area, moment = 0.0, (0.0, 0.0, 0.0)
    u = subtract(load_vector(polygon, 1), a)
    for k in range(2, count):
        v = subtract(load_vector(polygon, k), a)
        part = 0.5 * (
            normal[0] * (u[1] * v[2] - u[2] * v[1])
            + normal[1] * (u[2] * v[0] - u[0] * v[2])
            + normal[2] * (u[0] * v[1] - u[1] * v[0])
        )
        area += part
        moment = axpy(part, (u[0] + v[0], u[1] + v[1], u[2] + v[2]), moment)
        u = v
    if area == 0.0:
        return 0.0, a
    return area, axpy(1.0, scale(1.0 / (3.0 * area), moment), a)
