"""The fastest cubic spline in time within limits and half-spaces, compiled.

A uniform cubic B-spline with knots ``u`` seconds apart is a motion whose jerk is constant between
two knots. Its rates are bounded by the differences of its control points c: ``|D c| <= V u``,
``|D^2 c| <= A u^2`` and ``|D^3 c| <= J u^3``; the last two bounds are exact. A barrier method
changes c and u at once, so that u becomes least (Boyd and Vandenberghe, *Convex Optimization*,
2004, section 11.3). All iterates are within all bounds. The negative curvature in u of bounds of
order p is left out of the Hessian, which is a band of 4 k - 1 diagonals for k positions,
bordered by u.
"""

import math
from typing import NamedTuple

import numpy as np

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, kernel
from scene_graph_ros.geometry.compiled.lanes import LANES, load_lanes, store_lanes
from scene_graph_ros.planning.motion.band_kernels import solve_band

__all__ = ["HalfSpaces", "fastest_spline"]

_STEPS = 120
"""Newton's, at most."""

_NEAR = 0.5
"""Squared Newton's decrement by which the barrier's minimum is near enough."""

_BACK = 0.5
"""What a step that leaves the bounds, or is no better, is multiplied with."""

_SHORTEST = 1e-4
"""Steps that are so much shortened are none."""

_ENOUGH = 0.01
"""Of the decrement: by how much a step has to make the merit less."""

_FIXED = 3
"""Control points at each end, which positions, velocities and accelerations there say."""


class HalfSpaces(NamedTuple):
    """Half-spaces at n places on a spline, m: ``normals q + offsets > 0``."""

    spans: np.ndarray
    """``(n,)``: between which knots the place is."""
    weights: np.ndarray
    """``(n, 4)``: how much each of four control points counts there."""
    ends: np.ndarray
    """``(n,)``: where the place's rows end, those of one place after those of the one before."""
    normals: np.ndarray
    """``(m, k)``."""
    offsets: np.ndarray
    """``(m,)``."""


class _Scratch(NamedTuple):
    """Numbers of one place."""

    q: np.ndarray
    """``(k,)``."""
    normal: np.ndarray
    """``(w,)``, and 0 from k on: w is a multiple of the lanes' width."""
    slope: np.ndarray
    """``(w,)``."""
    bend: np.ndarray
    """``(k, w)``."""
    whole: np.ndarray
    """``(k, 4 k + LANES)``: ``bend``, by the weights of four control points, and then 0."""


@inlined_kernel
def _place_ends(ends, u, c, changes):
    """Write the control points at both ends, and how u changes them ``(6, k)``."""
    for side in range(2):
        first = 0 if side == 0 else len(c) - _FIXED
        for j in range(c.shape[1]):
            q, v, a = ends[side, 0, j], ends[side, 1, j], ends[side, 2, j]
            c[first, j] = q - v * u + a * u * u / 3.0
            c[first + 1, j] = q - a * u * u / 6.0
            c[first + 2, j] = q + v * u + a * u * u / 3.0
            changes[3 * side, j] = -v + 2.0 * a * u / 3.0
            changes[3 * side + 1, j] = -a * u / 3.0
            changes[3 * side + 2, j] = v + 2.0 * a * u / 3.0


@inlined_kernel
def _coefficient(order, at):
    """Return the factor of a control point in a difference of an order."""
    if order == 1:
        return -1.0 if at == 0 else 1.0
    if order == 2:
        return -2.0 if at == 1 else 1.0
    if at == 0:
        return -1.0
    if at == 1:
        return 3.0
    return -3.0 if at == 2 else 1.0


@inlined_kernel
def _difference(c, i, j, order):
    """Return a difference of control points, of order 1 to 3."""
    if order == 1:
        return c[i + 1, j] - c[i, j]
    if order == 2:
        return c[i, j] - 2.0 * c[i + 1, j] + c[i + 2, j]
    return c[i + 3, j] - c[i, j] + 3.0 * (c[i + 1, j] - c[i + 2, j])


@inlined_kernel
def _change(changes, count, i, j, order):
    """Return the derivative of a difference by u: only points at the ends depend on it."""
    total = 0.0
    for at in range(order + 1):
        row = i + at
        if row < _FIXED:
            total += _coefficient(order, at) * changes[row, j]
        elif row >= count - _FIXED:
            total += _coefficient(order, at) * changes[row - count + 2 * _FIXED, j]
    return total


@inlined_kernel
def _barrier_of_limits(limits, c, u, scale):
    """Return the barrier of the limits; infinite where one is not kept."""
    count, k = c.shape
    total, product = 0.0, 1.0
    for order in range(1, len(limits) + 1):
        for j in range(k):
            most, size = limits[order - 1, j] * u**order, limits[order - 1, j] * scale**order
            inverse = 1.0 / (size * size)
            for i in range(_FIXED - order, count - _FIXED):
                x = _difference(c, i, j, order)
                left = (most - x) * (most + x) * inverse
                if not left > 0.0:
                    return math.inf
                product *= left
                if product < 1e-200 or product > 1e200:
                    total -= math.log(product)
                    product = 1.0
    return total - math.log(product)


