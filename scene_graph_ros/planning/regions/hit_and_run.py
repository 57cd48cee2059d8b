"""Points of a polyhedron for many walks at once: hit and run (Smith 1984), eight in lanes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.compiled.kernel import kernel
from scene_graph_ros.geometry.compiled.lanes import (
    any_of,
    every,
    LANES,
    larger,
    load_lanes,
    select,
    smaller,
    store_lanes,
)
from scene_graph_ros.planning.regions.errors import RegionError

__all__ = ["walked"]

_AT_ONCE = 1 << 18
"""Numbers of directions that are drawn at a time: 2 MB."""

_FAR = 1e300
"""Where a walk would be that nothing ends."""


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
    blocks = -(-k // LANES)
    x = np.empty((blocks, n, LANES))
    rows = np.minimum(np.arange(blocks * LANES), k - 1).reshape(blocks, LANES)
    x[:] = starts[rows].transpose(0, 2, 1)
    A, b, shape = (np.ascontiguousarray(each, dtype=np.float64) for each in (A, b, shape))
    share = max(1, _AT_ONCE // max(1, steps * n * LANES))
    for first in range(0, blocks, share):
        part = x[first : first + share]
        directions = generator.standard_normal((len(part), steps, n, LANES))
        ratios = generator.random((len(part), steps, LANES))
        if not _walk(A, b, part, shape, directions, ratios):
            raise RegionError("the domain is unbounded; intersect it with a box")
    return np.ascontiguousarray(x.transpose(0, 2, 1).reshape(-1, n)[:k])


@kernel
def _slacks(A, b, x, first, slack):
    """Write how far eight points ``(n, 8)``, at a place of x, are from each row, at least 0."""
    m, n = A.shape
    for i in range(m):
        left = every(b[i])
        for j in range(n):
            left = left - A[i, j] * load_lanes(x, first + j * LANES)
        store_lanes(slack, i * LANES, larger(left, every(0.0)))


@kernel
def _turned(shape, directions, first, ways):
    """Write eight directions ``(n, 8)``, those at a place times the shape ``(n, n)``."""
    n = len(shape)
    for i in range(n):
        way = every(0.0)
        for j in range(n):
            way = way + shape[i, j] * load_lanes(directions, first + j * LANES)
        store_lanes(ways, i * LANES, way)


@kernel
def _chords(A, ways, slack, rates):
    """Return how far it is to both ends along eight ways, and write what rows lose."""
    m, n = A.shape
    low, high = every(-_FAR), every(_FAR)
    for i in range(m):
        rate = every(0.0)
        for j in range(n):
            rate = rate + A[i, j] * load_lanes(ways, j * LANES)
        store_lanes(rates, i * LANES, rate)
        end = load_lanes(slack, i * LANES) / rate
        high = select(rate > 0.0, smaller(end, high), high)
        low = select(rate < 0.0, larger(end, low), low)
    return low, high


@kernel
def _walk(A, b, x, shape, directions, ratios):
    """Move all of ``x (k, n, 8)``; return False where the set does not end in a direction."""
    m, n = A.shape
    steps = directions.shape[1]
    slack, rates, ways = np.empty(m * LANES), np.empty(m * LANES), np.empty(n * LANES)
    for block in range(len(x)):
        place = block * n * LANES
        _slacks(A, b, x, place, slack)
        for s in range(steps):
            step = block * steps + s
            _turned(shape, directions, step * n * LANES, ways)
            low, high = _chords(A, ways, slack, rates)
            if any_of(low <= -_FAR) or any_of(high >= _FAR):
                return False
            far = low + load_lanes(ratios, step * LANES) * (high - low)
            for i in range(m):
                left = load_lanes(slack, i * LANES) - far * load_lanes(rates, i * LANES)
                store_lanes(slack, i * LANES, larger(left, every(0.0)))
            for j in range(n):
                at = place + j * LANES
                store_lanes(x, at, load_lanes(x, at) + far * load_lanes(ways, j * LANES))
    return True
