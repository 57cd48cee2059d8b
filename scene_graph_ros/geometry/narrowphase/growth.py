"""How fast the extent of a core grows around the normal of a contact, bounded from below.

The support function h of a core with a witness q and the outward unit normal m there is

    h(m + y) >= q . (m + y) + y G y    for all y orthogonal to m with |y| <= reach.

G = 0 is right for every core; it is larger the less the surface bends, and depends on the reach.
It is the sum of two forms. One is of what is round: there h is |M x| with a matrix M, which has
the semi-axes of an ellipsoid, or the radius of a cylinder across its axis. With e = M m / |M m|,
q is M e, and with f = M y - (e . M y) e

    |M x| - e . M x = |f|^2 / (|M x| + e . M x)    at x = m + y,

a quadratic form over a denominator that is bounded within the reach. The other is of what is flat:
where q is inside of a line or a face orthogonal to m, at least k from its border, h grows by
k |y| >= k |y|^2 / reach for y along it.

Frames: the rows of R are m (or -m), t and u in the core's frame; t and u are y's coordinates.
"""

import math

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel
from scene_graph_ros.geometry.narrowphase.cores import (
    BOX,
    CYLINDER,
    ELLIPSOID,
    HULL,
    ORIGIN,
    SEGMENT,
)
from scene_graph_ros.geometry.spatial.vectors import (
    add,
    cross,
    dot,
    norm,
    rotate_inverse,
    scale,
    subtract,
    unit,
)
from scene_graph_ros.geometry.tables.hull_blocks import (
    edge_range,
    EDGE_STRIDE,
    vertex,
    vertex_place,
)
from scene_graph_ros.geometry.tolerances import CONTACT_MISFIT, EPSILON, TIE

__all__ = ["growth", "known_reach"]

NOTHING = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
"""No growth is known: that is right for every point of a core."""

WIDEST = 1.5
"""The first reach that is tried: beyond the corners of a square of half width 1."""

NARROWER = 0.8
"""Each reach that is tried over the one before."""

MAX_TRIALS = 16
"""Down to a reach of 0.05, two degrees of direction."""


@lean_kernel
def _along(strength, x, y):
    """Return (tt, tu, uu) of a strength times the square of a vector with coordinates x, y."""
    return strength * x * x, strength * x * y, strength * y * y


@lean_kernel
def _of_ellipsoid(axes, q, m, t, u, near):
    w = (axes[0] * m[0], axes[1] * m[1], axes[2] * m[2])
    length = norm(w)
    w = scale(1.0 / length, w)
    if norm(subtract((axes[0] * w[0], axes[1] * w[1], axes[2] * w[2]), q)) > near:
        return NOTHING
    mt = (axes[0] * t[0], axes[1] * t[1], axes[2] * t[2])
    mu = (axes[0] * u[0], axes[1] * u[1], axes[2] * u[2])
    x, y = dot(w, mt), dot(w, mu)
    f, g = cross(mt, w), cross(mu, w)
    slope = math.sqrt(x * x + y * y)
    return length, slope, dot(f, f), dot(f, g), dot(g, g), 0.0, 0.0, 0.0


@lean_kernel
def _of_line(half, q, m, t, u, flat):
    """Return (tt, tu, uu) of the line of that half length along the third axis."""
    if abs(m[2]) * half > flat:
        return 0.0, 0.0, 0.0
    return _along(max(half - abs(q[2]), 0.0), t[2], u[2])


@lean_kernel
def _of_cylinder(radius, half, q, m, t, u, flat, near):
    kt, ku, uu = _of_line(half, q, m, t, u, flat)
    across = math.sqrt(m[0] * m[0] + m[1] * m[1])
    if across * radius <= flat:
        rest = max(radius - math.sqrt(q[0] * q[0] + q[1] * q[1]), 0.0)
        return 0.0, 0.0, 0.0, 0.0, 0.0, rest, 0.0, rest
    x, y = m[0] / across, m[1] / across
    if abs(radius * x - q[0]) + abs(radius * y - q[1]) > near:
        return NOTHING
    tt, tu, vv = _along(radius * radius, x * t[1] - y * t[0], x * u[1] - y * u[0])
    return radius * across, radius * abs(m[2]), tt, tu, vv, kt, ku, uu


