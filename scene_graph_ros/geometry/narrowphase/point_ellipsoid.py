"""Signed distance from a point to an ellipsoid, exact to rounding, also for needles and plates.

With the semi-axes sorted, e0 >= e1 >= e2, the nearest point of y (in the first octant) is
x_i = e_i^2 y_i / (t + e_i^2), where t is the largest root of sum_i (e_i y_i / (t + e_i^2))^2 = 1
(Eberly, "Distance from a Point to an Ellipse, an Ellipsoid, or a Hyperellipsoid", 2013, eq. 26).
Two changes keep every digit. The unknown is sigma = (t + e_m^2) / e_m^2, the distance from the
pole of the shortest axis m in which y is not zero, so no denominator cancels. And the equation is
solved as 1/|q(sigma)| = 1, whose left side is increasing and concave, so that Newton's steps from
below converge monotonically (Conn, Gould, Toint, "Trust-Region Methods", 2000, section 7.3.3).

Nearly all points are answered before that by Halley's method for |q|^2 = 1, of third order, which
takes one division a step and no root (Gander, "On Halley's Iteration Method", American
Mathematical Monthly 92, 1985).
"""

import math

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, kernel
from scene_graph_ros.geometry.compiled.lanes import larger, magnitude, root, select
from scene_graph_ros.geometry.tolerances import COINCIDENCE, UNDERFLOW

__all__ = ["HALLEY_STEPS", "point_ellipsoid"]

HALLEY_STEPS = 6
"""Newton's method takes over where so many have not led to the root."""
_MAX_BISECTIONS = 16
_MAX_NEWTON_STEPS = 40

_LAST_STEP = 1e-8
"""Relative to sigma. With w_i = 1 / (sigma + d_i) <= 1 / sigma, the second derivative of 1 / |q|
relative to the first is -3 Var(w) / E(w), in magnitude at most 3 / sigma: a step leaves an error
of at most 1.5 times its square, relative to sigma, so that after this one it is rounding."""

_LAST_HALLEY_STEP = 4e-6
"""Relative to sigma. With S_k = sum_i q_i^2 w_i^(k-2) <= S_(k-1) / sigma, a step of Halley's
leaves an error of (9 S_4^2 - 8 S_3 S_5) / (4 S_3^2) times its third power, at most 2 / sigma^2
times that: relative to sigma, rounding."""

_FAR = 1e16
"""Sums of sigma and d up to this have products that do not overflow in Halley's method."""


@inlined_kernel
def _pick(v, i):
    return v[0] if i == 0 else (v[1] if i == 1 else v[2])


@inlined_kernel
def _sort_axes(size):
    """Return the axes from the longest to the shortest; of equal ones, the later comes first."""
    swap = size[1] > size[2]
    i, j, long, middle = (
        1 if swap else 2,
        2 if swap else 1,
        size[1] if swap else size[2],
        size[2] if swap else size[1],
    )
    swap = size[0] > middle
    j, k, middle = 0 if swap else j, j if swap else 0, size[0] if swap else middle
    swap = middle > long
    return j if swap else i, i if swap else j, k


@inlined_kernel
def _excess(e, shortest):
    """Return (e / shortest)^2 - 1 without cancellation."""
    return ((e - shortest) / shortest) * ((e + shortest) / shortest)


@kernel
def _pole_sum(z, e, pole):
    """Return sum_i (r_i z_i / (r_i - 1))^2 over the axes longer than e[pole], r = (e/e_pole)^2."""
    total = 0.0
    for i in range(pole):
        if z[i] > 0.0:
            d = _excess(e[i], e[pole])
            total += ((1.0 + d) * z[i] / d) ** 2 if d > 0.0 else math.inf
    return total


@inlined_kernel
def bracket(c, d):
    """Return bounds (low, high) of the root of ``_solve``."""
    high = root(c[0] * c[0] + c[1] * c[1] + c[2] * c[2])
    return larger(larger(c[0] - d[0], c[1] - d[1]), c[2]), high


@inlined_kernel
def is_tight(low, high):
    """Tell whether Newton's steps converge fast from these bounds."""
    return high <= 4.0 * low


@inlined_kernel
def first_sigma(c, d, low, high):
    """Return the start of Newton's method."""
    # From below they are monotone, from above the first one leads below.
    far = high - (c[0] * c[0] * d[0] + c[1] * c[1] * d[1]) / (high * high)
    return larger(low, far)


@inlined_kernel
def _inverses(d, sigma):
    """Return 1 / (sigma + d_i) by one division, which takes as long as all else of a step."""
    a, b, g = sigma + d[0], sigma + d[1], sigma
    inverse = 1.0 / (a * b * g)
    return b * g * inverse, a * g * inverse, a * b * inverse