@inlined_kernel
def _barrier_of_box(low, high, c):
    """Return the barrier of the box around each control point; infinite outside of one."""
    total, product = 0.0, 1.0
    for i in range(len(low)):
        for j in range(c.shape[1]):
            x = c[i + _FIXED, j]
            if not low[i, j] < x < high[i, j]:
                return math.inf
            product *= (x - low[i, j]) * (high[i, j] - x)
            if product < 1e-200:
                total -= math.log(product)
                product = 1.0
    return total - math.log(product)


@inlined_kernel
def _position(rows, n, c, j):
    """Return a position at a place."""
    first, weights = rows.spans[n], rows.weights
    total = weights[n, 0] * c[first, j] + weights[n, 1] * c[first + 1, j]
    return total + weights[n, 2] * c[first + 2, j] + weights[n, 3] * c[first + 3, j]


@inlined_kernel
def _barrier_of_half_spaces(rows, c, q):
    """Return the barrier of the half-spaces; infinite outside of one. ``q`` is scratch."""
    total, product, m = 0.0, 1.0, 0
    for n in range(len(rows.spans)):
        if m == rows.ends[n]:
            continue
        for j in range(len(q)):
            q[j] = _position(rows, n, c, j)
        while m < rows.ends[n]:
            left = rows.offsets[m]
            for j in range(len(q)):
                left += rows.normals[m, j] * q[j]
            if not left > 0.0:
                return math.inf
            product *= left
            if product < 1e-200 or product > 1e200:
                total -= math.log(product)
                product = 1.0
            m += 1
    return total - math.log(product)


@inlined_kernel
def _merit(limits, low, high, rows, c, u, scale, weight, q):
    """Return the weighted u and the barriers; infinite where a bound is not kept."""
    total = weight * u + _barrier_of_limits(limits, c, u, scale)
    if total < math.inf:
        total += _barrier_of_box(low, high, c)
    if total < math.inf:
        total += _barrier_of_half_spaces(rows, c, q)
    return total


@inlined_kernel
def _add_limits(limits, c, changes, u, band, right):
    """Add derivatives of the limits' barrier; return those of u."""
    count, k = c.shape
    free, slope, bend = count - 2 * _FIXED, 0.0, 0.0
    for order in range(1, len(limits) + 1):
        for j in range(k):
            most = limits[order - 1, j] * u**order
            rate = order * most / u
            for i in range(_FIXED - order, count - _FIXED):
                x = _difference(c, i, j, order)
                own = 0.0
                if i < _FIXED or i + order >= count - _FIXED:
                    own = _change(changes, count, i, j, order)
                below, above = 1.0 / (most - x), 1.0 / (most + x)
                more, less = rate - own, rate + own
                slope -= more * below + less * above
                bend += (more * below) ** 2 + (less * above) ** 2
                first, cross = below - above, less * above * above - more * below * below
                second = below * below + above * above
                for at in range(max(0, _FIXED - i), min(order + 1, free + _FIXED - i)):
                    row, share = i + at - _FIXED, _coefficient(order, at)
                    right[0, row * k + j] += share * first
                    right[1, row * k + j] += share * cross
                    share *= second
                    for to in range(at, min(order + 1, free + _FIXED - i)):
                        band[row * k + j, (to - at) * k] += share * _coefficient(order, to)
    return slope, bend


@inlined_kernel
def _add_box(low, high, c, band, right):
    """Add derivatives of the box's barrier."""
    k = c.shape[1]
    for i in range(len(low)):
        for j in range(k):
            x, n = c[i + _FIXED, j], i * k + j
            above, below = 1.0 / (x - low[i, j]), 1.0 / (high[i, j] - x)
            right[0, n] += below - above
            band[n, 0] += above * above + below * below


@inlined_kernel
def _add_outer(normal, share, square, slope, bend):
    """Add a half-space's part to the derivatives by q of its place's barrier."""
    wide = len(normal)
    for i in range(0, wide, LANES):
        store_lanes(slope, i, load_lanes(slope, i) - share * load_lanes(normal, i))
    for j in range(len(bend)):
        own = square * normal[j]
        for i in range(0, wide, LANES):
            at = j * wide + i
            store_lanes(bend, at, load_lanes(bend, at) + own * load_lanes(normal, i))


@inlined_kernel
def _at_place(rows, n, m, c, scratch):
    """Write derivatives by q of the barrier of a place's half-spaces, of which m is the first."""
    k = c.shape[1]
    scratch.slope[:] = 0.0
    scratch.bend[:, :] = 0.0
    for j in range(k):
        scratch.q[j] = _position(rows, n, c, j)
    for row in range(m, rows.ends[n]):
        left = rows.offsets[row]
        for j in range(k):
            scratch.normal[j] = rows.normals[row, j]
            left += rows.normals[row, j] * scratch.q[j]
        share = 1.0 / left
        _add_outer(scratch.normal, share, share * share, scratch.slope, scratch.bend)


