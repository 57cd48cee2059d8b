"""Random walks in a polyhedron: hit and run (Smith 1984), which mixes in polynomial time.

Lovasz, "Hit-and-run mixes fast", Mathematical Programming 86, 1999.
"""

from __future__ import annotations

from scene_graph_ros.geometry.compiled.kernel import kernel

__all__ = ["hit_and_run", "walk_along_axes"]


@kernel
def hit_and_run(A, slack, slopes, directions, shares, step):
    """Take a step for each direction; return False where the set does not end along one.

    ``slack (m,)`` is b - A x and is kept up to date, ``slopes (s, m)`` is A times the
    ``directions (s, n)``, ``shares (s,)`` are random between 0 and 1. ``step (n,)`` adds up how
    far the walk went.
    """
    for s in range(len(directions)):
        low, high = -1e300, 1e300
        for i in range(len(slack)):
            rate = slopes[s, i]
            if rate > 0.0:
                high = min(high, max(slack[i], 0.0) / rate)
            elif rate < 0.0:
                low = max(low, max(slack[i], 0.0) / rate)
        if low == -1e300 or high == 1e300:
            return False
        way = low + shares[s] * (high - low)
        for i in range(len(slack)):
            slack[i] -= way * slopes[s, i]
        for k in range(len(step)):
            step[k] += way * directions[s, k]
    return True


@kernel
def walk_along_axes(columns, slacks, points, places, shares):
    """Take a step along an axis for each number of ``places (s, c)``, with all c chains.

    ``columns (n, m)`` are those of the rows, ``slacks (c, m)`` and ``points (c, n)`` are kept up
    to date, ``shares (s, c)`` are random between 0 and 1. False where the set does not end.
    """
    for s in range(len(places)):
        for c in range(len(points)):
            k = places[s, c]
            low, high = -1e300, 1e300
            for i in range(slacks.shape[1]):
                rate = columns[k, i]
                if rate > 0.0:
                    high = min(high, max(slacks[c, i], 0.0) / rate)
                elif rate < 0.0:
                    low = max(low, max(slacks[c, i], 0.0) / rate)
            if low == -1e300 or high == 1e300:
                return False
            way = low + shares[s, c] * (high - low)
            for i in range(slacks.shape[1]):
                slacks[c, i] -= way * columns[k, i]
            points[c, k] += way
    return True
