"""Piecewise polynomials, their values, and those through values and derivatives, compiled."""

import numpy as np

from scene_graph_ros.geometry.compiled.kernel import kernel

__all__ = ["write_derivatives", "write_hermite", "write_hermite_rates"]


@kernel
def write_derivatives(breaks, control, s, out):
    """Write values and three derivatives ``(4, m, n)`` at places ``(m,)``, which need not grow.

    ``control`` ``(p, d, n)`` are control points of degree 3 or above. At a break it is the next
    segment's value. De Casteljau's points of each level are differences of the level above (Farin,
    *Curves and Surfaces for CAGD*, 2002, section 5.3).
    """
    count, d, n = control.shape
    degree = d - 1
    work = np.empty((d, n))
    for i in range(len(s)):
        k = min(max(np.searchsorted(breaks, s[i], side="right") - 1, 0), count - 1)
        width = breaks[k + 1] - breaks[k]
        x = min(max((s[i] - breaks[k]) / width, 0.0), 1.0)
        y = 1.0 - x
        for row in range(d):
            for j in range(n):
                work[row, j] = control[k, row, j]
        for level in range(degree - 3):
            for row in range(degree - level):
                for j in range(n):
                    work[row, j] = y * work[row, j] + x * work[row + 1, j]
        one = degree / width
        two = one * (degree - 1) / width
        three = two * (degree - 2) / width
        for j in range(n):
            a, b, c, e = work[0, j], work[1, j], work[2, j], work[3, j]
            out[3, i, j] = three * ((e - c) - 2.0 * (c - b) + (b - a))
            a, b, c = y * a + x * b, y * b + x * c, y * c + x * e
            out[2, i, j] = two * ((c - b) - (b - a))
            a, b = y * a + x * b, y * b + x * c
            out[1, i, j] = one * (b - a)
            out[0, i, j] = y * a + x * b


@kernel
def write_hermite(breaks, q, v, a, control):
    """Write control points ``(p, d, n)`` of polynomials by their values ``(p + 1, n)`` at breaks.

    Cubics, for d = 4, have values q and derivatives v there; quintics second derivatives a, too.
    """
    count, d, n = control.shape
    for k in range(count):
        h = breaks[k + 1] - breaks[k]
        for j in range(n):
            control[k, 0, j], control[k, d - 1, j] = q[k, j], q[k + 1, j]
            if d == 4:
                third = h / 3.0
                control[k, 1, j] = q[k, j] + third * v[k, j]
                control[k, 2, j] = q[k + 1, j] - third * v[k + 1, j]
                continue
            control[k, 1, j] = q[k, j] + 0.2 * h * v[k, j]
            control[k, 2, j] = q[k, j] + h * (0.4 * v[k, j] + 0.05 * h * a[k, j])
            control[k, 3, j] = q[k + 1, j] - h * (0.4 * v[k + 1, j] - 0.05 * h * a[k + 1, j])
            control[k, 4, j] = q[k + 1, j] - 0.2 * h * v[k + 1, j]


@kernel
def write_hermite_rates(widths, q, v, a, control):
    """Write control points ``(p, d, n)`` of the derivatives of polynomials as of `write_hermite`.

    They are made of differences of positions, so that rounding of these does not matter.
    """
    count, d, n = control.shape
    for k in range(count):
        h = widths[k]
        for j in range(n):
            v0, v1 = v[k, j], v[k + 1, j]
            mean = (q[k + 1, j] - q[k, j]) / h
            control[k, 0, j], control[k, d - 1, j] = v0, v1
            if d == 3:
                control[k, 1, j] = 3.0 * mean - v0 - v1
                continue
            before, after = 0.25 * h * a[k, j], 0.25 * h * a[k + 1, j]
            control[k, 1, j], control[k, 3, j] = v0 + before, v1 - after
            control[k, 2, j] = 5.0 * mean - 2.0 * (v0 + v1) - (before - after)
