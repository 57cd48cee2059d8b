"""The fastest way along a path under limits of velocity, acceleration and jerk, compiled.

A path p(u) is followed with the squared rate b(u) = (du/dt)^2, so velocity, acceleration and
jerk are ``p' sqrt(b)``, ``p' b'/2 + p'' b`` and ``sqrt(b) (p' b''/2 + 3/2 p'' b' + p''' b)``.
The first two limits are convex in b, and the third is where 1 / sqrt(b) is replaced by its
tangent, which is below it (Debrouwere and others, *Time-Optimal Path Following for Robots With
Convex-Concave Constraints Using Sequential Convex Programming*, 2013). Here b is a cubic spline
over evenly spaced nodes, and a barrier method takes one Newton step for each tangent: all
iterates are within all limits (Boyd and Vandenberghe, *Convex Optimization*, 2004, section 11.3).
The Hessian is a band of seven diagonals, so that a step's time grows with the number of nodes.
"""

import math
from typing import NamedTuple

import numpy as np

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, kernel

__all__ = ["Rows", "fastest_rates"]

_STEPS = 250
"""Newton's, at most, of all barriers together."""

_LESS = 0.12
"""By how much the weight of each barrier is less than that of the one before."""

_NEAR = 0.3
"""Newton's decrement by which a barrier is solved well enough for the next one, per weight."""

_BACK = 0.6
"""What a step that leaves the limits, or is no better, is multiplied with."""

_SHORTEST = 1e-6
"""Steps that are so much shortened are none."""

_ROOM = 1.02
"""Times what the limits are exceeded by at first: how much wider they are until they are kept."""

_ENOUGH = 0.01
"""Of the decrement: by how much a step has to make the merit less."""

_STUCK = 1e-3
"""Relative: where limits get narrower by less in a step, they can't be kept."""

_TINY = 1e-280
"""Products of slacks that are smaller are worked out by logarithms."""

_PINNED = 1e7
"""Weight of what must not change, relative to the Hessian."""


class Rows(NamedTuple):
    """The bounds of b at m points, of j joints: each number in units of its limit."""

    caps: np.ndarray
    """``(m,)``: the largest b by the limits of velocity."""
    a1: np.ndarray
    """``(j, m)``: the acceleration is ``a1 b' + a0 b``."""
    a0: np.ndarray
    j2: np.ndarray
    """``(j, m)``: the jerk is ``sqrt(b) (j2 b'' + j1 b' + j0 b)``."""
    j1: np.ndarray
    j0: np.ndarray


@inlined_kernel
def _at_points(c, x):
    """Write b, b' and b'' at the nodes and in the middles between, ``(3, 2 n - 1)``.

    They are those of a cubic spline with coefficients ``(n + 2,)``.
    """
    for k in range(x.shape[1]):
        i = k // 2
        if k % 2 == 0:
            x[0, k] = (c[i] + 4.0 * c[i + 1] + c[i + 2]) / 6.0
            x[1, k] = 0.5 * (c[i + 2] - c[i])
            x[2, k] = c[i] - 2.0 * c[i + 1] + c[i + 2]
        else:
            outer, inner = c[i] + c[i + 3], c[i + 1] + c[i + 2]
            x[0, k] = (outer + 23.0 * inner) / 48.0
            x[1, k] = 0.125 * (c[i + 3] - c[i] + 5.0 * (c[i + 2] - c[i + 1]))
            x[2, k] = 0.5 * (outer - inner)


@inlined_kernel
def _largest(rows, x):
    """Return the largest of all limits' shares ; each as of a rate.

    That is v / V, sqrt(a / A) and cbrt(j / J): times so much slower, all limits are just kept.
    """
    most = 0.0
    joints = rows.a1.shape[0]
    for k in range(x.shape[1]):
        b = x[0, k]
        if not b > 0.0:
            return math.inf
        root = math.sqrt(b)
        most = max(most, math.sqrt(b / rows.caps[k]))
        a, jerk = 0.0, 0.0
        for j in range(joints):
            a = max(a, abs(rows.a1[j, k] * x[1, k] + rows.a0[j, k] * b))
            jerk = max(
                jerk,
                abs(rows.j2[j, k] * x[2, k] + rows.j1[j, k] * x[1, k] + rows.j0[j, k] * b),
            )
        most = max(most, math.sqrt(a), (jerk * root) ** (1.0 / 3.0))
    return most


@inlined_kernel
def _log_of_slacks(rows, x, k, wide):
    """Return the logarithm of the product of all slacks at a point, one after another."""
    b, db, ddb = x[0, k], x[1, k], x[2, k]
    a, z = wide * wide, wide * wide * wide / math.sqrt(b)
    total = math.log((a * rows.caps[k] - b) / rows.caps[k])
    for j in range(rows.a1.shape[0]):
        r = rows.a1[j, k] * db + rows.a0[j, k] * b
        q = rows.j2[j, k] * ddb + rows.j1[j, k] * db + rows.j0[j, k] * b
        total += math.log((a - r) * (a + r)) + math.log((z - q) * (z + q))
    return total


