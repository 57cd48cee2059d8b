"""Polynomials by their control points, in Bernstein's basis over an interval of width 1.

Arrays are ``(p, degree + 1, ...)``: p polynomials at once, with any number of further axes. The
algorithms are de Casteljau's and those of Farin, *Curves and Surfaces for CAGD*, 2002, chapters
4 to 6.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

__all__ = ["differentiated", "elevated", "evaluated", "multiplied", "split"]

Points = NDArray[np.float64]


def evaluated(points: Points, part: NDArray[np.float64]) -> Points:
    """Return the value ``(p, ...)`` of each polynomial at a place of its own from 0 to 1."""
    at = part.reshape(part.shape + (1,) * (points.ndim - 1))
    while points.shape[1] > 1:
        points = (1.0 - at) * points[:, :-1] + at * points[:, 1:]
    return points[:, 0]


def differentiated(points: Points, order: int) -> Points:
    """Return control points of a derivative; of a constant it is a constant again."""
    for _ in range(order):
        degree = points.shape[1] - 1
        points = np.diff(points, axis=1) * degree if degree else np.zeros_like(points)
    return points


def elevated(points: Points, degree: int) -> Points:
    """Return control points of the same polynomials as ones of a degree no lower than theirs."""
    while points.shape[1] <= degree:
        n = points.shape[1]
        part = (np.arange(1, n) / n).reshape((-1,) + (1,) * (points.ndim - 2))
        inner = part * points[:, :-1] + (1.0 - part) * points[:, 1:]
        points = np.concatenate([points[:, :1], inner, points[:, -1:]], axis=1)
    return points


def split(points: Points, part: float) -> tuple[Points, Points]:
    """Return the control points of the parts before and after a parameter between 0 and 1."""
    left, right = np.empty_like(points), np.empty_like(points)
    last = points.shape[1] - 1
    for i in range(last + 1):
        left[:, i], right[:, last - i] = points[:, 0], points[:, -1]
        points = (1.0 - part) * points[:, :-1] + part * points[:, 1:]
    return left, right


def multiplied(first: Points, second: Points) -> Points:
    """Return the control points of products, entry by entry of the further axes."""
    m, n = first.shape[1] - 1, second.shape[1] - 1
    shape = np.broadcast_shapes(first.shape[:1] + first.shape[2:], second[:, 0].shape)
    result = np.zeros((shape[0], m + n + 1, *shape[1:]))
    for i in range(m + 1):
        for j in range(n + 1):
            weight = math.comb(m, i) * math.comb(n, j) / math.comb(m + n, i + j)
            result[:, i + j] += weight * (first[:, i] * second[:, j])
    return result
