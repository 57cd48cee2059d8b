"""Scalings of points in orthants and second-order cones, and products with them for a step.

Nesterov and Todd's: a symmetric W with ``W z = W^-1 s`` (as in Andersen, Dahl and Vandenberghe,
"Interior-point methods for large-scale cone programming", 2011, section 3). Of the first ``num``
rows W is a number each; of a second-order cone it is ``eta (2 w w' - J)^(1/2)`` with
``w' J w = 1`` and ``J = diag(1, -1, ...)``.
"""

from __future__ import annotations

import math

from scene_graph_ros.geometry.compiled.kernel import lean_kernel

__all__ = [
    "add_identity",
    "divide",
    "least_eigenvalue",
    "longest_step",
    "multiply",
    "scale_at",
    "scaled",
    "unscaled",
]

_LEAST = 1e-300
"""In place of 0, where it is divided by."""


@lean_kernel
def _length(x, a, b):
    total = 0.0
    for i in range(a, b):
        total += x[i] * x[i]
    return math.sqrt(total)


@lean_kernel
def _norm(x, a, b):
    """Return the root of ``x' J x``, for a point of the cone's inside."""
    rest = _length(x, a + 1, b)
    return math.sqrt(max((x[a] - rest) * (x[a] + rest), _LEAST))


@lean_kernel
def scale_at(num, sizes, s, z, w, eta, lam):
    """Set the scaling's w and eta at points inside the cones, and ``lam = W z``."""
    for i in range(num):
        w[i] = math.sqrt(s[i] / z[i])
        lam[i] = math.sqrt(s[i] * z[i])
    a = num
    for c in range(len(sizes)):
        b = a + sizes[c]
        size_s, size_z = _norm(s, a, b), _norm(z, a, b)
        product = 0.0
        for i in range(a, b):
            product += (s[i] / size_s) * (z[i] / size_z)
        half = 2.0 * math.sqrt(0.5 + 0.5 * product)
        w[a] = (s[a] / size_s + z[a] / size_z) / half
        for i in range(a + 1, b):
            w[i] = (s[i] / size_s - z[i] / size_z) / half
        rest = _length(w, a + 1, b)
        w[a] = math.sqrt(1.0 + rest * rest)
        eta[c] = math.sqrt(size_s / size_z)
        a = b
    scaled(num, sizes, w, eta, z, lam)


@lean_kernel
def scaled(num, sizes, w, eta, x, out):
    """Set ``out = W x``."""
    for i in range(num):
        out[i] = w[i] * x[i]
    _apply(num, sizes, w, eta, x, out, 1.0)


@lean_kernel
def unscaled(num, sizes, w, eta, x, out):
    """Set ``out = W^-1 x``."""
    for i in range(num):
        out[i] = x[i] / w[i]
    _apply(num, sizes, w, eta, x, out, -1.0)


@lean_kernel
def _apply(num, sizes, w, eta, x, out, sign):
    a = num
    for c in range(len(sizes)):
        b = a + sizes[c]
        factor = eta[c] if sign > 0.0 else 1.0 / eta[c]
        along, first = 0.0, x[a]
        for i in range(a + 1, b):
            along += w[i] * x[i]
        share = sign * first + along / (1.0 + w[a])
        out[a] = factor * (w[a] * first + sign * along)
        for i in range(a + 1, b):
            out[i] = factor * (x[i] + share * w[i])
        a = b


@lean_kernel
def multiply(num, sizes, x, y, out):
    """Set ``out`` to the cones' products ``(x . y, x0 y1 + y0 x1)``."""
    for i in range(num):
        out[i] = x[i] * y[i]
    a = num
    for c in range(len(sizes)):
        b = a + sizes[c]
        first_x, first_y, total = x[a], y[a], 0.0
        for i in range(a, b):
            total += x[i] * y[i]
        for i in range(a + 1, b):
            out[i] = first_x * y[i] + first_y * x[i]
        out[a] = total
        a = b


@lean_kernel
def divide(num, sizes, lam, d, out):
    """Set ``out`` to d divided by ``lam``; ``lam`` is inside the cones."""
    for i in range(num):
        out[i] = d[i] / lam[i]
    a = num
    for c in range(len(sizes)):
        b = a + sizes[c]
        rest = _length(lam, a + 1, b)
        square = max((lam[a] - rest) * (lam[a] + rest), _LEAST)
        along, first = 0.0, d[a]
        for i in range(a + 1, b):
            along += lam[i] * d[i]
        value = (lam[a] * first - along) / square
        for i in range(a + 1, b):
            out[i] = (d[i] - value * lam[i]) / lam[a]
        out[a] = value
        a = b


@lean_kernel
def add_identity(num, sizes, x, value):
    """Add the cones' unit times a value."""
    for i in range(num):
        x[i] += value
    a = num
    for c in range(len(sizes)):
        x[a] += value
        a += sizes[c]


@lean_kernel
def least_eigenvalue(num, sizes, x):
    """Return the least of ``x0 - |x1|`` and of the single rows: above 0 inside."""
    least = math.inf
    for i in range(num):
        least = min(least, x[i])
    a = num
    for c in range(len(sizes)):
        b = a + sizes[c]
        least = min(least, x[a] - _length(x, a + 1, b))
        a = b
    return least


@lean_kernel
def longest_step(num, sizes, x, d):
    """Return the largest t of ``x + t d`` in the cones, for x inside; at most 1e10."""
    step = 1e10
    for i in range(num):
        if d[i] < 0.0:
            step = min(step, -x[i] / d[i])
    a = num
    for c in range(len(sizes)):
        b = a + sizes[c]
        # |x + t d|_J^2 is p t^2 + 2 q t + r with r > 0: the first root above 0.
        p, q, r = d[a] * d[a], x[a] * d[a], _norm(x, a, b)
        for i in range(a + 1, b):
            p -= d[i] * d[i]
            q -= x[i] * d[i]
        r = r * r
        root = q * q - p * r
        if root >= 0.0:
            if q < 0.0:
                step = min(step, r / (-q + math.sqrt(root)))
            elif p < 0.0:
                step = min(step, (-q - math.sqrt(root)) / p)
        elif q < 0.0 and p < 0.0:
            step = min(step, -q / p)
        if d[a] < 0.0:
            step = min(step, -x[a] / d[a])
        a = b
    return step
