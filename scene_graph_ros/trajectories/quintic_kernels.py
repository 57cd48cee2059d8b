"""Bounds of a motion along the quintics between nodes, and the motion at these, compiled.

The nodes are evenly apart in u, and quintics run through a path's values and two derivatives by u
there. Their derivatives are bounded at the nodes and in the middles between.
"""

import math

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, kernel

__all__ = ["set_rows", "set_times_and_jerks"]

_MOST = 1e30
"""Squares of larger rates may be infinite."""

_GAUSS = (
    (0.06943184420297371, 0.17392742256872693),
    (0.33000947820757187, 0.32607257743127307),
    (0.6699905217924281, 0.32607257743127307),
    (0.9305681557970263, 0.17392742256872693),
)
"""Places and weights that integrate up to degree 7 exactly (Gauss and Legendre)."""


@inlined_kernel
def _at_start(d, f0, f1, s0, s1):
    """Return the third derivative of a quintic on [0, 1] at its start.

    By the difference of its ends' values, the derivatives and the second derivatives there.
    """
    return 60.0 * d - 36.0 * f0 - 24.0 * f1 - 9.0 * s0 + 3.0 * s1


@inlined_kernel
def _in_middle(d, f0, f1, s0, s1):
    """Return it in the middle."""
    return -30.0 * d + 15.0 * (f0 + f1) + 1.5 * (s0 - s1)


@inlined_kernel
def _at_end(d, f0, f1, s0, s1):
    """Return it at the end."""
    return 60.0 * d - 24.0 * f0 - 36.0 * f1 - 3.0 * s0 + 9.0 * s1


@inlined_kernel
def _set_bounds(rows, k, j, p, limits):
    """Write the bounds of a joint at a point, by three derivatives of the path."""
    p1, p2, p3 = p
    v, a, jerk = limits[0, j], limits[1, j], limits[2, j]
    if p1 != 0.0:
        rate = v / abs(p1)
        rows.caps[k] = min(rows.caps[k], rate * rate if rate < 1e15 else _MOST)
    rows.a1[j, k], rows.a0[j, k] = p1 / (2.0 * a), p2 / a
    rows.j2[j, k], rows.j1[j, k], rows.j0[j, k] = 0.5 * p1 / jerk, 1.5 * p2 / jerk, p3 / jerk


@kernel
def set_rows(values, first, second, limits, pinned, rows):
    """Write the bounds of a motion at n nodes and in the middles between.

    ``values`` and two derivatives by u ``(n, j)``, 1 apart; ``limits`` ``(3, j)`` of three
    derivatives by the time that u is. Where the motion is ``pinned`` ``(2,)`` its velocity and
    acceleration are given, and have no bounds there. ``rows`` are `Rows` of 2 n - 1 points.
    """
    n, joints = values.shape
    rows.caps[:] = _MOST
    for j in range(joints):
        before = 0.0
        for i in range(n):
            f0, s0 = first[i, j], second[i, j]
            if i == n - 1:
                _set_bounds(rows, 2 * i, j, (f0, s0, before), limits)
                break
            f1, s1 = first[i + 1, j], second[i + 1, j]
            d = values[i + 1, j] - values[i, j]
            third = _at_start(d, f0, f1, s0, s1)
            mean = third if i == 0 else 0.5 * (before + third)
            _set_bounds(rows, 2 * i, j, (f0, s0, mean), limits)
            one = 1.875 * d - 0.4375 * (f0 + f1) + 0.03125 * (s1 - s0)
            two = 1.5 * (f1 - f0) - 0.25 * (s0 + s1)
            three = _in_middle(d, f0, f1, s0, s1)
            _set_bounds(rows, 2 * i + 1, j, (one, two, three), limits)
            before = _at_end(d, f0, f1, s0, s1)
    for end in range(2):
        if pinned[end]:
            k = 0 if end == 0 else 2 * n - 2
            rows.caps[k] = _MOST
            rows.a1[:, k] = 0.0
            rows.a0[:, k] = 0.0


@inlined_kernel
def _seconds(c, i):
    """Return the duration from a node to the next: the integral of 1 / sqrt(b) by u."""
    total = 0.0
    for x, weight in _GAUSS:
        y = 1.0 - x
        b = y**3 * c[i] + (3.0 * x**3 - 6.0 * x**2 + 4.0) * c[i + 1]
        b += (3.0 * y**3 - 6.0 * y**2 + 4.0) * c[i + 2] + x**3 * c[i + 3]
        total += weight / math.sqrt(b / 6.0) if b > 0.0 else math.inf
    return total


@inlined_kernel
def _largest_jerk(begin, middle, end):
    """Return the largest size of a parabola between its ends."""
    curved, slope = 2.0 * (begin + end - 2.0 * middle), 4.0 * middle - 3.0 * begin - end
    result = max(abs(begin), abs(end))
    if curved != 0.0:
        at = -0.5 * slope / curved
        if 0.0 < at < 1.0:
            result = max(result, abs(begin + at * (slope + at * curved)))
    return result


@kernel
def set_times_and_jerks(c, values, first, second, step, limits, times, jerks):
    """Write when a motion is at n nodes, s, and the largest jerk on each quintic, by its limit.

    ``c`` ``(n + 2,)`` are coefficients of b = (du/dt)^2, a cubic spline; the nodes are a ``step``
    (s) of u apart. ``limits`` ``(j,)`` are of jerk. Return whether b is positive everywhere.
    """
    n, joints = values.shape
    times[0] = 0.0
    for i in range(n - 1):
        times[i + 1] = times[i] + step * _seconds(c, i)
    if not times[n - 1] < math.inf:
        return False
    for i in range(n):
        if not c[i] + 4.0 * c[i + 1] + c[i + 2] > 0.0:
            return False
    for i in range(n - 1):
        b0, b1 = (
            (c[i] + 4.0 * c[i + 1] + c[i + 2]) / 6.0,
            (c[i + 1] + 4.0 * c[i + 2] + c[i + 3]) / 6.0,
        )
        slope0, slope1 = 0.5 * (c[i + 2] - c[i]), 0.5 * (c[i + 3] - c[i + 1])
        h = times[i + 1] - times[i]
        way = h / step
        rate0, rate1 = way * math.sqrt(b0), way * math.sqrt(b1)
        way *= way
        most = 0.0
        for j in range(joints):
            d = values[i + 1, j] - values[i, j]
            f0, f1 = first[i, j] * rate0, first[i + 1, j] * rate1
            s0 = way * (0.5 * first[i, j] * slope0 + second[i, j] * b0)
            s1 = way * (0.5 * first[i + 1, j] * slope1 + second[i + 1, j] * b1)
            jerk = _largest_jerk(
                _at_start(d, f0, f1, s0, s1),
                _in_middle(d, f0, f1, s0, s1),
                _at_end(d, f0, f1, s0, s1),
            )
            most = max(most, jerk / limits[j])
        jerks[i] = most / h**3
    return True
