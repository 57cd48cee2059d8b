"""The fastest way along a path under limits of velocity and acceleration: two passes, compiled.

Where a path q(s) is at s with the squared speed x = (ds/dt)^2, its acceleration is
``q' u + q'' x`` with u = d^2s/dt^2 = dx/ds / 2. Between two nodes u is constant. A pass backwards
finds the largest x at each node from which the end can still be reached within the limits; one
forwards goes as fast as these allow (Pham and Pham, *A New Approach to Time-Optimal Path
Parameterization Based on Reachability Analysis*, 2018, algorithm 1). Limits hold at both ends of
each stretch between nodes, which for paths of degree 2 means all of it: acceleration is linear in
s there.
"""

import math
from typing import NamedTuple

import numpy as np

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel

__all__ = ["Stretches", "fastest_squared_speeds"]

_BISECTIONS = 200
"""At most, for a squared speed; doubles end that before, unless it is next to 0."""

_CLOSE = 1e-15
"""Relative: squared speeds that are so near are one."""


class Stretches(NamedTuple):
    """The n stretches of a path between nodes, and the bounds of accelerations along them."""

    steps: np.ndarray
    """``(n,)``: how long they are, of s."""
    straight: np.ndarray
    """``(n,)``: whether they have no curvature."""
    rates: np.ndarray
    """``(n,)``: up to what |u| may be along the straight ones, and change."""
    first: np.ndarray
    """``(n, 2, j)``: q' at both ends."""
    second: np.ndarray
    """``(n, 2, j)``: q''."""
    limits: np.ndarray
    """``(j,)``: of accelerations."""


@inlined_kernel
def _rates(k, x, most, stretches):
    """Return the least and the largest u at node k with squared speed x; none where least > most.

    ``most`` is the largest squared speed at the next node.
    """
    h, limits = stretches.steps[k], stretches.limits
    low, high = -x / (2.0 * h), (most - x) / (2.0 * h)
    for j in range(len(limits)):
        limit = limits[j]
        for end in range(2):
            c, b = stretches.first[k, end, j], stretches.second[k, end, j]
            if end == 1:
                c += 2.0 * h * b  # x is x + 2 h u there
            b *= x
            if c > 0.0:
                low, high = max(low, (-limit - b) / c), min(high, (limit - b) / c)
            elif c < 0.0:
                low, high = max(low, (limit - b) / c), min(high, (-limit - b) / c)
            elif abs(b) > limit:
                return math.inf, -math.inf
    return low, high


@inlined_kernel
def _most_before(k, cap, most, stretches):
    """Return the largest squared speed at node k, up to ``cap``, from which a next one is within.

    Those are an interval from 0 on: standing still is always within the limits.
    """
    low, high = _rates(k, cap, most, stretches)
    if low <= high:
        return cap
    good, bad = 0.0, cap
    for _ in range(_BISECTIONS):
        if bad - good <= _CLOSE * good:
            break
        x = 0.5 * (good + bad)
        low, high = _rates(k, x, most, stretches)
        if low <= high:
            good = x
        else:
            bad = x
    return good


@lean_kernel
def fastest_squared_speeds(stretches, caps, most, x):
    """Write the squared speed at each of the nodes ``(n + 1,)`` of a path; ``most`` is scratch.

    Peaks along straight stretches are left to the caller. ``caps`` ``(n + 1,)`` are the largest
    squared speeds by the limits of velocity, 0 where it has to stop.
    """
    steps, straight, rates = stretches.steps, stretches.straight, stretches.rates
    n = len(steps)
    most[n] = caps[n]
    for k in range(n - 1, -1, -1):
        if straight[k]:
            most[k] = min(caps[k], most[k + 1] + 2.0 * rates[k] * steps[k])
        else:
            most[k] = _most_before(k, caps[k], most[k + 1], stretches)
    x[0] = most[0]
    for k in range(n):
        if straight[k]:
            x[k + 1] = min(most[k + 1], x[k] + 2.0 * rates[k] * steps[k])
        else:
            low, high = _rates(k, x[k], most[k + 1], stretches)
            # Rounding may leave an empty interval where there is a point.
            u = max(low, high) if low > high else high
            x[k + 1] = min(max(x[k] + 2.0 * steps[k] * u, 0.0), most[k + 1])
