"""The simplex method on rows of inequalities, in floats: it proposes, exact arithmetic decides.

Variables x ``(n,)`` are free; rows ``A x <= b`` have about unit length, the first
``num_equalities`` of them are equations. A basis is n linearly independent rows, kept as the
inverse of the matrix that they make. Its places are filled with unit vectors at first, which are
no rows: entry ``-1`` of ``basis``. From a point of the set the method walks along edges uphill
(Dantzig 1963; in this form Best and Ritter, Linear Programming, 1985, chapter 2).
"""

from __future__ import annotations

import numpy as np

from scene_graph_ros.geometry.compiled.kernel import kernel
from scene_graph_ros.geometry.tolerances import EPSILON

__all__ = ["OPTIMAL", "STOPPED", "UNBOUNDED", "climb", "enter_equalities", "exact_residual"]

OPTIMAL = 0
"""No direction along an edge leads up."""

UNBOUNDED = 1
"""A direction leads up and meets no row."""

STOPPED = 2
"""As many steps as allowed did not suffice."""

_NO_RATE = 64.0 * EPSILON
"""Relative to the objective's length: a slope along an edge below it is rounding."""

_NO_PIVOT = 1e-11
"""Sine of an angle: a row that a direction of unit length approaches more slowly may be parallel.
What is passed over wrongly is found when the answer is checked."""

_SLACK_ROUNDING = 16.0 * EPSILON
"""Relative to the numbers that enter a row's slack: what rounding may make of it."""

_REFINE_EVERY = 16
"""Steps after which the inverse is refined: each loses a digit at worst."""

_MOST_BROKEN = 4
"""Broken rows that are mended at the end, for each variable."""

_SPLITTER = 134217729.0  # 2^27 + 1


@kernel
def _product_error(a, b, product):
    """Return a b - product exactly (Dekker 1971)."""
    scaled = _SPLITTER * a
    a_high = scaled - (scaled - a)
    a_low = a - a_high
    scaled = _SPLITTER * b
    b_high = scaled - (scaled - b)
    b_low = b - b_high
    return a_low * b_low - (((product - a_high * b_high) - a_low * b_high) - a_high * b_low)


@kernel
def exact_residual(a, x, b):
    """Return b - a.x as if in twice the digits (Ogita, Rump and Oishi 2005, algorithm 5.3)."""
    total, error = b, 0.0
    for k in range(len(x)):
        product = -a[k] * x[k]
        rest = _product_error(-a[k], x[k], product)
        new = total + product
        z = new - total
        error += ((total - (new - z)) + (product - z)) + rest
        total = new
    return total + error


@kernel
def _replace(A, inverse, row, place):
    """Let a row take a place of the basis."""
    n = inverse.shape[0]
    weights = np.zeros(n)
    for j in range(n):
        for k in range(n):
            weights[j] += A[row, k] * inverse[k, j]
    for k in range(n):
        inverse[k, place] /= weights[place]
    for j in range(n):
        if j != place:
            for k in range(n):
                inverse[k, j] -= weights[j] * inverse[k, place]


@kernel
def _refine(A, basis, inverse):
    """Take a step of Newton's method to the inverse (Schulz 1933): X (2 I - B X)."""
    n = inverse.shape[0]
    rest = np.zeros((n, n))
    for i in range(n):
        if basis[i] < 0:
            for j in range(n):
                rest[i, j] = -inverse[i, j]
        else:
            for k in range(n):
                for j in range(n):
                    rest[i, j] -= A[basis[i], k] * inverse[k, j]
        rest[i, i] += 1.0
    old = inverse.copy()
    for i in range(n):
        for k in range(n):
            for j in range(n):
                inverse[i, j] += old[i, k] * rest[k, j]


