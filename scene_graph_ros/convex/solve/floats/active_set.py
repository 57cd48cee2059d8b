"""The simplex method on rows of inequalities, in floats: it proposes, exact arithmetic decides.

Variables x ``(n,)`` are free; rows ``A x <= b`` have about unit length, the first
``num_equalities`` of them are equations. They are given as ``columns (n, m)``, so that several
rows are computed with at a time. A basis is n linearly independent rows, kept as the inverse of
the matrix that they make. Its places are filled with unit vectors at first, which are no rows:
entry ``-1`` of ``basis``. From a point of the set the method walks along edges uphill
(Dantzig 1963; in this form Best and Ritter, Linear Programming, 1985, chapter 2).
"""

from __future__ import annotations

import numpy as np

from scene_graph_ros.convex.solve.linear_algebra.doubled import exact_residual, exact_residuals
from scene_graph_ros.geometry.compiled.kernel import kernel
from scene_graph_ros.geometry.tolerances import EPSILON

__all__ = ["OPTIMAL", "STOPPED", "UNBOUNDED", "climb", "columns_of", "enter_equalities"]

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


def columns_of(A: np.ndarray) -> np.ndarray:
    """Return the entries of rows ``(m, n)`` as columns ``(n, m)``."""
    return np.ascontiguousarray(A.T)


@kernel
def _weights_of_row(columns, inverse, row, weights):
    """Fill the weights ``(n,)`` of a basis's rows that make a row."""
    n = len(weights)
    weights[:] = 0.0
    for k in range(n):
        entry = columns[k, row]
        for j in range(n):
            weights[j] += entry * inverse[k, j]


@kernel
def _replace(columns, inverse, row, place, weights):
    """Let a row take a place of the basis; ``weights (n,)`` is room."""
    n = len(weights)
    _weights_of_row(columns, inverse, row, weights)
    pivot = weights[place]
    weights[place] = 0.0
    for k in range(n):
        way = inverse[k, place] / pivot
        for j in range(n):
            inverse[k, j] -= weights[j] * way
        inverse[k, place] = way


@kernel
def _refine(columns, basis, inverse):
    """Take a step of Newton's method to the inverse (Schulz 1933): X (2 I - B X)."""
    n = inverse.shape[0]
    rest = np.zeros((n, n))
    for i in range(n):
        if basis[i] < 0:
            for j in range(n):
                rest[i, j] = -inverse[i, j]
        else:
            for k in range(n):
                entry = columns[k, basis[i]]
                for j in range(n):
                    rest[i, j] -= entry * inverse[k, j]
        rest[i, i] += 1.0
    old = inverse.copy()
    for i in range(n):
        for k in range(n):
            share = old[i, k]
            for j in range(n):
                inverse[i, j] += share * rest[k, j]


@kernel
def _settle(columns, b, basis, inverse, x):
    """Move x onto the rows of the basis."""
    n = len(x)
    chosen, sides = np.zeros((n, n)), np.zeros(n)
    rest, room = np.empty(n), np.empty(n)
    for j in range(n):
        if basis[j] >= 0:
            sides[j] = b[basis[j]]
            for k in range(n):
                chosen[k, j] = columns[k, basis[j]]
    for _ in range(2):
        exact_residuals(chosen, sides, n, x, rest, room)
        for k in range(n):
            for j in range(n):
                x[k] += inverse[k, j] * rest[j]


@kernel
def enter_equalities(columns, b, num_equalities, x, basis, inverse):
    """Fill the basis with the equations and move x ``(n,)`` onto them.

    ``basis`` ``(n,)`` is -1 and ``inverse`` ``(n, n)`` the unit matrix before. An equation that
    follows from those before it, or contradicts them, stays outside.
    """
    n = len(x)
    weights = np.empty(n)
    for i in range(num_equalities):
        _weights_of_row(columns, inverse, i, weights)
        place, largest = -1, _NO_PIVOT
        for j in range(n):
            if basis[j] < 0 and abs(weights[j]) > largest:
                place, largest = j, abs(weights[j])
        if place < 0:
            continue
        _replace(columns, inverse, i, place, weights)
        basis[place] = i
        rest = exact_residual(columns[:, i], x, b[i])
        for k in range(n):
            x[k] += inverse[k, place] * rest
    _refine(columns, basis, inverse)
    _settle(columns, b, basis, inverse, x)


@kernel
def _edge_up(c, basis, inverse, num_equalities, y, squares, first):
    """Return the place whose row to leave and the sign of the way, -1 where none leads up.

    Fills ``y`` with the multipliers of the basis and ``squares`` with those of edges' lengths. The
    steepest edge, or with ``first`` the one of the lowest row (Bland 1977), which never runs in
    circles.
    """
    n = len(c)
    length = 0.0
    y[:] = 0.0
    squares[:] = 0.0
    for k in range(n):
        goal = c[k]
        length += goal * goal
        for j in range(n):
            entry = inverse[k, j]
            y[j] += goal * entry
            squares[j] += entry * entry
    place, sign, best = -1, 0.0, _NO_RATE * np.sqrt(length)
    lowest = np.iinfo(np.int64).max
    for j in range(n):
        rate = -y[j] / np.sqrt(squares[j])
        if basis[j] < 0:
            rate = abs(rate)
        elif basis[j] < num_equalities:
            continue
        if rate > best:
            if first:
                if basis[j] < lowest:
                    place, lowest = j, basis[j]
                    sign = 1.0 if basis[j] < 0 and y[j] > 0.0 else -1.0
            else:
                place, best = j, rate
                sign = 1.0 if basis[j] < 0 and y[j] > 0.0 else -1.0
    return place, sign


