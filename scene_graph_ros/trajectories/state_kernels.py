"""States of motions along paths: at nodes, and evenly between, compiled."""

import math

import numpy as np

from scene_graph_ros.geometry.compiled.kernel import kernel
from scene_graph_ros.trajectories.curve_kernels import write_derivatives

__all__ = ["write_averaged", "write_evened", "write_passed", "write_states"]

_NOT_SLOWER = 1.5
"""Times the mean of the speeds that accelerations allow: what speeds are at least."""


@kernel
def write_states(breaks, control, states, late, factor, q, v, a):
    """Write positions and two derivatives ``(m, n)`` of a motion near its nodes, so much slower.

    ``states`` are `PathStates` along the curve of degree 3 or above; points are ``late`` ``(m,)``
    (s) by less than a nanosecond, where Taylor's polynomial is more exact than quintics.
    """
    times, s, speeds, changes = states
    m, n = q.shape
    at, own = np.empty(m), np.empty((2, m))
    for i in range(m):
        before, after = max(i - 1, 0), min(i + 1, m - 1)
        jerk = (changes[after] - changes[before]) / (times[after] - times[before])
        x = late[i]
        at[i] = s[i] + x * (speeds[i] + 0.5 * x * changes[i])
        own[0, i] = speeds[i] + x * (changes[i] + 0.5 * x * jerk)
        own[1, i] = changes[i] + x * jerk
    along = np.empty((4, m, n))
    write_derivatives(breaks, control, at, along)
    for i in range(m):
        speed, change = own[0, i], own[1, i]
        for j in range(n):
            q[i, j] = along[0, i, j]
            v[i, j] = along[1, i, j] * speed / factor
            a[i, j] = along[2, i, j] * speed * speed + along[1, i, j] * change
            a[i, j] /= factor * factor


@kernel
def write_evened(states, out):
    """Write rows s, its speed and its acceleration ``(3, m)`` evenly in time.

    They are on the quintics through those of `PathStates`; s grows from its first to its last.
    """
    times, s, speeds, changes = states
    last, m = len(times) - 1, out.shape[1]
    k, most = 0, s[0]
    for i in range(m):
        if i == 0 or i == m - 1:
            end = 0 if i == 0 else last
            out[0, i], out[1, i], out[2, i] = s[end], speeds[end], changes[end]
            continue
        t = times[last] * (i / (m - 1))
        while k < last - 1 and times[k + 1] <= t:
            k += 1
        h = times[k + 1] - times[k]
        x = (t - times[k]) / h
        # The quintic from its start, in powers of x.
        v0, a0 = h * speeds[k], 0.5 * h * h * changes[k]
        d = s[k + 1] - s[k] - v0 - a0
        dv = h * speeds[k + 1] - v0 - 2.0 * a0
        da = h * h * changes[k + 1] - 2.0 * a0
        c3, c4, c5 = (
            10.0 * d - 4.0 * dv + 0.5 * da,
            -15.0 * d + 7.0 * dv - da,
            6.0 * d - 3.0 * dv + 0.5 * da,
        )
        place = s[k] + x * (v0 + x * (a0 + x * (c3 + x * (c4 + x * c5))))
        most = max(most, min(place, s[last]))
        out[0, i] = most
        speed = v0 + x * (2.0 * a0 + x * (3.0 * c3 + x * (4.0 * c4 + x * 5.0 * c5)))
        out[1, i] = speed / h
        out[2, i] = (2.0 * a0 + x * (6.0 * c3 + x * (12.0 * c4 + x * 20.0 * c5))) / (h * h)


@kernel
def write_averaged(s, times, ramp, out):
    """Write rows s, its speed and its acceleration ``(3, m)`` of a motion's mean, evenly in time.

    The motion is even between ``times`` ``(n,)``, and at rest before and after; its mean is that
    over twice a ``ramp`` (s): a B-spline's, of degree 1, whose derivatives are differences of its
    integrals.
    """
    n, m = len(s), out.shape[1]
    once, twice = np.zeros(n), np.zeros(n)
    for k in range(n - 1):
        h = times[k + 1] - times[k]
        once[k + 1] = once[k] + 0.5 * h * (s[k + 1] + s[k])
        twice[k + 1] = twice[k] + h * once[k] + h * h * (2.0 * s[k] + s[k + 1]) / 6.0
    last = times[n - 1]
    ks, values = np.zeros(3, dtype=np.int64), np.empty((3, 3))
    most = s[0]
    for i in range(m):
        middle = -ramp + (last + 2.0 * ramp) * (i / (m - 1))
        for side in range(3):
            at = middle + (side - 1) * ramp
            inside = min(max(at, 0.0), last)
            k = ks[side]
            while k < n - 2 and times[k + 1] <= inside:
                k += 1
            ks[side] = k
            x, beyond = inside - times[k], at - inside
            slope = (s[k + 1] - s[k]) / (times[k + 1] - times[k])
            own = s[k] + slope * x
            first = once[k] + x * (s[k] + 0.5 * slope * x)
            second = twice[k] + x * (once[k] + x * (0.5 * s[k] + slope * x / 6.0))
            values[0, side] = second + beyond * (first + 0.5 * beyond * own)
            values[1, side] = first + beyond * own
            values[2, side] = own
        for row in range(3):
            out[row, i] = (values[row, 2] - 2.0 * values[row, 1] + values[row, 0]) / (ramp * ramp)
        most = max(most, min(out[0, i], s[n - 1]))
        out[0, i], out[1, i] = most, max(out[1, i], 0.0)
    out[0, 0], out[0, m - 1] = s[0], s[n - 1]
    for end in (0, m - 1):
        out[1, end] = out[2, end] = 0.0


@kernel
def write_passed(s, speeds, changes, times):
    """Write when places ``(n,)`` are passed, s, at speeds that are even between two of them.

    They are at most ``speeds`` ``(n - 1,)``, and what ``changes`` ``(n - 1,)`` of the speed allow
    from rest to rest, or half as much again as the mean of that: so it does not begin slowly.
    """
    n = len(s)
    squares = np.zeros(n)
    for k in range(1, n - 1):
        most = min(speeds[k - 1], speeds[k])
        squares[k] = min(most * most, squares[k - 1] + 2.0 * changes[k - 1] * (s[k] - s[k - 1]))
    duration = 0.0
    for k in range(n - 2, -1, -1):
        way = s[k + 1] - s[k]
        if k > 0:
            squares[k] = min(squares[k], squares[k + 1] + 2.0 * changes[k] * way)
        duration += 2.0 * way / (math.sqrt(squares[k]) + math.sqrt(squares[k + 1]))
    mean = (s[n - 1] - s[0]) / duration
    times[0] = 0.0
    for k in range(n - 1):
        own = 0.5 * (math.sqrt(squares[k]) + math.sqrt(squares[k + 1]))
        times[k + 1] = times[k] + (s[k + 1] - s[k]) / min(max(own, _NOT_SLOWER * mean), speeds[k])