@inlined_kernel
def is_halley_fast(d, low, high):
    """Tell whether Halley's steps probably converge from these bounds, and do not overflow."""
    return is_tight(low, high) & (high + d[0] <= _FAR)


@inlined_kernel
def halley_step(c, d, sigma):
    """Return the step from sigma towards the root of ``_solve``.

    With q_i = c_i w_i and S_k = sum_i q_i^2 w_i^(k-2) it is
    2 (S_2 - 1) S_3 / (4 S_3^2 - 3 (S_2 - 1) S_4); the sums are multiplied by powers of the
    product of all sigma + d_i, so that nothing is divided but the step itself.
    """
    a, b = sigma + d[0], sigma + d[1]
    bg, ag, ab = b * sigma, a * sigma, a * b
    product = ab * sigma
    qa, qb, qg = c[0] * bg, c[1] * ag, c[2] * ab
    qa, qb, qg = qa * qa, qb * qb, qg * qg
    excess = qa + qb + qg - product * product
    qa, qb, qg = qa * bg, qb * ag, qg * ab
    third, fourth = qa + qb + qg, qa * bg + qb * ag + qg * ab
    return (excess + excess) * third * product / (4.0 * third * third - 3.0 * excess * fourth)


@inlined_kernel
def is_halley_done(step, sigma):
    """Tell whether after this step to sigma only rounding is left."""
    return magnitude(step) <= _LAST_HALLEY_STEP * sigma


@kernel
def _by_halley(c, d):
    """Return (sigma, is_found): the root of ``_solve`` where c[2] > 0, if it is found fast."""
    low, high = bracket(c, d)
    sigma = first_sigma(c, d, low, high)
    if is_halley_fast(d, low, high):
        for _ in range(HALLEY_STEPS):
            step = halley_step(c, d, sigma)
            sigma += step
            if is_halley_done(step, sigma):
                return sigma, True
    return sigma, False


@inlined_kernel
def _newton_step(c, d, sigma):
    """Return the step from sigma towards the root of ``_solve``."""
    wa, wb, wg = _inverses(d, sigma)
    a, b, g = c[0] * wa, c[1] * wb, c[2] * wg
    square = a * a + b * b + g * g
    slope = a * a * wa + b * b * wb + g * g * wg
    return square * (root(square) - 1.0) / slope


@kernel
def _solve(c, d):
    """Return the root sigma > 0 of sum_i (c_i / (sigma + d_i))^2 = 1.

    ``d`` are the first two of them, the last is 0; where d[m] = 0, c[m] > 0.
    """
    low, high = bracket(c, d)
    for _ in range(_MAX_BISECTIONS):
        if is_tight(low, high):
            break
        middle = math.sqrt(low) * math.sqrt(high)
        a, b, g = c[0] / (middle + d[0]), c[1] / (middle + d[1]), c[2] / middle
        if a * a + b * b + g * g >= 1.0:
            low = middle
        else:
            high = middle
    sigma = first_sigma(c, d, low, high)
    for _ in range(_MAX_NEWTON_STEPS):
        step = _newton_step(c, d, sigma)
        sigma += step
        if abs(step) <= _LAST_STEP * sigma:
            break
    return sigma


@kernel
def _nearest_sorted(e, y, tolerance):
    """Return (t, q, unique): x_i = e_i q_i is nearest to y >= 0, for sorted semi-axes e."""
    z = (y[0] / e[0], y[1] / e[1], y[2] / e[2])
    if y[2] <= tolerance:
        # On the plane of symmetry across the shortest axis: two mirror images may be nearest.
        snapped = (
            0.0 if y[0] <= tolerance else z[0],
            0.0 if y[1] <= tolerance else z[1],
            0.0,
        )
        total = _pole_sum(snapped, e, 2)
        if total < 1.0:
            q = (
                snapped[0] * (1.0 + 1.0 / _excess(e[0], e[2])) if snapped[0] > 0.0 else 0.0,
                snapped[1] * (1.0 + 1.0 / _excess(e[1], e[2])) if snapped[1] > 0.0 else 0.0,
                math.sqrt(1.0 - total),
            )
            return -e[2] * e[2], q, False
    m = 2
    if z[2] == 0.0:
        m = 1 if z[1] > 0.0 else 0
    d0, d1 = _excess(e[0], e[m]), _excess(e[1], e[m]) if m > 0 else 0.0
    c = (
        (1.0 + d0) * z[0],
        (1.0 + d1) * z[1] if m > 0 else 0.0,
        z[2] if m == 2 else 0.0,
    )
    sigma = _solve(c, (d0, d1))
    q = (c[0] / (sigma + d0), c[1] / (sigma + d1), c[2] / sigma)
    return (sigma - 1.0) * e[m] * e[m], q, True