@kernel
def _measure(columns, b, count, x, d, slacks, slopes, sizes):
    """Fill rows' slacks at x, their slopes along d and the sizes of the numbers in them."""
    for i in range(count):
        slacks[i], slopes[i], sizes[i] = b[i], 0.0, abs(b[i])
    for k in range(len(x)):
        column, at, rate = columns[k], x[k], d[k]
        for i in range(count):
            product = column[i] * at
            slacks[i] -= product
            sizes[i] += abs(product)
            slopes[i] += column[i] * rate


@kernel
def _first_row(num_equalities, count, basis, slacks, slopes, sizes, first):
    """Return the row that a way meets first and how far it is; -1 for none.

    Of rows that are equally near to rounding, the one met most squarely (Harris 1973).
    """
    slopes[:num_equalities] = 0.0
    for j in range(len(basis)):
        if basis[j] >= 0:
            slopes[basis[j]] = 0.0
    farthest = np.inf
    for i in range(count):
        slacks[i] = max(slacks[i], 0.0)
        reach = slacks[i] + _SLACK_ROUNDING * sizes[i]
        if slopes[i] > _NO_PIVOT and not reach >= farthest * slopes[i]:
            farthest = reach / slopes[i]
    row, best, step = -1, 0.0, 0.0
    for i in range(count):
        slope = slopes[i]
        if slope > best and slope > _NO_PIVOT and slacks[i] <= farthest * slope:
            row, best, step = i, slope, slacks[i] / slope
            if first:
                break
    return row, step


@kernel
def _broken_row(columns, b, num_equalities, count, in_basis, x, rests, room):
    """Return the row that a point breaks most, by more than rounding; -1 for none."""
    row, worst = -1, 0.0
    exact_residuals(columns, b, count, x, rests, room)
    for i in range(num_equalities, count):
        if -rests[i] > worst and not in_basis[i]:
            size = abs(b[i])
            for k in range(len(x)):
                size += abs(columns[k, i] * x[k])
            if -rests[i] > _SLACK_ROUNDING * size:
                row, worst = i, -rests[i]
    return row


@kernel
def _place_to_leave(columns, basis, inverse, num_equalities, y, row, weights):
    """Return the place of the basis that a broken row takes, -1 for none.

    Multipliers stay positive: the row of the one that is down to zero first leaves, and where
    several are at once, that which the row meets most squarely. ``weights (n,)`` is room.
    """
    n = len(y)
    _weights_of_row(columns, inverse, row, weights)
    least = np.inf
    for j in range(n):
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
def _enter(columns, basis, inverse, in_basis, row, place, weights):
    """Let a row take a place of the basis, and say so."""
    _replace(columns, inverse, row, place, weights)
    if basis[place] >= 0:
        in_basis[basis[place]] = False
    basis[place] = row
    in_basis[row] = True


@kernel
def _descend(columns, b, num_equalities, count, c, x, basis, inverse, y, in_basis, rests, room):
    """Step from a corner above the set down to it (the dual simplex method, Lemke 1954).

    Where rows are nearly parallel, rounding on the way up leaves a corner that breaks others.
    """
    weights, squares = np.empty(len(x)), np.empty(len(x))
    for _ in range(_MOST_BROKEN * len(x)):
        row = _broken_row(columns, b, num_equalities, count, in_basis, x, rests, room)
        if row < 0:
            break
        place = _place_to_leave(columns, basis, inverse, num_equalities, y, row, weights)
        if place < 0:
            break
        _enter(columns, basis, inverse, in_basis, row, place, weights)
        _refine(columns, basis, inverse)
        _settle(columns, b, basis, inverse, x)
        _edge_up(c, basis, inverse, num_equalities, y, squares, False)


@kernel
def climb(columns, b, num_equalities, count, c, x, basis, inverse, y, ray, max_steps):
    """Walk from a point x ``(n,)`` of the first ``count`` rows to where ``c . x`` is largest.

    ``x``, ``basis`` and ``inverse`` go on from where `enter_equalities`, or a walk before, left
    them. Fills ``y`` ``(n,)`` with the multipliers of the basis, ``c = y . rows``, and ``ray``
    ``(n,)`` with the direction where none ends the walk. Returns OPTIMAL, UNBOUNDED or STOPPED.
    """
    n = len(x)
    in_basis = np.zeros(count, np.bool_)
    for j in range(n):
        if basis[j] >= 0:
            in_basis[basis[j]] = True
    slacks, slopes, sizes = np.empty(count), np.empty(count), np.empty(count)
    weights, squares = np.empty(n), np.empty(n)
    status, idle = STOPPED, 0
    for step_number in range(max_steps):
        first = idle > 2 * n + 8
        place, sign = _edge_up(c, basis, inverse, num_equalities, y, squares, first)
        if place < 0:
            status = OPTIMAL
            break
        length = np.sqrt(squares[place])
        for k in range(n):
            ray[k] = sign * inverse[k, place] / length
        _measure(columns, b, count, x, ray, slacks, slopes, sizes)
        row, step = _first_row(num_equalities, count, basis, slacks, slopes, sizes, first)
        if row < 0:
            status = UNBOUNDED
            break
        for k in range(n):
            x[k] += step * ray[k]
        idle = idle + 1 if step == 0.0 else 0
        _enter(columns, basis, inverse, in_basis, row, place, weights)
        if (step_number + 1) % _REFINE_EVERY == 0:
            _refine(columns, basis, inverse)
    _refine(columns, basis, inverse)
    _settle(columns, b, basis, inverse, x)
    if status == OPTIMAL:
        _descend(
            columns, b, num_equalities, count, c, x, basis, inverse, y, in_basis, slacks, sizes
        )
    return status
