"""Where a chain leads at a configuration, and how far its condition is from being held.

Notation: A is the frame of a condition, T the tool at the chain's end.
"""

import math

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel
from scene_graph_ros.geometry.spatial.elementary import arc_tangent, sine_cosine
from scene_graph_ros.planning.constraints.constraint_table import (
    BALL,
    BALL_INVERSE,
    BETWEEN,
    NEAR,
    SLIDE,
    TURN,
)

__all__ = ["cross", "measure", "place_chain", "state_of", "values_of"]


@inlined_kernel
def _product(Q, W):
    """Return the product of two quaternions, w first."""
    a, b, c, d = Q
    e, f, g, h = W
    return (
        a * e - b * f - c * g - d * h,
        a * f + b * e + c * h - d * g,
        a * g - b * h + c * e + d * f,
        a * h + b * g - c * f + d * e,
    )


@inlined_kernel
def _turned(Q, r):
    """Return a vector that is turned by a quaternion."""
    w, a, b, c = Q
    x, y, z = r
    tx, ty, tz = 2.0 * (b * z - c * y), 2.0 * (c * x - a * z), 2.0 * (a * y - b * x)
    return (
        w * tx + (b * tz - c * ty) + x,
        w * ty + (c * tx - a * tz) + y,
        w * tz + (a * ty - b * tx) + z,
    )


@inlined_kernel
def _unit(Q):
    """Return a quaternion of length 1."""
    w, x, y, z = Q
    largest = max(abs(w), abs(x), abs(y), abs(z))
    w, x, y, z = w / largest, x / largest, y / largest, z / largest
    size = math.sqrt(w * w + x * x + y * y + z * z)
    return w / size, x / size, y / size, z / size


@inlined_kernel
def _store(axes, e, k, factor, v):
    for i in range(3):
        axes[e, k, i] = factor * v[i]


@inlined_kernel
def _keep_axes(axes, e, kind, multiplier, before, after):
    """Write the axes in A about, or along, which an element moves the tool by unit rates."""
    if kind == BALL_INVERSE:
        _store(axes, e, 0, -1.0, _turned(before, (1.0, 0.0, 0.0)))
        _store(axes, e, 1, -1.0, _turned(before, (0.0, 1.0, 0.0)))
        _store(axes, e, 2, -1.0, _turned(before, (0.0, 0.0, 1.0)))
    elif kind == BALL:
        _store(axes, e, 0, 1.0, _turned(after, (1.0, 0.0, 0.0)))
        _store(axes, e, 1, 1.0, _turned(after, (0.0, 1.0, 0.0)))
        _store(axes, e, 2, 1.0, _turned(after, (0.0, 0.0, 1.0)))
    else:
        _store(axes, e, 0, multiplier, _turned(before, (0.0, 0.0, 1.0)))


@inlined_kernel
def place_chain(table, c, q, axes, origins):
    """Write axes ``(e, 3, 3)`` and origins ``(e, 3)`` of a chain's elements, in A.

    Return the tool's quaternion, w first, and its place. Floating joints turn by small turns in
    their own frames, which have three axes; all other elements have one.
    """
    Q, x, y, z = (1.0, 0.0, 0.0, 0.0), 0.0, 0.0, 0.0
    for e in range(table.firsts[c], table.firsts[c + 1]):
        F, r, kind, column = table.frames[e], table.places[e], table.elements[e], table.columns[e]
        dx, dy, dz = _turned(Q, (r[0], r[1], r[2]))
        x, y, z = x + dx, y + dy, z + dz
        Q = _product(Q, (F[0], F[1], F[2], F[3]))
        before = Q
        if kind == TURN:
            s, w = sine_cosine(0.5 * (table.multipliers[e] * q[column] + table.offsets[e]))
            Q = _product(Q, (w, 0.0, 0.0, s))
        elif kind == SLIDE:
            way = table.multipliers[e] * q[column] + table.offsets[e]
            dx, dy, dz = _turned(Q, (0.0, 0.0, way))
            x, y, z = x + dx, y + dy, z + dz
        else:
            w, i, j, k = _unit((q[column], q[column + 1], q[column + 2], q[column + 3]))
            sign = 1.0 if kind == BALL else -1.0
            Q = _product(Q, (w, sign * i, sign * j, sign * k))
        origins[e, 0], origins[e, 1], origins[e, 2] = x, y, z
        _keep_axes(axes, e, kind, table.multipliers[e], before, Q)
    F, r = table.ends_Q[c], table.ends_p[c]
    dx, dy, dz = _turned(Q, (r[0], r[1], r[2]))
    Q = _unit(_product(Q, (F[0], F[1], F[2], F[3])))
    return Q, (x + dx, y + dy, z + dz)


@inlined_kernel
def state_of(table, c, Q, p):
    """Return four numbers of a condition that move along an edge.

    That is the link's vector in A, the turn from the target (a quaternion, w first), or the point.
    """
    if table.kinds[c] == BETWEEN:
        b = table.vectors[c]
        x, y, z = _turned(Q, (b[0], b[1], b[2]))
        return x, y, z, 0.0
    if table.kinds[c] == NEAR:
        t = table.targets[c]
        return _product(Q, (t[0], -t[1], -t[2], -t[3]))
    return p[0], p[1], p[2], 0.0


@inlined_kernel
def cross(a, b):
    """Return the cross product of two vectors."""
    return (
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    )


@inlined_kernel
def _least_axis(a):
    """Return the axis of coordinates along which a vector is shortest."""
    if abs(a[0]) <= min(abs(a[1]), abs(a[2])):
        return 1.0, 0.0, 0.0
    if abs(a[1]) <= abs(a[2]):
        return 0.0, 1.0, 0.0
    return 0.0, 0.0, 1.0


@inlined_kernel
def _angle_and_axis(table, c, state):
    """Return the angle of a condition of turns, rad, and the axis in A about which it grows."""
    x, y, z, w = state
    if table.kinds[c] == NEAR:
        w, x, y, z = state
        if w < 0.0:
            w, x, y, z = -w, -x, -y, -z
        size = math.sqrt(x * x + y * y + z * z)
        angle = 2.0 * arc_tangent(size, w)
    else:
        a = table.targets[c]
        dot = a[0] * x + a[1] * y + a[2] * z
        x, y, z = cross((a[0], a[1], a[2]), (x, y, z))
        size = math.sqrt(x * x + y * y + z * z)
        angle = arc_tangent(size, dot)
        if not size > 0.0:
            # Any axis across the vector: it begins to leave it, or its opposite, somewhere.
            x, y, z = cross((a[0], a[1], a[2]), _least_axis(a))
            size = math.sqrt(x * x + y * y + z * z)
    if size > 0.0:
        return angle, (x / size, y / size, z / size)
    return angle, (0.0, 0.0, 0.0)


@inlined_kernel
def values_of(table, c, Q, p):
    """Return the values that a condition bounds, three of a box and else one, and an axis."""
    state = state_of(table, c, Q, p)
    if table.kinds[c] <= NEAR:
        angle, axis = _angle_and_axis(table, c, state)
        return (angle, 0.0, 0.0), axis
    return (p[0], p[1], p[2]), (0.0, 0.0, 0.0)


@lean_kernel
def measure(table, q, axes, origins, values):
    """Write the values ``(n, c, 3)`` of all conditions at configurations ``(n, nq)``."""
    for row in range(len(q)):
        for c in range(len(table.kinds)):
            Q, p = place_chain(table, c, q[row], axes, origins)
            found, _ = values_of(table, c, Q, p)
            for i in range(3):
                values[row, c, i] = found[i]