@kernel
def _settle(A, b, basis, inverse, x):
    """Move x onto the rows of the basis."""
    n = len(x)
    for _ in range(2):
        rest = np.zeros(n)
        for j in range(n):
            if basis[j] >= 0:
                rest[j] = exact_residual(A[basis[j]], x, b[basis[j]])
        for k in range(n):
            for j in range(n):
                x[k] += inverse[k, j] * rest[j]


@kernel
def enter_equalities(A, b, num_equalities, x, basis, inverse):
    """Fill the basis with the equations and move x ``(n,)`` onto them.

    ``basis`` ``(n,)`` is -1 and ``inverse`` ``(n, n)`` the unit matrix before. An equation that
    follows from those before it, or contradicts them, stays outside.
    """
    n = len(x)
    for i in range(num_equalities):
        place, largest = -1, _NO_PIVOT
        for j in range(n):
            if basis[j] < 0:
                weight = 0.0
                for k in range(n):
                    weight += A[i, k] * inverse[k, j]
                if abs(weight) > largest:
                    place, largest = j, abs(weight)
        if place < 0:
            continue
        _replace(A, inverse, i, place)
        basis[place] = i
        rest = exact_residual(A[i], x, b[i])
        for k in range(n):
            x[k] += inverse[k, place] * rest
    _refine(A, basis, inverse)
    _settle(A, b, basis, inverse, x)


@kernel
def _edge_up(c, basis, inverse, num_equalities, y, first):
    """Return the place whose row to leave and the sign of the way, -1 where none leads up.

    Fills ``y`` with the multipliers of the basis. The steepest edge, or with ``first`` the one of
    the lowest row (Bland 1977), which never runs in circles.
    """
    n = len(c)
    length = 0.0
    for k in range(n):
        length += c[k] * c[k]
    place, sign, best = -1, 0.0, _NO_RATE * np.sqrt(length)
    lowest = np.iinfo(np.int64).max
    for j in range(n):
        total, square = 0.0, 0.0
        for k in range(n):
            total += c[k] * inverse[k, j]
            square += inverse[k, j] * inverse[k, j]
        y[j] = total
        rate = -total / np.sqrt(square)
        if basis[j] < 0:
            rate = abs(rate)
        elif basis[j] < num_equalities:
            continue
        if rate > best:
            if first:
                if basis[j] < lowest:
                    place, lowest = j, basis[j]
                    sign = 1.0 if basis[j] < 0 and total > 0.0 else -1.0
            else:
                place, best = j, rate
                sign = 1.0 if basis[j] < 0 and total > 0.0 else -1.0
    return place, sign


@kernel
def _first_row(A, b, num_equalities, in_basis, x, d, first):
    """Return the row that the way from x along d meets first and how far it is; -1 for none.

    Of rows that are equally near to rounding, the one met most squarely (Harris 1973).
    """
    m, n = A.shape
    slacks, slopes = np.empty(m), np.empty(m)
    farthest = np.inf
    for i in range(num_equalities, m):
        slopes[i] = 0.0
        if in_basis[i]:
            continue
        slack, slope, size = b[i], 0.0, abs(b[i])
        for k in range(n):
            slack -= A[i, k] * x[k]
            slope += A[i, k] * d[k]
            size += abs(A[i, k] * x[k])
        slacks[i], slopes[i] = max(slack, 0.0), slope
        if slope > _NO_PIVOT:
            reach = (slacks[i] + _SLACK_ROUNDING * size) / slope
            if reach < farthest:
                farthest = reach
    row, best, step = -1, 0.0, 0.0
    for i in range(num_equalities, m):
        if slopes[i] > _NO_PIVOT and slacks[i] <= farthest * slopes[i] and slopes[i] > best:
            row, best, step = i, slopes[i], slacks[i] / slopes[i]
            if first:
                break
    return row, step


@kernel
def _broken_row(A, b, num_equalities, in_basis, x):
    """Return the row that a point breaks most, by more than rounding; -1 for none."""
    row, worst = -1, 0.0
    for i in range(num_equalities, len(b)):
        if not in_basis[i]:
            size = abs(b[i])
            for k in range(len(x)):
                size += abs(A[i, k] * x[k])
            excess = -exact_residual(A[i], x, b[i])
            if excess > _SLACK_ROUNDING * size and excess > worst:
                row, worst = i, excess
    return row


