"""The colour of a picture at a point of the surface that it covers.

Coordinates are interpolated between the corners of the triangle at that very point, so that
perspective needs no correction. Between texels colours are bilinear; the picture repeats itself.
"""

import math

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel
from scene_graph_ros.geometry.compiled.places import LAST_PLACE
from scene_graph_ros.geometry.perception.exact.normals import triangle_corners
from scene_graph_ros.geometry.perception.exact.parametrization import picture_coordinates
from scene_graph_ros.geometry.shapes.kinds import ShapeKind
from scene_graph_ros.geometry.spatial.vectors import cross, dot, load_vector, subtract

__all__ = ["texel_at"]

_HALF_SPACE = int(ShapeKind.HALF_SPACE)
_LEVELS = 255.0


@lean_kernel
def _on_triangle(bodies, cover, row, triangle, p_GQ):
    """Return (u, v) at a point of a triangle."""
    a, b, c = triangle_corners(bodies, row, triangle)
    ab, ac, aq = subtract(b, a), subtract(c, a), subtract(p_GQ, a)
    n = cross(ab, ac)
    square = dot(n, n)
    to_b = dot(cross(aq, ac), n) / square if square > 0.0 else 0.0
    to_c = dot(cross(ab, aq), n) / square if square > 0.0 else 0.0
    corners = cover.corners
    at = (cover.first[row] + triangle) & LAST_PLACE
    u = corners[at, 0, 0]
    u += to_b * (corners[at, 1, 0] - corners[at, 0, 0])
    u += to_c * (corners[at, 2, 0] - corners[at, 0, 0])
    v = corners[at, 0, 1]
    v += to_b * (corners[at, 1, 1] - corners[at, 0, 1])
    v += to_c * (corners[at, 2, 1] - corners[at, 0, 1])
    return u, v


@inlined_kernel
def _cell(x, count):
    """Return two neighbouring texels of a line that repeats, and the share of the second.

    ``x`` is from 0 to 1; texel i has its centre at ``(i + 0.5) / count``.
    """
    x = (x - math.floor(x)) * count - 0.5
    low = math.floor(x)
    first = int(low)
    second = first + 1
    if first < 0:
        first += count
    if second >= count:
        second -= count
    return first, second, x - low


@inlined_kernel
def _mixed(texels, a, b, c, d, x, y, channel):
    upper = texels[a, channel] + x * (float(texels[b, channel]) - texels[a, channel])
    lower = texels[c, channel] + x * (float(texels[d, channel]) - texels[c, channel])
    return (upper + y * (lower - upper)) / _LEVELS


@lean_kernel
def texel_at(bodies, cover, row, triangle, picture, p_GQ):
    """Return red, green, blue and alpha, 0 to 1, of a picture on a body at a point of it."""
    kind = bodies.kind[row]
    if kind > _HALF_SPACE:
        u, v = _on_triangle(bodies, cover, row, triangle, p_GQ)
    else:
        u, v = picture_coordinates(kind, load_vector(bodies.size, row), p_GQ)
    picture = picture & LAST_PLACE
    width, height = cover.size[picture, 0], cover.size[picture, 1]
    left, right, x = _cell(u * cover.repeats[row, 0], width)
    up, down, y = _cell(-v * cover.repeats[row, 1], height)
    start, texels = cover.start[picture], cover.texels
    a, b = (start + up * width + left) & LAST_PLACE, (start + up * width + right) & LAST_PLACE
    c, d = (start + down * width + left) & LAST_PLACE, (start + down * width + right) & LAST_PLACE
    return (
        _mixed(texels, a, b, c, d, x, y, 0),
        _mixed(texels, a, b, c, d, x, y, 1),
        _mixed(texels, a, b, c, d, x, y, 2),
        _mixed(texels, a, b, c, d, x, y, 3),
    )
