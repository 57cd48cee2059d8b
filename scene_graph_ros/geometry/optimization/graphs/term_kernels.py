"""Convex functions of edges' costs inside kernels: their values and affine minorants.

Kinds are numbers here; `exponential` is none of them.
"""

from __future__ import annotations

import math

from scene_graph_ros.geometry.compiled.kernel import lean_kernel
from scene_graph_ros.geometry.tolerances import EPSILON

__all__ = ["KINDS", "NORM", "NORM_INF", "QUOTIENT", "SQUARES", "shorten", "shorten_all", "value"]

NORM, SQUARES, NORM_INF, QUOTIENT = range(4)

KINDS = {"norm": NORM, "squares": SQUARES, "norm_inf": NORM_INF, "quotient": QUOTIENT}


@lean_kernel
def value(kind, w, first, count):
    """Return the atom of ``w[first : first + count]``."""
    total = 0.0
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


@lean_kernel
def shorten_all(kind, y, out):
    """Do the same with each of the rows y ``(g, k)``; what they return is ``out (g,)``."""
    for g in range(len(y)):
        out[g] = shorten(kind, y[g], 0, y.shape[1])
