"""Proofs that edges hold conditions on links at all times, by bounds of second derivatives.

Along an edge the vector u that a link carries has ``|u''| <= S^2 + T``: S adds up the speeds of
all joints that turn between the frame and the link, T the changes of these. A turn as a unit
quaternion has a quarter of S^2, and half of T. A point has ``p'' = sum of v_i v_j d_ij`` over all
pairs of joints, whose d are at most the distances from joints to the point (``edge_deviation``).
So on a stretch of length h each is off its chord by at most ``B h^2 s (1 - s) / 2``, s in [0, 1].
Cones around a vector or an orientation, half-spaces and boxes are convex: along the chord the
distance outside of them is at most linear in s. A vector that stays out of a cone is beyond one of
the cone's tangent planes. Stretches that this does not decide are halved.
"""

import math

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel
from scene_graph_ros.geometry.spatial.elementary import sine_cosine
from scene_graph_ros.planning.constraints.chain_states import place_chain, state_of, values_of
from scene_graph_ros.planning.constraints.constraint_table import (
    BETWEEN,
    BOX,
    NEAR,
    SLIDE,
    TURN,
)
from scene_graph_ros.planning.edges.curve_kernels import half_turn, point_on

__all__ = ["DEPTH", "HELD", "UNDECIDED", "VIOLATED", "prove_constraints"]

HELD, VIOLATED, UNDECIDED = range(3)
"""Answers about an edge."""

DEPTH = 40
"""Halvings of an edge at most."""

_LOOKS = 65536
"""Configurations of an edge that are looked at for a condition at most."""

_QUARTER = 0.5 * math.pi

_SPARE = 1.0 + 1e-9
"""For rounding of bounds."""


@inlined_kernel
def _rates(table, e, edge):
    """Return an element's fastest speed along an edge, how fast that changes, and its farthest."""
    degree, column = len(edge) - 1, table.columns[e]
    if table.elements[e] != TURN and table.elements[e] != SLIDE:
        return 2.0 * half_turn(edge[0], edge[degree], column)[0], 0.0, 0.0
    speed = change = far = 0.0
    m, offset = table.multipliers[e], table.offsets[e]
    for k in range(degree + 1):
        far = max(far, abs(m * edge[k, column] + offset))
        if k >= 1:
            speed = max(speed, abs(edge[k, column] - edge[k - 1, column]))
        if k >= 2:
            twice = edge[k, column] - 2.0 * edge[k - 1, column] + edge[k - 2, column]
            change = max(change, abs(twice))
    m = abs(m)
    return m * degree * speed, m * degree * (degree - 1) * change, far


@inlined_kernel
def _bend(table, c, edge):
    """Return a bound of the second derivative of a condition's state along an edge."""
    first, last = table.firsts[c], table.firsts[c + 1]
    turning = changing = bent = 0.0
    r = table.ends_p[c]
    reach = math.sqrt(r[0] * r[0] + r[1] * r[1] + r[2] * r[2])
    # From the end on: what comes before an element turns it and all after it.
    before = 0.0
    for e in range(first, last):
        if table.elements[e] != SLIDE:
            before += _rates(table, e, edge)[0]
    for e in range(last - 1, first - 1, -1):
        speed, change, far = _rates(table, e, edge)
        if table.elements[e] == SLIDE:
            reach += far
            bent += 2.0 * before * speed + change
        else:
            before -= speed
            bent += (2.0 * before * speed + speed * speed + change) * reach
            turning += speed
            changing += change
        r = table.places[e]
        reach += math.sqrt(r[0] * r[0] + r[1] * r[1] + r[2] * r[2])
    if table.kinds[c] == BETWEEN:
        return _SPARE * (turning * turning + changing)
    if table.kinds[c] == NEAR:
        return _SPARE * (0.25 * turning * turning + 0.5 * changing)
    return _SPARE * bent


@inlined_kernel
def _most(first, last, bend):
    """Return the most of what is linear on a chord, and ``4 bend s (1 - s)`` more."""
    way = abs(last - first)
    if way >= 4.0 * bend:
        return max(first, last)
    # At s = (way + 4 bend) / (8 bend) from the lower end.
    return min(first, last) + (way + 4.0 * bend) ** 2 / (16.0 * bend)


@inlined_kernel
def _beyond_cone(along, across, sine, cosine):
    """Return how far beyond a cone's surface a vector is."""
    return across * cosine - along * sine


@inlined_kernel
def _across(a, u, along):
    """Return the part of a vector across a unit vector, and its length."""
    x, y, z = u[0] - along * a[0], u[1] - along * a[1], u[2] - along * a[2]
    return (x, y, z), math.sqrt(x * x + y * y + z * z)


@inlined_kernel
def _dot(a, u):
    return a[0] * u[0] + a[1] * u[1] + a[2] * u[2]


@inlined_kernel
def _within(a, angle, u, v, bend):
    """Return how far outside of the cone about a, at most a half-space, a chord is at most."""
    sine, cosine = sine_cosine(angle)
    first, last = _dot(a, u), _dot(a, v)
    return _most(
        _beyond_cone(first, _across(a, u, first)[1], sine, cosine),
        _beyond_cone(last, _across(a, v, last)[1], sine, cosine),
        bend,
    )


@inlined_kernel
def _without(a, angle, u, v, bend):
    """Return how far inside of that cone it is at most: beyond one tangent plane."""
    sine, cosine = sine_cosine(angle)
    w = u[0] + v[0], u[1] + v[1], u[2] + v[2]
    e, size = _across(a, w, _dot(a, w))
    if not size > 0.0:
        return math.inf
    f = cosine / size
    n = f * e[0] - sine * a[0], f * e[1] - sine * a[1], f * e[2] - sine * a[2]
    return _most(-_dot(n, u), -_dot(n, v), bend)


