"""Which points of a trajectory say where it leads, compiled.

The curve that runs through fewer points is one polynomial where the other one is several. Their
difference is a polynomial between two neighbouring points, and in the hull of its control points
(Farin, *Curves and Surfaces for CAGD*, 2002, section 4.3): that bounds it at all times.
"""

import numpy as np

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, kernel

__all__ = ["keep_points"]


@inlined_kernel
def _set_powers(points, i, j, row, is_quintic, c):
    """Write the coefficients of the polynomial from a point to another one, by powers of time."""
    times, q, v, a = points
    h = times[j] - times[i]
    c[0], c[1] = q[i, row], v[i, row]
    d = q[j, row] - c[0] - h * c[1]
    dv = v[j, row] - c[1]
    if not is_quintic:
        c[2], c[3] = (3.0 * d / h - dv) / h, (dv - 2.0 * d / h) / (h * h)
        c[4] = c[5] = 0.0
        return
    c[2] = 0.5 * a[i, row]
    d = (d - h * h * c[2]) / h
    dv -= 2.0 * h * c[2]
    da = h * (a[j, row] - a[i, row])
    c[3] = (10.0 * d - 4.0 * dv + 0.5 * da) / (h * h)
    c[4] = (-15.0 * d + 7.0 * dv - da) / (h * h * h)
    c[5] = (6.0 * d - 3.0 * dv + 0.5 * da) / (h * h * h * h)


@inlined_kernel
def _differs(points, i, j, row, is_quintic, c):
    """Return by how much the polynomial is off the curve through all points between, at most."""
    times, q, v, a = points
    most, d0, dv0, da0 = 0.0, 0.0, 0.0, 0.0
    for k in range(i + 1, j + 1):
        x, h = times[k] - times[i], times[k] - times[k - 1]
        d = c[0] + x * (c[1] + x * (c[2] + x * (c[3] + x * (c[4] + x * c[5])))) - q[k, row]
        dv = c[1] + x * (2.0 * c[2] + x * (3.0 * c[3] + x * (4.0 * c[4] + x * 5.0 * c[5])))
        dv -= v[k, row]
        if k == j:
            d = dv = 0.0
        most = max(most, abs(d))
        if is_quintic:
            da = 2.0 * c[2] + x * (6.0 * c[3] + x * (12.0 * c[4] + x * 20.0 * c[5])) - a[k, row]
            if k == j:
                da = 0.0
            most = max(most, abs(d0 + 0.2 * h * dv0), abs(d - 0.2 * h * dv))
            most = max(most, abs(d0 + h * (0.4 * dv0 + 0.05 * h * da0)))
            most = max(most, abs(d - h * (0.4 * dv - 0.05 * h * da)))
            da0 = da
        else:
            most = max(most, abs(d0 + h * dv0 / 3.0), abs(d - h * dv / 3.0))
        d0, dv0 = d, dv
    return most


@inlined_kernel
def _is_fast(points, i, j, row, limits, c, place):
    """Tell whether the polynomial is beyond a limit, by control points of its derivatives."""
    h, size = points[0][j] - points[0][i], len(c)
    for order in range(1, len(limits) + 1):
        size -= 1
        for k in range(size):
            c[k] = (k + 1) * c[k + 1]
        # From powers of time to Bernstein's basis of degree size - 1, of what differs from 0.
        for k in range(size):
            total, share, scale = 0.0, 1.0, 1.0
            for m in range(k + 1):
                total += share * c[m] * scale
                scale *= h
                share *= (k - m) / (size - 1 - m) if m < size - 1 else 0.0
            place[k] = total
        for k in range(size):
            if abs(place[k]) > limits[order - 1, row]:
                return True
    return False


@inlined_kernel
def _may_join(points, i, j, is_quintic, limits, tolerance, c, place):
    """Tell whether all points between two may be left out."""
    for row in range(points[1].shape[1]):
        _set_powers(points, i, j, row, is_quintic, c)
        if _differs(points, i, j, row, is_quintic, c) > tolerance:
            return False
        if _is_fast(points, i, j, row, limits, c, place):
            return False
    return True


@kernel
def keep_points(times, q, v, a, is_quintic, limits, tolerance, always, kept):
    """Mark points ``(m,)`` so that the curve through these is within a tolerance at all times.

    Positions, velocities and accelerations are ``(m, n)``; cubics run through points without the
    last. ``limits`` ``(o, n)`` are those of derivatives that no longer part exceeds. Points that
    are ``always`` there are kept. Each part is about as long as it may be. Return how many points
    are kept.
    """
    points = times, q, v, a
    m, c, place = len(times), np.empty(6), np.empty(6)
    kept[:] = False
    kept[0] = True
    i, count = 0, 1
    while i < m - 1:
        last = i + 1
        while last < m - 1 and not always[last]:
            last += 1
        # Twice as far each time, and between the two last by halves.
        good, step = i + 1, 1
        bad = last + 1
        while good < last:
            tried = min(good + step, last)
            if not _may_join(points, i, tried, is_quintic, limits, tolerance, c, place):
                bad = tried
                break
            good, step = tried, 2 * step
        while bad - good > 1:
            tried = (good + bad) // 2
            if _may_join(points, i, tried, is_quintic, limits, tolerance, c, place):
                good = tried
            else:
                bad = tried
        i = good
        kept[i] = True
        count += 1
    return count
