"""The interior-point method for weighted sums of squares: predictor and corrector.

Mehrotra, "On the implementation of a primal-dual interior point method", 1992.
"""

from __future__ import annotations

import numpy as np

from scene_graph_ros.convex.solve.sums_of_squares.gram_kernels import longest_step
from scene_graph_ros.convex.solve.sums_of_squares.gram_steps import (
    center,
    find_direction,
    measure,
    prepare,
)
from scene_graph_ros.geometry.compiled.kernel import lean_kernel

__all__ = ["SOLVED", "STALLED", "improve"]

STALLED, SOLVED = 0, 1

_KEPT, _KEPT_MORE = 0.9, 0.09
"""How much of the way to where a matrix is singular is gone at most; how much more where the
predictor goes all the way."""

_LEAST_CENTERING = 1e-4
"""What the mean product is to become of its value at least."""

_REFINEMENTS = 1
"""How often a step is refined."""

_SHORTEST = 1e-3
"""Steps that are shorter lead nowhere: rounding decides where they go."""

_CLOSED = 1e-8
"""What is open at most where the gap is looked at, relative to what is 1 in size."""


@lean_kernel
def improve(program, point, step, rest, order, gap, least, iterations):
    """Move a point until its cost is near its bound, which is ``-constants . moments``.

    Returns SOLVED where it is no farther than ``gap`` times its size, or than ``least``; STALLED
    where steps become too short or too many; and how many there were. ``order`` is the sum of all
    matrices' orders.
    """
    for count in range(iterations):
        value, mean = measure(program, point, rest)
        mean /= order
        bound = 0.0
        for e in range(len(point.moments)):
            bound -= program.constants[e] * point.moments[e]
        is_closed = _largest(rest.identities) + _largest(rest.slacks) < _CLOSED
        is_closed = is_closed and _largest(rest.columns) < _CLOSED
        if is_closed and value - bound <= max(gap * abs(value), least):
            return SOLVED, count
        if not prepare(program, point, rest):
            return STALLED, count
        find_direction(program, point, rest, step, 0)
        along, across = _steps(program.table, point, step, 1.0, rest.room)
        kept = _KEPT + _KEPT_MORE * min(along, across)
        product = 0.0
        for i in range(len(point.grams)):
            gram = point.grams[i] + along * step.grams[i]
            product += gram * (point.slacks[i] + across * step.slacks[i])
        share = max((product / (order * mean)) ** 3, _LEAST_CENTERING)
        center(program.table, min(share, 1.0) * mean, step, rest)
        find_direction(program, point, rest, step, _REFINEMENTS)
        along, across = _steps(program.table, point, step, 1.0 / kept, rest.room)
        along, across = min(1.0, kept * along), min(1.0, kept * across)
        if not min(along, across) > _SHORTEST:
            return STALLED, count
        _move(point.x, step.x, along)
        _move(point.grams, step.grams, along)
        _move(point.moments, step.moments, across)
        _move(point.slacks, step.slacks, across)
    return STALLED, iterations


@lean_kernel
def _steps(table, point, step, longest, room):
    """Return the largest steps of Gram matrices and localizing matrices."""
    along = longest_step(table, point.grams, step.grams, longest, room)
    return along, longest_step(table, point.slacks, step.slacks, longest, room)


@lean_kernel
def _largest(values):
    """Return the largest magnitude; infinity where something is no number."""
    result = 0.0
    for i in range(len(values)):
        if not abs(values[i]) <= result:
            result = abs(values[i])
            if result != result:
                return np.inf
    return result


@lean_kernel
def _move(values, changes, step):
    for i in range(len(values)):
        values[i] += step * changes[i]