@inlined_kernel
def _angle_excess(a, lower, upper, u, v, bend):
    """Return how far beyond bounds of its angle to a the vector is, at most, from u to v."""
    opposite = (-a[0], -a[1], -a[2])
    excess = -math.inf
    if upper < math.pi:
        if upper <= _QUARTER:
            excess = _within(a, upper, u, v, bend)
        else:
            excess = _without(opposite, math.pi - upper, u, v, bend)
    if lower > 0.0:
        if lower <= _QUARTER:
            excess = max(excess, _without(a, lower, u, v, bend))
        else:
            excess = max(excess, _within(opposite, math.pi - lower, u, v, bend))
    return excess


@inlined_kernel
def _turn_excess(bound, u, v, bend):
    """Return the same of a quaternion whose angle is bounded; in half turns."""
    if bound >= math.pi:
        return -math.inf
    sine, cosine = sine_cosine(0.5 * bound)
    sign = 1.0 if u[0] + v[0] >= 0.0 else -1.0
    across_u = math.sqrt(u[1] * u[1] + u[2] * u[2] + u[3] * u[3])
    across_v = math.sqrt(v[1] * v[1] + v[2] * v[2] + v[3] * v[3])
    return 2.0 * _most(
        _beyond_cone(sign * u[0], across_u, sine, cosine),
        _beyond_cone(sign * v[0], across_v, sine, cosine),
        bend,
    )


@inlined_kernel
def _excess(table, c, u, v, bend):
    """Return how far beyond its bounds a condition is, at most, on a stretch from u to v."""
    lower, upper = table.lower[c], table.upper[c]
    if table.kinds[c] == BETWEEN:
        a = table.targets[c]
        return _angle_excess((a[0], a[1], a[2]), lower[0], upper[0], u, v, bend)
    if table.kinds[c] == NEAR:
        return _turn_excess(upper[0], u, v, bend)
    excess = -math.inf
    for i in range(3):
        if upper[i] < math.inf:
            excess = max(excess, _most(u[i] - upper[i], v[i] - upper[i], bend))
        if lower[i] > -math.inf:
            excess = max(excess, _most(lower[i] - u[i], lower[i] - v[i], bend))
    return excess


@inlined_kernel
def _is_beyond(table, c, Q, p, slack):
    """Tell whether a condition is not held at one configuration."""
    values, _ = values_of(table, c, Q, p)
    count = 3 if table.kinds[c] == BOX else 1
    for i in range(count):
        if not table.lower[c, i] - slack <= values[i] <= table.upper[c, i] + slack:
            return True
    return False


@inlined_kernel
def _put(stack, depth, t, state):
    stack[depth, 0] = t
    for i in range(4):
        stack[depth, 1 + i] = state[i]


@inlined_kernel
def _prove(tree, table, c, edge, slack, stop, scratch):
    """Return (answer, where, looks) for one condition along one edge."""
    q, axes, origins, stack = scratch
    bend = _bend(table, c, edge)
    low, left, depth, looks = 0.0, (0.0, 0.0, 0.0, 0.0), 0, 0
    for t in (0.0, 1.0):
        point_on(tree, edge, t, q)
        Q, p = place_chain(table, c, q, axes, origins)
        if _is_beyond(table, c, Q, p, slack):
            return VIOLATED, t, looks
        state = state_of(table, c, Q, p)
        if t == 0.0:
            left = state
        else:
            _put(stack, 0, t, state)
    while depth >= 0:
        high = stack[depth, 0]
        right = stack[depth, 1], stack[depth, 2], stack[depth, 3], stack[depth, 4]
        h = high - low
        if _excess(table, c, left, right, bend * h * h / 8.0) <= slack:
            low, left = high, right
            depth -= 1
            continue
        looks += 1
        if depth + 1 >= DEPTH or looks > _LOOKS or stop[0] != 0:
            return UNDECIDED, low, looks
        middle = 0.5 * (low + high)
        point_on(tree, edge, middle, q)
        Q, p = place_chain(table, c, q, axes, origins)
        if _is_beyond(table, c, Q, p, slack):
            return VIOLATED, middle, looks
        depth += 1
        _put(stack, depth, middle, state_of(table, c, Q, p))
    return HELD, 1.0, looks


@lean_kernel
def prove_constraints(tree, table, edges, part, stop, answers, found, where, scratch):
    """Prove conditions along edges ``(n, m, nq)``, of two or more control points.

    ``part`` is the share of the rounding that is used up. Writes an answer of each edge, the
    condition that is not held or proven, and where from 0 to 1: up to there it is proven, or there
    it is violated. ``scratch`` are arrays ``(nq,)``, ``(e, 3, 3)``, ``(e, 3)``, ``(DEPTH, 5)``.
    """
    for row in range(len(edges)):
        answers[row], found[row], where[row] = HELD, -1, 1.0
        for c in range(len(table.kinds)):
            slack = part * table.rounding[c]
            answer, t, _ = _prove(tree, table, c, edges[row], slack, stop, scratch)
            if answer == HELD or answers[row] == VIOLATED:
                continue
            if answer == VIOLATED or answers[row] == HELD:
                answers[row], found[row], where[row] = answer, c, t
        if stop[0] != 0:
            for rest in range(row, len(edges)):
                answers[rest], found[rest], where[rest] = UNDECIDED, 0, 0.0
            return
