"""Convex functions of edges' costs inside kernels: their values and affine minorants.

Kinds are numbers here.
"""

from __future__ import annotations

import math

import numpy as np

from scene_graph_ros.geometry.compiled.kernel import kernel, lean_kernel
from scene_graph_ros.geometry.tolerances import EPSILON

__all__ = [
    "EXPONENTIAL",
    "KINDS",
    "NORM",
    "NORM_INF",
    "QUOTIENT",
    "SQUARES",
    "shorten",
    "value",
    "values",
]

NORM, SQUARES, NORM_INF, QUOTIENT, EXPONENTIAL = range(5)

KINDS = {
    "norm": NORM,
    "squares": SQUARES,
    "norm_inf": NORM_INF,
    "quotient": QUOTIENT,
    "exponential": EXPONENTIAL,
}

LARGEST_POWER = 700.0
"""Of e: what is above it is more than floats can say."""


@lean_kernel
def value(kind, w, first, count):
    """Return the atom of ``w[first : first + count]``."""
    total = 0.0
    if kind == EXPONENTIAL:
        return math.exp(min(w[first], LARGEST_POWER))
    if kind == NORM_INF:
        for i in range(first, first + count):
            total = max(total, abs(w[i]))
        return total
    start = first + 1 if kind == QUOTIENT else first
    for i in range(start, first + count):
        total += w[i] * w[i]
    if kind == NORM:
        return math.sqrt(total)
    if kind == QUOTIENT:
        if w[first] > 0.0:
            return total / w[first]
        return 0.0 if total == 0.0 and w[first] == 0.0 else math.inf
    return total


@lean_kernel
def shorten(kind, y, first, count):
    """Make slopes such that ``y . w - c`` is at most the atom of any w, and return c.

    They are ``y[first : first + count]``, and are changed as little as that takes.
    """
    total = 0.0
    if kind == EXPONENTIAL:
        # exp(w) - y w is least at log(y).
        y[first] = max(y[first], 0.0)
        if not y[first] > 0.0:
            return 0.0
        power = math.log(y[first])
        return y[first] * power - y[first] + 8.0 * EPSILON * y[first] * (1.0 + abs(power))
    if kind == SQUARES:
        for i in range(first, first + count):
            total += y[i] * y[i]
        # |w|^2 - y . w is least at y / 2; rounded up.
        return 0.25 * total * (1.0 + (count + 4) * EPSILON)
    if kind == QUOTIENT:
        for i in range(first + 1, first + count):
            total += y[i] * y[i]
        # |w|^2 / s - q . w is least at q s / 2, where it is -|q|^2 s / 4.
        y[first] = min(y[first], -0.25 * total * (1.0 + (count + 4) * EPSILON))
        return 0.0
    for i in range(first, first + count):
        total += abs(y[i]) if kind == NORM_INF else y[i] * y[i]
    length = total if kind == NORM_INF else math.sqrt(total)
    most = 1.0 - 4.0 * (count + 2) * EPSILON
    if length > most:
        for i in range(first, first + count):
            y[i] *= most / length
    return 0.0


@kernel
def values(kind, w):
    """Return the atoms of each of the rows ``(g, k)``."""
    found = np.zeros(len(w))
    for g in range(len(w)):
        found[g] = value(kind, w[g], 0, w.shape[1])
    return found