@kernel
def _place_to_leave(A, basis, inverse, num_equalities, y, row):
    """Return the place of the basis that a broken row takes, -1 for none.

    Multipliers stay positive: the row of the one that is down to zero first leaves, and where
    several are at once, that which the row meets most squarely.
    """
    n = len(y)
    weights = np.zeros(n)
    least = np.inf
    for j in range(n):
        for k in range(n):
            weights[j] += A[row, k] * inverse[k, j]
        if basis[j] < 0:
            weights[j] = abs(weights[j])
        elif basis[j] < num_equalities:
            weights[j] = 0.0
        if weights[j] > _NO_PIVOT:
            least = min(least, (max(y[j], 0.0) + _NO_RATE) / weights[j])
    place, best = -1, 0.0
    for j in range(n):
        if weights[j] > max(best, _NO_PIVOT) and max(y[j], 0.0) <= least * weights[j]:
            place, best = j, weights[j]
    return place


@kernel
def _descend(A, b, num_equalities, c, x, basis, inverse, y, in_basis):
    """Step from a corner above the set down to it (the dual simplex method, Lemke 1954).

    Where rows are nearly parallel, rounding on the way up leaves a corner that breaks others.
    """
    for _ in range(_MOST_BROKEN * len(x)):
        row = _broken_row(A, b, num_equalities, in_basis, x)
        if row < 0:
            break
        place = _place_to_leave(A, basis, inverse, num_equalities, y, row)
        if place < 0:
            break
        _replace(A, inverse, row, place)
        if basis[place] >= 0:
            in_basis[basis[place]] = False
        basis[place] = row
        in_basis[row] = True
        _refine(A, basis, inverse)
        _settle(A, b, basis, inverse, x)
        _edge_up(c, basis, inverse, num_equalities, y, False)


@kernel
def climb(A, b, num_equalities, c, x, basis, inverse, y, ray, max_steps):
    """Walk from a point x ``(n,)`` of the set to where ``c . x`` is largest.

    ``x``, ``basis`` and ``inverse`` go on from where `enter_equalities`, or a walk before, left
    them. Fills ``y`` ``(n,)`` with the multipliers of the basis, ``c = y . rows``, and ``ray``
    ``(n,)`` with the direction where none ends the walk. Returns OPTIMAL, UNBOUNDED or STOPPED.
    """
    m, n = A.shape
    in_basis = np.zeros(m, np.bool_)
    for j in range(n):
        if basis[j] >= 0:
            in_basis[basis[j]] = True
    status, idle = STOPPED, 0
    for count in range(max_steps):
        first = idle > 2 * n + 8
        place, sign = _edge_up(c, basis, inverse, num_equalities, y, first)
        if place < 0:
            status = OPTIMAL
            break
        length = 0.0
        for k in range(n):
            length += inverse[k, place] * inverse[k, place]
        length = np.sqrt(length)
        for k in range(n):
            ray[k] = sign * inverse[k, place] / length
        row, step = _first_row(A, b, num_equalities, in_basis, x, ray, first)
        if row < 0:
            status = UNBOUNDED
            break
        for k in range(n):
            x[k] += step * ray[k]
        idle = idle + 1 if step == 0.0 else 0
        _replace(A, inverse, row, place)
        if basis[place] >= 0:
            in_basis[basis[place]] = False
        basis[place] = row
        in_basis[row] = True
        if (count + 1) % _REFINE_EVERY == 0:
            _refine(A, basis, inverse)
    _refine(A, basis, inverse)
    _settle(A, b, basis, inverse, x)
    if status == OPTIMAL:
        _descend(A, b, num_equalities, c, x, basis, inverse, y, in_basis)
    return status