@lean_kernel
def _of_box(h, q, m, t, u, flat):
    kt = ku = uu = 0.0
    for c in range(3):
        if abs(m[c]) * h[c] <= flat:
            a, b, d = _along(max(h[c] - abs(q[c]), 0.0), t[c], u[c])
            kt, ku, uu = kt + a, ku + b, uu + d
    return 0.0, 0.0, 0.0, 0.0, 0.0, kt, ku, uu


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
def _of_hull(hulls, hull, q, m, t, u, flat):
    """Return the growth of the edge or the face of a hull that is orthogonal to m."""
    count, total, a, b = _on_plane(hulls, hull, q, m, flat)
    if count > 2:
        middle = scale(1.0 / count, total)
        room = _room_on_face(hulls, hull, q, m, middle, count, flat)
        return 0.0, 0.0, 0.0, 0.0, 0.0, room, 0.0, room
    if count == 2:
        e = unit(subtract(b, a), ORIGIN)
        if norm(cross(e, a)) <= flat:
            kt, ku, uu = _along(min(norm(a), norm(b)), dot(e, t), dot(e, u))
            return 0.0, 0.0, 0.0, 0.0, 0.0, kt, ku, uu
    return NOTHING


@inlined_kernel
def growth(core, hulls, R, p, q, m, size):
    """Return the growth of a core's extent around the outward normal m at its point q.

    ``size``: the pair's (m). The eight numbers are only for ``known_reach``.
    """
    flat, near = TIE * EPSILON * size, CONTACT_MISFIT * size
    kind, h = core[0], core[3]
    t, u = (R[3], R[4], R[5]), (R[6], R[7], R[8])
    q = rotate_inverse(R, subtract(q, p))
    m = rotate_inverse(R, m)
    if kind == ELLIPSOID:
        return _of_ellipsoid(h, q, m, t, u, near)
    if kind == CYLINDER:
        return _of_cylinder(h[0], h[1], q, m, t, u, flat, near)
    if kind == SEGMENT:
        kt, ku, uu = _of_line(h[0], q, m, t, u, flat)
        return 0.0, 0.0, 0.0, 0.0, 0.0, kt, ku, uu
    if kind == BOX:
        return _of_box(h, q, m, t, u, flat)
    if kind == HULL:
        return _of_hull(hulls, core[1], q, m, t, u, flat)
    return NOTHING


@inlined_kernel
def _form(known, reach):
    """Return (tt, tu, uu) of G within a reach."""
    length, slope, tt, tu, uu, kt, ku, kk = known
    longest = length + reach * slope
    total = longest + math.sqrt(longest * longest + reach * reach * (tt + uu))
    bend = 1.0 / total if total > 0.0 else 0.0
    flat = 1.0 / reach
    return bend * tt + flat * kt, bend * tu + flat * ku, bend * uu + flat * kk


@inlined_kernel
def known_reach(growth_A, growth_B, depth):
    """Return the reach within which a sum of two extents exceeds ``depth`` |m + y|; 0 for none.

    Both are those of a contact: at m, the sum is the depth, and it is stationary. |m + y| is at
    most 1 + |y|^2 / 2, so it is enough that G exceeds half the depth along every y.
    """
    reach = WIDEST
    for _ in range(MAX_TRIALS):
        a, b, c = _form(growth_A, reach)
        d, e, f = _form(growth_B, reach)
        tt, tu, uu = a + d - 0.5 * depth, b + e, c + f - 0.5 * depth
        if tt > 0.0 and uu > 0.0 and tt * uu > tu * tu:
            return reach
        reach *= NARROWER
    return 0.0
