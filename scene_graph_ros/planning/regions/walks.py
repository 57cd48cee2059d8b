"""Points of a polyhedron for many walks at once: hit and run (Smith 1984)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.compiled.kernel import kernel
from scene_graph_ros.planning.regions.errors import RegionError

__all__ = ["walked"]

_AT_ONCE = 1 << 21
"""Numbers of directions that are drawn at a time: 16 MB."""


def walked(
    A: NDArray[np.float64],
    b: NDArray[np.float64],
    starts: NDArray[np.float64],
    steps: int,
    shape: NDArray[np.float64],
    generator: np.random.Generator,
) -> NDArray[np.float64]:
    """Return where walks of some steps from each of ``starts (k, n)`` end, ``(k, n)``.

    In the bounded set ``A x <= b``. Directions are uniform where an ellipsoid like the set,
    ``{shape u}``, is a ball: thin sets are crossed as fast as round ones.
    """
    k, n = starts.shape
    ends = starts.copy()
    share = max(1, _AT_ONCE // max(1, steps * n))
    for first in range(0, k, share):
        part = ends[first : first + share]
        directions = generator.normal(size=(len(part), steps, n)) @ shape.T
        ratios = generator.random((len(part), steps))
        if not _walk(np.ascontiguousarray(A.T), b, part, directions, ratios):
            raise RegionError("the domain is unbounded; intersect it with a box")
    return ends


@kernel
def _chord(slack, rates, ways):
    """Return how far it is to the ends along a direction in which rows lose ``rates (m,)``."""
    low, high = -1e300, 1e300
    for i in range(len(slack)):
        ways[i] = slack[i] / rates[i]
    for i in range(len(slack)):
        if rates[i] > 0.0:
            high = min(high, ways[i])
        elif rates[i] < 0.0:
            low = max(low, ways[i])
    return low, high


@kernel
def _walk(columns, b, x, directions, ratios):
    """Move all of ``x (k, n)``; return False where the set does not end in a direction.

    ``columns (n, m)`` are those of A: so the innermost loops are over neighbours in memory.
    """
    n, m = columns.shape
    slack, rates, ways = np.empty(m), np.empty(m), np.empty(m)
    for row in range(len(x)):
        slack[:] = b
        for j in range(n):
            for i in range(m):
                slack[i] -= columns[j, i] * x[row, j]
        for i in range(m):
            slack[i] = max(slack[i], 0.0)
        for s in range(directions.shape[1]):
            rates[:] = 0.0
            for j in range(n):
                along = directions[row, s, j]
                for i in range(m):
                    rates[i] += columns[j, i] * along
            low, high = _chord(slack, rates, ways)
            if low == -1e300 or high == 1e300:
                return False
            way = low + ratios[row, s] * (high - low)
            for i in range(m):
                slack[i] = max(slack[i] - way * rates[i], 0.0)
            for j in range(n):
                x[row, j] += way * directions[row, s, j]
    return True
