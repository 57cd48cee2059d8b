"""Where edges between configurations lead, straight or curved.

An edge is given by control points ``(m, nq)``. Two are the ends of a straight one, on which
floating joints turn the short way at one speed. More are those of a Bézier curve of degree m - 1,
in all entries of a configuration but quaternions, which must be the same in all of them.
"""

import math

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel
from scene_graph_ros.geometry.spatial.elementary import arc_sine, sine_cosine
from scene_graph_ros.robots.tree_kernels import FLOATING, SMALL_ANGLE

__all__ = ["half_turn", "interpolate", "point_on"]


@inlined_kernel
def interpolate(tree, q1, q2, t, out):
    """Write the configuration at t between two; quaternions turn the short way at one speed."""
    for i in range(len(q1)):
        out[i] = (1.0 - t) * q1[i] + t * q2[i]
    for j in range(1, len(tree.kinds)):
        if tree.kinds[j] == FLOATING:
            s = tree.starts[j]
            angle, sign, size1, size2 = half_turn(q1, q2, s)
            a, b = 1.0 - t, sign * t
            if angle > SMALL_ANGLE:
                sine = sine_cosine(angle)[0]
                a, b = sine_cosine(a * angle)[0] / sine, sign * sine_cosine(t * angle)[0] / sine
            for i in range(s, s + 4):
                out[i] = a * q1[i] / size1 + b * q2[i] / size2


@inlined_kernel
def half_turn(q1, q2, s):
    """Return half the angle between two quaternions, the sign that makes it short, and lengths."""
    dot = size1 = size2 = 0.0
    for i in range(s, s + 4):
        size1 += q1[i] * q1[i]
        size2 += q2[i] * q2[i]
    size1, size2 = math.sqrt(size1), math.sqrt(size2)
    for i in range(s, s + 4):
        dot += q1[i] / size1 * (q2[i] / size2)
    sign = 1.0 if dot >= 0.0 else -1.0
    apart = 0.0
    for i in range(s, s + 4):
        apart += (q1[i] / size1 - sign * q2[i] / size2) ** 2
    return 2.0 * arc_sine(min(1.0, 0.5 * math.sqrt(apart))), sign, size1, size2


@inlined_kernel
def point_on(tree, edge, t, out):
    """Write the configuration at t in [0, 1] on an edge ``(m, nq)``."""
    degree = len(edge) - 1
    if degree == 1:
        interpolate(tree, edge[0], edge[1], t, out)
        return
    rest = 1.0 - t
    for i in range(len(out)):
        out[i] = rest * edge[0, i]
    factor = 1.0
    for k in range(1, degree):
        # The binomial coefficient of k, times t to the k.
        factor *= t * (degree - k + 1) / k
        for i in range(len(out)):
            out[i] = rest * (out[i] + factor * edge[k, i])
    factor *= t / degree
    for i in range(len(out)):
        out[i] += factor * edge[degree, i]
