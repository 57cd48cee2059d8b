"""Residuals of rows at points, as if in twice the digits."""

from __future__ import annotations

import numpy as np

from scene_graph_ros.geometry.compiled.kernel import kernel
from scene_graph_ros.geometry.tolerances import EPSILON

__all__ = ["bounded_residuals", "exact_residual", "exact_residuals", "residual_error"]

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
def exact_residuals(columns, b, count, x, rests, errors):
    """Fill `exact_residual` of the first rows of ``columns (n, m)``, several rows at a time."""
    for i in range(count):
        rests[i], errors[i] = b[i], 0.0
    for k in range(len(x)):
        column, at = columns[k], x[k]
        for i in range(count):
            product = -column[i] * at
            rest = _product_error(-column[i], at, product)
            new = rests[i] + product
            z = new - rests[i]
            errors[i] += ((rests[i] - (new - z)) + (product - z)) + rest
            rests[i] = new
    for i in range(count):
        rests[i] += errors[i]


@kernel
def bounded_residuals(columns, b, x, rests, bounds):
    """Fill `exact_residual` of all rows of ``columns (n, m)``, and a bound of each one's error.

    That is `residual_error`, or nothing where no product and no sum was rounded.
    """
    n, m = columns.shape
    errors, sizes = np.zeros(m), np.abs(b)
    rests[:] = b
    bounds[:] = 0.0
    for k in range(n):
        column, at = columns[k], x[k]
        for i in range(m):
            product = -column[i] * at
            rest = _product_error(-column[i], at, product)
            new = rests[i] + product
            z = new - rests[i]
            lost = (rests[i] - (new - z)) + (product - z)
            errors[i] += lost + rest
            bounds[i] += abs(lost) + abs(rest)
            sizes[i] += abs(product)
            rests[i] = new
    for i in range(m):
        rests[i] += errors[i]
        error = 2.0 * EPSILON * abs(rests[i]) + 2.0 * (n + 1) ** 2 * EPSILON**2 * sizes[i]
        bounds[i] = error if bounds[i] > 0.0 else 0.0


@kernel
def residual_error(row, x, side, rest):
    """Return the error bound of `exact_residual` (Ogita, Rump and Oishi 2005, prop. 5.5)."""
    n = len(x)
    size = abs(side)
    for k in range(n):
        size += abs(row[k] * x[k])
    return 2.0 * EPSILON * abs(rest) + 2.0 * (n + 1) ** 2 * EPSILON**2 * size