@inlined_kernel
def _add_half_spaces(rows, c, band, right, scratch):
    """Add derivatives of the half-spaces' barrier."""
    k, free, m, stride = c.shape[1], len(c) - 2 * _FIXED, 0, band.shape[1]
    wide, length = len(scratch.normal), scratch.whole.shape[1]
    for n in range(len(rows.spans)):
        if m == rows.ends[n]:
            continue
        _at_place(rows, n, m, c, scratch)
        m = rows.ends[n]
        first = rows.spans[n] - _FIXED
        begin, end = max(0, -first), min(4, free - first)
        for j in range(k):
            for to in range(begin, 4):
                # What is beyond k is 0, and then the next one's.
                weight = rows.weights[n, to] if to < end else 0.0
                for i in range(0, wide, LANES):
                    more = weight * load_lanes(scratch.bend, j * wide + i)
                    store_lanes(scratch.whole, j * length + to * k + i, more)
        for j in range(k):
            for at in range(begin, end):
                row, weight = (first + at) * k + j, rows.weights[n, at]
                right[0, row] += weight * scratch.slope[j]
                # What is beyond the control points is 0.
                for i in range(0, (end - at) * k - j, LANES):
                    more = weight * load_lanes(scratch.whole, j * length + at * k + j + i)
                    to = row * stride + i
                    store_lanes(band, to, load_lanes(band, to) + more)


@inlined_kernel
def _direction(gradient, right, slope, bend):
    """Make Newton's step of both solutions, the first of them; return that of u and its square."""
    top, bottom = slope, bend
    for p in range(right.shape[1]):
        top -= gradient[1, p] * right[0, p]
        bottom -= gradient[1, p] * right[1, p]
    faster = -top / bottom if bottom > 0.0 else 0.0
    decrement = -slope * faster
    for p in range(right.shape[1]):
        right[0, p] = -right[0, p] - right[1, p] * faster
        decrement -= gradient[0, p] * right[0, p]
    return faster, decrement


@kernel
def fastest_spline(limits, ends, low, high, rows, c, u, gap):
    """Change control points ``(m, k)`` and ``u`` ``(1,)`` to about those of the least u.

    ``limits`` ``(2 or 3, k)`` are of velocity, acceleration and, if there are three, jerk;
    ``ends`` ``(2, 3, k)`` positions, velocities and accelerations at both ends; free control
    points are between ``low`` and ``high`` ``(m - 6, k)``. It must begin within all bounds. The
    gap is about how much less u may be, relative to it, as far as the bounds are linear. Return
    how many steps were gone, or -1 where it does not begin within the bounds.
    """
    count, k = c.shape
    free = count - 2 * _FIXED
    changes, trial = np.empty((2 * _FIXED, k)), np.empty((count, k))
    band, right = np.empty((free * k, 4 * k + LANES)), np.empty((2, free * k))
    gradient, inverses = np.empty((2, free * k)), np.empty(free * k)
    wide = (k + LANES - 1) // LANES * LANES
    normal, slopes, bends = np.zeros(wide), np.empty(wide), np.empty((k, wide))
    whole = np.zeros((k, 4 * k + LANES))
    scratch = _Scratch(np.empty(k), normal, slopes, bends, whole)
    bounds = 2.0 * k * free + len(rows.offsets)
    for order in range(1, len(limits) + 1):
        bounds += 2.0 * k * (free + order)
    scale, steps = u[0], 0
    weight = bounds / (gap * scale)
    _place_ends(ends, u[0], c, changes)
    before = _merit(limits, low, high, rows, c, u[0], scale, weight, scratch.q)
    if before == math.inf:
        return -1
    while steps < _STEPS:
        band[:, :] = 0.0
        right[:, :] = 0.0
        slope, bend = _add_limits(limits, c, changes, u[0], band, right)
        _add_box(low, high, c, band, right)
        _add_half_spaces(rows, c, band, right, scratch)
        gradient[:, :] = right
        solve_band(band, 4 * k, right, inverses)
        faster, decrement = _direction(gradient, right, slope + weight, bend)
        steps, size = steps + 1, 1.0
        while size > _SHORTEST:
            now = u[0] + size * faster
            if now > 0.0:
                for i in range(free):
                    for j in range(k):
                        trial[i + _FIXED, j] = c[i + _FIXED, j] + size * right[0, i * k + j]
                _place_ends(ends, now, trial, changes)
                merit = _merit(limits, low, high, rows, trial, now, scale, weight, scratch.q)
                if merit <= before - _ENOUGH * size * decrement:
                    u[0], before = now, merit
                    c[:, :] = trial
                    break
            size *= _BACK
        _place_ends(ends, u[0], c, changes)
        if decrement < _NEAR or size <= _SHORTEST:
            break
    return steps
