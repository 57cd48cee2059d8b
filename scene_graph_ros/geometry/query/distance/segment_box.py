"""Nearest points of a segment and a box."""

import math

from scene_graph_ros.geometry.compiled.kernel import kernel

__all__ = ["crossings", "excess", "nearest_on_segment_to_box"]


@kernel
def excess(value, bound):
    """Return a coordinate's excess over [-bound, bound], signed; 0 inside."""
    return value - min(max(value, -bound), bound)


@kernel
def crossings(size, c, u):
    """Return (first, last): the t between which c + t u is between two faces; all, if it stays."""
    if u == 0.0:
        return -math.inf, math.inf
    a, b = (-size - c) / u, (size - c) / u
    return min(a, b), max(a, b)


@kernel
def _past(t, crossings):
    return t - min(max(t, crossings[0]), crossings[1])


@kernel
def nearest_on_segment_to_box(size, c, u):
    """Return t in [-1, 1] for which c + t u is nearest to the box of half extents ``size``.

    The squared distance is convex in t and quadratic between the places where a coordinate passes
    a face, so its derivative grows, linearly between these breaks. Where several t are nearest,
    the middle one is returned. A component of u that is rounding must have been made zero.

    The derivative is made of differences of t, not of places, whose rounding would hide it close
    to the box: so it grows also when computed, and t is right for a box that is rounded a little.
    """
    x = crossings(size[0], c[0], u[0])
    y = crossings(size[1], c[1], u[1])
    z = crossings(size[2], c[2], u[2])
    xx, yy, zz = u[0] * u[0], u[1] * u[1], u[2] * u[2]
    # Derivative negative at low, positive at high; zero from first to last, if anywhere.
    low, high, low_slope, high_slope = -1.0, 1.0, 0.0, 0.0
    first, last = 2.0, -2.0
    for t in (x[0], x[1], y[0], y[1], z[0], z[1], -1.0, 1.0):
        if not -1.0 <= t <= 1.0:
            continue
        slope = xx * _past(t, x) + yy * _past(t, y) + zz * _past(t, z)
        if slope < 0.0:
            if low_slope == 0.0 or t > low:
                low, low_slope = t, slope
        elif slope > 0.0:
            if high_slope == 0.0 or t < high:
                high, high_slope = t, slope
        else:
            first, last = min(first, t), max(last, t)
    if first <= last:
        return 0.5 * (first + last)
    if low_slope == 0.0:
        return -1.0
    if high_slope == 0.0:
        return 1.0
    t = low + (high - low) * (low_slope / (low_slope - high_slope))
    return min(max(t, low), high)
