"""Random walks in a polyhedron: hit and run (Smith 1984), which mixes in polynomial time.

Lovasz, "Hit-and-run mixes fast", Mathematical Programming 86, 1999.
"""

from __future__ import annotations

from scene_graph_ros.geometry.compiled.kernel import kernel

__all__ = ["hit_and_run"]


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