@inlined_kernel
def _merit(rows, x, mu, wide, work):
    """Return the duration and the barrier; infinite where a limit is not kept.

    ``work`` ``(3, n)`` are inverse rates, products of slacks, and the least of these.
    """
    joints, n = rows.a1.shape[0], x.shape[1]
    z, product, least = work[0], work[1], work[2]
    a, jerk = wide * wide, wide * wide * wide
    for k in range(n):
        b = x[0, k]
        z[k] = 1.0 / math.sqrt(b)
        product[k] = (a * rows.caps[k] - b) / rows.caps[k]
        least[k] = product[k] if b > 0.0 else -1.0
    # Loops without branches over neighbours in memory: they become vector instructions.
    for j in range(joints):
        for k in range(n):
            b, db = x[0, k], x[1, k]
            r = rows.a1[j, k] * db + rows.a0[j, k] * b
            q = rows.j2[j, k] * x[2, k] + rows.j1[j, k] * db + rows.j0[j, k] * b
            most = jerk * z[k]
            t, y = a * a - r * r, most * most - q * q
            product[k] *= t * y
            least[k] = min(least[k], min(t, y))
    total = -0.5 * (z[0] + z[n - 1])
    for k in range(n):
        if not (least[k] > 0.0 and product[k] >= 0.0):
            return math.inf
        if _TINY < product[k] < 1.0 / _TINY:
            logarithm = math.log(product[k])
        else:
            logarithm = _log_of_slacks(rows, x, k, wide)
        total += z[k] - mu * logarithm
    return total


@inlined_kernel
def _model(rows, x, mu, wide, g, h):
    """Write gradients ``(3, n)`` and convex Hessians ``(6, n)`` of the merit, by b, b' and b''."""
    joints, n = rows.a1.shape[0], x.shape[1]
    v, a, jerk = wide * wide, wide * wide, wide * wide * wide
    for k in range(n):
        b = x[0, k]
        z = 1.0 / math.sqrt(b)
        w = 0.5 if k == 0 or k == n - 1 else 1.0
        g[0, k], g[1, k], g[2, k] = -0.5 * w * z / b, 0.0, 0.0
        h[0, k] = 0.75 * w * z / (b * b)
        for i in range(1, 6):
            h[i, k] = 0.0
        one = 1.0 / (v * rows.caps[k] - b)
        g[0, k] += mu * one
        h[0, k] += mu * one * one
    for j in range(joints):
        for k in range(n):
            b, db, ddb = x[0, k], x[1, k], x[2, k]
            c1, c0 = rows.a1[j, k], rows.a0[j, k]
            r = c1 * db + c0 * b
            over = 1.0 / (a * a - r * r)
            d1, d2 = 2.0 * mu * r * over, 2.0 * mu * (a * a + r * r) * over * over
            g0, g1, h0, h1, h3 = d1 * c0, d1 * c1, d2 * c0 * c0, d2 * c0 * c1, d2 * c1 * c1
            c2, c1, c0 = rows.j2[j, k], rows.j1[j, k], rows.j0[j, k]
            r = c2 * ddb + c1 * db + c0 * b
            # With z = jerk / sqrt(b): of z^2 - r^2 and of what it changes by.
            squared = jerk * jerk / b
            over = 1.0 / (squared - r * r)
            d1, d2 = 2.0 * mu * r * over, 2.0 * mu * (squared + r * r) * over * over
            slope = -0.5 * squared / b  # z z'
            cross = -4.0 * mu * r * over * over * slope
            g[0, k] += g0 + d1 * c0 - 2.0 * mu * over * slope
            g[1, k] += g1 + d1 * c1
            g[2, k] += d1 * c2
            h[0, k] += h0 + d2 * (c0 * c0 + 0.25 * squared / (b * b)) + 2.0 * cross * c0
            h[1, k] += h1 + d2 * c0 * c1 + cross * c1
            h[2, k] += d2 * c0 * c2 + cross * c2
            h[3, k] += h3 + d2 * c1 * c1
            h[4, k] += d2 * c1 * c2
            h[5, k] += d2 * c2 * c2


@inlined_kernel
def _assemble(g, h, pinned, slope, band):
    """Write four diagonals of the Hessian by coefficients ``(n + 2,)``, and minus the gradient."""
    m = band.shape[1]
    band[:, :] = 0.0
    for k in range(g.shape[1]):
        i = k // 2
        g0, g1, g2 = g[0, k], g[1, k], g[2, k]
        h00, h01, h02, h11, h12, h22 = h[0, k], h[1, k], h[2, k], h[3, k], h[4, k], h[5, k]
        last = 3 if k % 2 == 0 else 4
        for p in range(last):
            w0, w1, w2 = _weights(k % 2, p)
            band[4, i + p] -= w0 * g0 + w1 * g1 + w2 * g2
            y0 = w0 * h00 + w1 * h01 + w2 * h02
            y1 = w0 * h01 + w1 * h11 + w2 * h12
            y2 = w0 * h02 + w1 * h12 + w2 * h22
            for q in range(p, last):
                v0, v1, v2 = _weights(k % 2, q)
                band[q - p, i + p] += v0 * y0 + v1 * y1 + v2 * y2
    for end in range(2):
        at = 0 if end == 0 else m - 3
        weight = _PINNED * max(band[0, at], band[0, at + 1], band[0, at + 2])
        if pinned[end]:
            band[0, at] += weight
            band[0, at + 1] += weight * 16.0
            band[0, at + 2] += weight
            band[1, at] += weight * 4.0
            band[1, at + 1] += weight * 4.0
            band[2, at] += weight
        if slope[end]:
            band[0, at] += weight
            band[0, at + 2] += weight
            band[2, at] -= weight


