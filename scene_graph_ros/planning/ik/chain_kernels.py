"""Where the joints and the tool of a chain are, for eight sets of coordinates at a time.

Lengths are in the unit of the chain. Notation: B is the robot's base, T the tool.
"""

import numpy as np

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, kernel
from scene_graph_ros.geometry.compiled.lanes import every, LANES, load_lanes, store_lanes
from scene_graph_ros.robots.tree_kernels import sines_cosines

__all__ = ["goals_in_base", "place_tool", "quaternion_product", "tool_poses"]


@inlined_kernel
def quaternion_product(Q, W):
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
def _moved(Q, p, r):
    """Return p and a vector r that is turned by a quaternion."""
    w, a, b, c = Q
    x, y, z = r
    tx, ty, tz = 2.0 * (b * z - c * y), 2.0 * (c * x - a * z), 2.0 * (a * y - b * x)
    return (
        p[0] + (w * tx + (b * tz - c * ty) + x),
        p[1] + (w * ty + (c * tx - a * tz) + y),
        p[2] + (w * tz + (a * ty - b * tx) + z),
    )


@inlined_kernel
def place_tool(chain, x, axes, origins, work):
    """Write axes and origins ``(k, 3, LANES)`` of joints at ``x`` ``(n, LANES)``.

    Return the tool's quaternion and place in B. ``work`` is ``(3, LANES)``.
    """
    zero = every(0.0)
    Q, p = (every(1.0), zero, zero, zero), (zero, zero, zero)
    angles, sines, cosines = work[0], work[1], work[2]
    count = len(chain.slides)
    for i in range(count):
        F, r = chain.quaternions[i], chain.places[i]
        p = _moved(Q, p, (r[0], r[1], r[2]))
        Q = quaternion_product(Q, (F[0], F[1], F[2], F[3]))
        w, a, b, c = Q
        axis = 2.0 * (a * c + w * b), 2.0 * (b * c - w * a), 1.0 - 2.0 * (a * a + b * b)
        for m in range(3):
            store_lanes(axes, (3 * i + m) * LANES, axis[m])
            store_lanes(origins, (3 * i + m) * LANES, p[m])
        value = every(chain.offsets[i])
        if chain.columns[i] >= 0:
            value = load_lanes(x, chain.columns[i] * LANES) * chain.multipliers[i] + value
        if chain.slides[i]:
            p = p[0] + axis[0] * value, p[1] + axis[1] * value, p[2] + axis[2] * value
        else:
            store_lanes(angles, 0, 0.5 * value)
            sines_cosines(angles, sines, cosines)
            s, c_ = load_lanes(sines, 0), load_lanes(cosines, 0)
            Q = w * c_ - c * s, a * c_ + b * s, b * c_ - a * s, c * c_ + w * s
    F, r = chain.quaternions[count], chain.places[count]
    p = _moved(Q, p, (r[0], r[1], r[2]))
    return quaternion_product(Q, (F[0], F[1], F[2], F[3])), p


@kernel
def tool_poses(chain, x, poses):
    """Write quaternions, w first, and places ``(m, 7)`` of the tool in B at ``x`` ``(m, n)``."""
    m, n = x.shape
    count = len(chain.slides)
    axes, origins = np.empty((count, 3, LANES)), np.empty((count, 3, LANES))
    work, here = np.empty((3, LANES)), np.zeros((n, LANES))
    out = np.empty((7, LANES))
    for first in range(0, m, LANES):
        for k in range(LANES):
            for j in range(n):
                here[j, k] = x[min(first + k, m - 1), j]
        Q, p = place_tool(chain, here, axes, origins, work)
        for i in range(4):
            store_lanes(out, i * LANES, Q[i])
        for i in range(3):
            store_lanes(out, (4 + i) * LANES, p[i])
        for k in range(min(LANES, m - first)):
            for i in range(7):
                poses[first + k, i] = out[i, k]


@kernel
def goals_in_base(X_WTs, quaternions, X_WB, base, unit, goals):
    """Write poses ``(m, 4, 4)`` seen from B as quaternions, w first, and places ``(m, 7)``.

    ``quaternions`` ``(m, 4)`` are those of ``X_WTs``, ``base`` ``(4,)`` is that of ``X_WB``, both
    with w last. Places are subtracted before they are turned; ``unit`` is theirs, in m.
    """
    back = base[3], -base[0], -base[1], -base[2]
    for i in range(len(X_WTs)):
        q, X = quaternions[i], X_WTs[i]
        w, a, b, c = quaternion_product(back, (q[3], q[0], q[1], q[2]))
        goals[i, 0], goals[i, 1], goals[i, 2], goals[i, 3] = w, a, b, c
        dx, dy, dz = X[0, 3] - X_WB[0, 3], X[1, 3] - X_WB[1, 3], X[2, 3] - X_WB[2, 3]
        for m in range(3):
            way = X_WB[0, m] * dx + X_WB[1, m] * dy + X_WB[2, m] * dz
            goals[i, 4 + m] = way / unit
