"""Where a feature of one box lies over a face of another."""

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, kernel, lean_kernel
from scene_graph_ros.geometry.cutting.polygons import polygon_buffer
from scene_graph_ros.geometry.tolerances import EPSILON

__all__ = ["middle_of_quad", "middle_of_segment"]


@kernel
def middle_of_segment(x, y, ux, uy, width, height):
    """Return (t, is_over): the middle of the rectangle's part of (x, y) + t (ux, uy).

    The rectangle has half extents (width, height); t is in [-1, 1].
    """
    low, high = -1.0, 1.0
    is_over = True
    for axis in range(2):
        c, u, h = (x, ux, width) if axis == 0 else (y, uy, height)
        if u == 0.0:
            is_over = is_over and abs(c) <= h
        else:
            a, b = (-h - c) / u, (h - c) / u
            low, high = max(low, min(a, b)), min(high, max(a, b))
    is_over = is_over and low <= high
    return min(max(0.5 * (low + high), -1.0), 1.0), is_over


@lean_kernel
def _cut(buffer, source, count, axis, sign, bound):
    """Keep the polygon's part with ``sign * coordinate <= bound``; return the corners' number.

    One step of Sutherland and Hodgman, "Reentrant polygon clipping", 1974.
    """
    kept, last = 0, count - 1
    previous = sign * buffer[source, last, axis] - bound
    for k in range(count):
        here = sign * buffer[source, k, axis] - bound
        if (here > 0.0) != (previous > 0.0):
            s = previous / (previous - here)
            for i in range(2):
                start = buffer[source, last, i]
                buffer[1 - source, kept, i] = start + s * (buffer[source, k, i] - start)
            kept += 1
        if here <= 0.0:
            for i in range(2):
                buffer[1 - source, kept, i] = buffer[source, k, i]
            kept += 1
        previous, last = here, k
    return kept


@lean_kernel
def _centroid(buffer, source, count, least_area):
    """Return the polygon's centroid, or its corners' mean where it has no area."""
    x0, y0 = buffer[source, 0, 0], buffer[source, 0, 1]
    area = sx = sy = mx = my = 0.0
    for k in range(count):
        following = k + 1 if k + 1 < count else 0
        ax, ay = buffer[source, k, 0] - x0, buffer[source, k, 1] - y0
        bx, by = buffer[source, following, 0] - x0, buffer[source, following, 1] - y0
        twice = ax * by - ay * bx
        area += twice
        sx += twice * (ax + bx)
        sy += twice * (ay + by)
        mx += ax
        my += ay
    if abs(area) > least_area:
        return x0 + sx / (3.0 * area), y0 + sy / (3.0 * area)
    return x0 + mx / count, y0 + my / count


@inlined_kernel
def middle_of_quad(c, u, v, width, height):
    """Return (x, y, is_over): the centroid of a rectangle's part of a quadrilateral.

    The quadrilateral is c + [-1, 1] u + [-1, 1] v, the rectangle is centred, of half extents
    (width, height). ``is_over`` is False, and the point is c, where nothing is left.
    """
    buffer = polygon_buffer()
    for k in range(4):
        a = 1.0 if k == 0 or k == 3 else -1.0
        b = 1.0 if k < 2 else -1.0
        for i in range(2):
            buffer[0, k, i] = c[i] + a * u[i] + b * v[i]
    source, count = 0, 4
    for side in range(4):
        axis = side >> 1
        bound = width if axis == 0 else height
        count = _cut(buffer, source, count, axis, 1.0 if side & 1 else -1.0, bound)
        source = 1 - source
        if count == 0:
            return c[0], c[1], False
    size = max(abs(u[0]) + abs(v[0]), abs(u[1]) + abs(v[1]))
    x, y = _centroid(buffer, source, count, EPSILON * size * size)
    return x, y, True