@inlined_kernel
def sorted_axes(size):
    """Return (i, j, k, e, d, s, r): all that does not depend on the point.

    ``e`` are the semi-axes sorted, of axes i, j, k, and ``d`` those of ``_solve``; a point's
    distances from the planes of symmetry times ``s`` are its c. ``r`` are e[2] / e[0], e[2] / e[1]
    and 1 / e[2].
    """
    i, j, k = _sort_axes(size)
    e = (_pick(size, i), _pick(size, j), _pick(size, k))
    d = (_excess(e[0], e[2]), _excess(e[1], e[2]))
    inverse = 1.0 / e[2]
    s = ((1.0 + d[0]) / e[0], (1.0 + d[1]) / e[1], inverse)
    return i, j, k, e, d, s, (e[2] / e[0], e[2] / e[1], inverse)


@inlined_kernel
def set_up(axes, p_GQ):
    """Return (y, c, is_plain) of point Q and ``sorted_axes``.

    ``y`` are the point's distances from the planes of symmetry across the axes, and ``c`` that of
    ``_solve``, unless Q is on the plane across the shortest axis: then ``is_plain`` is False.
    """
    i, j, k, e, _, s, _ = axes
    least = UNDERFLOW * e[0]
    y0, y1 = magnitude(_pick(p_GQ, i)), magnitude(_pick(p_GQ, j))
    y2 = magnitude(_pick(p_GQ, k))
    y = (select(y0 > least, y0, 0.0), select(y1 > least, y1, 0.0), select(y2 > least, y2, 0.0))
    return y, (s[0] * y[0], s[1] * y[1], s[2] * y[2]), y2 > COINCIDENCE * e[0]


@inlined_kernel
def _place(axes, p_GQ, t, q, unique):
    """Return (phi, p_GN, grad_G, unique), given the answer of ``_nearest_sorted``."""
    i, j, k, e, _, _, r = axes
    # 1 / |q| to rounding, as q is a unit vector but for rounding.
    shrink = 1.5 - 0.5 * (q[0] * q[0] + q[1] * q[1] + q[2] * q[2])
    q = (q[0] * shrink, q[1] * shrink, q[2] * shrink)
    # The normal is x_i / e_i^2 = q_i / e_i; times e2 it neither overflows nor vanishes.
    n = (q[0] * r[0], q[1] * r[1], q[2])
    steepness = root(n[0] * n[0] + n[1] * n[1] + n[2] * n[2])
    phi = t * r[2] * steepness
    tolerance = COINCIDENCE * e[0]
    p0, p1, p2 = _pick(p_GQ, i), _pick(p_GQ, j), _pick(p_GQ, k)
    s0, s1 = select(p0 < -tolerance, -1.0, 1.0), select(p1 < -tolerance, -1.0, 1.0)
    s2 = select(p2 < (0.0 if unique else -tolerance), -1.0, 1.0)
    x = (s0 * e[0] * q[0], s1 * e[1] * q[1], s2 * e[2] * q[2])
    inverse = 1.0 / steepness
    g = (s0 * n[0] * inverse, s1 * n[1] * inverse, s2 * n[2] * inverse)
    return phi, _unsort(x, i, j), _unsort(g, i, j), unique


@inlined_kernel
def place_plain(axes, p_GQ, c, sigma):
    """Return (phi, p_GN, grad_G, unique), given the answers of ``set_up`` and ``_solve``."""
    _, _, _, e, d, _, _ = axes
    wa, wb, wg = _inverses(d, sigma)
    q = (c[0] * wa, c[1] * wb, c[2] * wg)
    return _place(axes, p_GQ, (sigma - 1.0) * e[2] * e[2], q, True)


@kernel
def point_ellipsoid(size, p_GQ):
    """Return (phi, p_GN, grad_G, unique) of point Q; ``size`` holds the semi-axes (a, b, c).

    Where mirror images are equally near (inside, on a plane of symmetry, closer to the centre
    than the focal curve), the one on the positive side of the shortest axis is chosen (of equal
    axes, the first), and ``unique`` is False.
    """
    axes = sorted_axes(size)
    y, c, is_plain = set_up(axes, p_GQ)
    e, d = axes[3], axes[4]
    if is_plain:
        sigma, is_found = _by_halley(c, d)
        return place_plain(axes, p_GQ, c, sigma if is_found else _solve(c, d))
    t, q, unique = _nearest_sorted(e, y, COINCIDENCE * e[0])
    return _place(axes, p_GQ, t, q, unique)


@inlined_kernel
def _unsort(v, i, j):
    """Put the first entry of v at i, the second at j, and the third at the remaining place."""
    return (
        v[0] if i == 0 else (v[1] if j == 0 else v[2]),
        v[0] if i == 1 else (v[1] if j == 1 else v[2]),
        v[0] if i == 2 else (v[1] if j == 2 else v[2]),
    )
