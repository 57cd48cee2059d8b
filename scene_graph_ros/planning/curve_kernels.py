"""Where edges between configurations lead, straight or curved, and how far they move bodies.

An edge is given by control points ``(m, nq)``. Two are the ends of a straight one, on which
floating joints turn the short way at one speed. More are those of a Bézier curve of degree m - 1,
in all entries of a configuration but quaternions, which must be the same in all of them.
"""

import math

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel
from scene_graph_ros.robots.tree_kernels import FLOATING, PLANAR, PRISMATIC, REVOLUTE

__all__ = ["interpolate", "point_on", "set_ways"]

_ROUNDING = 1e-12
"""Metres that are kept free for what rounding moves links by, times their reach in metres."""


@inlined_kernel
def interpolate(tree, q1, q2, t, out):
    """Write the configuration at t between two; quaternions turn the short way at one speed."""
    for i in range(len(q1)):
        out[i] = (1.0 - t) * q1[i] + t * q2[i]
    for j in range(1, len(tree.kinds)):
        if tree.kinds[j] == FLOATING:
            s = tree.starts[j]
            angle, sign, size1, size2 = _half_turn(q1, q2, s)
            a, b = 1.0 - t, sign * t
            if angle > 1e-4:
                a, b = (
                    math.sin(a * angle) / math.sin(angle),
                    sign * math.sin(t * angle) / math.sin(angle),
                )
            for i in range(s, s + 4):
                out[i] = a * q1[i] / size1 + b * q2[i] / size2


@inlined_kernel
def _half_turn(q1, q2, s):
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
    return 2.0 * math.asin(min(1.0, 0.5 * math.sqrt(apart))), sign, size1, size2


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


@inlined_kernel
def _way_of(tree, joint, last, reach, edge):
    """Return how far any point of a body can move along an edge, and how far out it may be.

    Relative to the joint ``last``; ``reach`` is the largest distance of the body's points from the
    origin of its own joint. Each joint moves what is behind it by its turn times the largest
    distance from its axis, and by its slide. A Bézier curve's speed is nowhere larger than between
    two of its control points, times its degree.
    """
    way, degree = 0.0, len(edge) - 1
    while joint != last:
        kind, s, factor = tree.kinds[joint], tree.starts[joint], tree.multipliers[joint]
        slide = turned = moved = 0.0
        for k in range(degree + 1):
            q = edge[k]
            if kind == PRISMATIC:
                slide = max(slide, abs(factor * q[s] + tree.offsets[joint]))
            elif kind == PLANAR:
                slide = max(slide, math.hypot(q[s], q[s + 1]))
            elif kind == FLOATING:
                slide = max(slide, math.sqrt(q[s + 4] ** 2 + q[s + 5] ** 2 + q[s + 6] ** 2))
            if k == degree:
                break
            r = edge[k + 1]
            if kind == REVOLUTE:
                turned = max(turned, abs(factor * (r[s] - q[s])))
            elif kind == PRISMATIC:
                moved = max(moved, abs(factor * (r[s] - q[s])))
            elif kind == PLANAR:
                moved = max(moved, math.hypot(r[s] - q[s], r[s + 1] - q[s + 1]))
                turned = max(turned, abs(r[s + 2] - q[s + 2]))
            else:
                angle, _, _, _ = _half_turn(q, r, s)
                turned = max(turned, 2.0 * angle)
                dx, dy, dz = r[s + 4] - q[s + 4], r[s + 5] - q[s + 5], r[s + 6] - q[s + 6]
                moved = max(moved, math.sqrt(dx * dx + dy * dy + dz * dz))
        way += degree * (turned * reach + moved)
        X = tree.X_PJ[joint]
        reach += slide + math.sqrt(X[0, 3] ** 2 + X[1, 3] ** 2 + X[2, 3] ** 2)
        joint = tree.parents[joint]
    return way, reach


@inlined_kernel
def set_ways(tree, bodies, pairs, reaches, edge, ways, margins, own):
    """Write, for each pair, how far it can move along an edge, and what rounding is allowed.

    ``own`` ``(r, 2)`` is scratch: the same of each body of a robot, against what does not move.
    """
    robots = len(bodies.joints)
    for a in range(robots):
        own[a, 0], own[a, 1] = _way_of(tree, bodies.joints[a], 0, reaches[a], edge)
    for p in range(len(pairs.bodies)):
        a, b = pairs.bodies[p, 0], pairs.bodies[p, 1]
        way, reach = own[a, 0], own[a, 1]
        if b < robots:
            way, reach = _way_of(tree, bodies.joints[a], pairs.shared[p], reaches[a], edge)
            more, other = _way_of(tree, bodies.joints[b], pairs.shared[p], reaches[b], edge)
            way, reach = way + more, max(reach, other)
        ways[p], margins[p] = way, _ROUNDING * (1.0 + reach)