@inlined_kernel
def _weights(is_middle, p):
    """Return a coefficient's weights for b, b' and b'' at a node, or in a middle."""
    if is_middle == 0:
        if p == 0:
            return 1.0 / 6.0, -0.5, 1.0
        if p == 1:
            return 4.0 / 6.0, 0.0, -2.0
        return 1.0 / 6.0, 0.5, 1.0
    if p == 0:
        return 1.0 / 48.0, -0.125, 0.5
    if p == 1:
        return 23.0 / 48.0, -0.625, -0.5
    if p == 2:
        return 23.0 / 48.0, 0.625, -0.5
    return 1.0 / 48.0, 0.125, 0.5


@inlined_kernel
def _solve(band):
    """Solve the system in place, by L D L^T: the solution is where the right side was, row 4."""
    m = band.shape[1]
    y = band[4]
    for k in range(m):
        reach = min(3, m - 1 - k)
        for p in range(1, reach + 1):
            share = band[p, k] / band[0, k]
            for q in range(p, reach + 1):
                band[q - p, k + p] -= share * band[q, k]
            y[k + p] -= share * y[k]
    for k in range(m - 1, -1, -1):
        for p in range(1, min(3, m - 1 - k) + 1):
            y[k] -= band[p, k] * y[k + p]
        y[k] /= band[0, k]


@inlined_kernel
def _step(rows, c, x, wide, mu, pinned, slope, work):
    """Go a step of Newton's; return its decrement, 0 where no part of it makes anything better."""
    m, n = len(c), x.shape[1]
    g, h, band, trial, new, own = work
    before = _merit(rows, x, mu, wide, own)
    _model(rows, x, mu, wide, g, h)
    _assemble(g, h, pinned, slope, band)
    for k in range(m):
        trial[k] = band[4, k]
    _solve(band)
    decrement = 0.0
    for k in range(m):
        decrement += trial[k] * band[4, k]
    size = 1.0
    while size > _SHORTEST:
        for k in range(m):
            trial[k] = c[k] + size * band[4, k]
        _at_points(trial, new)
        if _merit(rows, new, mu, wide, own) <= before - _ENOUGH * size * decrement:
            for k in range(m):
                c[k] = trial[k]
            for i in range(3):
                for k in range(n):
                    x[i, k] = new[i, k]
            return decrement
        size *= _BACK
    return 0.0


@inlined_kernel
def _begin(rows, c, x, can_scale):
    """Begin within the limits; return their factor until they are kept."""
    _at_points(c, x)
    wide = _largest(rows, x)
    if not can_scale:
        return 1.0 if wide < 1.0 else _ROOM * wide
    # All of it slower, or faster: the square of a rate.
    for k in range(len(c)):
        c[k] /= (_ROOM * wide) ** 2
    _at_points(c, x)
    return 1.0


@kernel
def fastest_rates(rows, c, pinned, slope, first_weight, last_weight):
    """Change a spline's coefficients ``(n + 2,)`` to those of about the least duration.

    The rows are of n nodes, a unit of u apart, and the middles between them. ``pinned`` ``(2,)``
    says whether b must stay the same at the first and last node, ``slope`` whether b' must. The
    last weight of the barrier costs about as much of the duration, as about one limit is active at
    a node. Return the factor by which a motion is too fast for the limits: 1 where it is not.
    """
    m = len(c)
    n = 2 * (m - 2) - 1
    x = np.empty((3, n))
    g, new, own = np.empty((3, n)), np.empty((3, n)), np.empty((3, n))
    work = (g, np.empty((6, n)), np.empty((5, m)), np.empty(m), new, own)
    wide = _begin(rows, c, x, not (pinned[0] or pinned[1]))
    mu = first_weight
    for _ in range(_STEPS):
        decrement = _step(rows, c, x, wide, mu, pinned, slope, work)
        is_near = decrement < _NEAR * mu * n
        if wide > 1.0:
            least = _largest(rows, x)
            narrower = 1.0 if least < 1.0 else min(wide, _ROOM * least)
            if decrement == 0.0 or (wide - narrower < _STUCK * wide and is_near):
                break
            wide = narrower
        elif is_near:
            if mu <= last_weight:
                break
            mu = max(_LESS * mu, last_weight)
    return max(1.0, _largest(rows, x))
