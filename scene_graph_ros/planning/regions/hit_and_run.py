"""Points of a polyhedron for many walks at once: hit and run along axes, eight in lanes.

Smith, "Efficient Monte Carlo procedures for generating points uniformly distributed over bounded
regions", Operations Research 32, 1984; along axes a step takes the time of the rows alone.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.compiled.kernel import kernel
from scene_graph_ros.geometry.compiled.lanes import (
    every,
    LANES,
    larger,
    load_lanes,
    smaller,
    store_lanes,
)
from scene_graph_ros.planning.regions.errors import RegionError

__all__ = ["walked"]

_NO_RATE = 1e-300
"""Of a row that ends no step: the inverse of a smaller one is more than floats can say."""

_AT_ONCE = 1 << 18
"""Shares of steps that are drawn at a time: 2 MB."""


def walked(
    A: NDArray[np.float64],
    b: NDArray[np.float64],
    starts: NDArray[np.float64],
    steps: int,
    shape: NDArray[np.float64],
    generator: np.random.Generator,
) -> NDArray[np.float64]:
    """Return the ends ``(k, n)`` of walks of some steps from each of ``starts (k, n)``.

    In the bounded set ``A x <= b``. Axes are drawn anew for all walks, uniformly where an
    ellipsoid like the set, ``{shape u}``, is a ball: thin sets are crossed as fast as round ones.
    Eight walks at a time take the same axes.
    """
    k, n = starts.shape
    if not n:
        return starts.copy()
    blocks = -(-k // LANES)
    x = np.empty((blocks, n, LANES))
    rows = np.minimum(np.arange(blocks * LANES), k - 1).reshape(blocks, LANES)
    x[:] = starts[rows].transpose(0, 2, 1)
    # Sets' own rows can't be written, which is another type to the compiler.
    A, b = (np.array(each, dtype=np.float64, order="C") for each in (A, b))
    axes, _ = np.linalg.qr(generator.standard_normal((n, n)))
    ways = np.ascontiguousarray((shape @ axes).T)
    rates = np.ascontiguousarray(ways @ A.T)
    rates[np.abs(rates) < _NO_RATE] = 0.0
    # Those that end a step forward, those along it, those that end it back.
    order = np.argsort(-np.sign(rates), axis=1, kind="stable")
    counts = np.column_stack([(rates > 0.0).sum(axis=1), (rates < 0.0).sum(axis=1)])
    if not counts.all():
        raise RegionError("the domain is unbounded; intersect it with a box")
    inverse = 1.0 / np.where(rates == 0.0, 1.0, rates)
    share = max(1, _AT_ONCE // max(1, steps * LANES))
    for first in range(0, blocks, share):
        part = x[first : first + share]
        chosen = generator.integers(n, size=(len(part), steps))
        shares = generator.random((len(part), steps, LANES))
        _walk(A, b, part, (ways, rates, inverse, order, counts), chosen, shares)
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
def _walk(A, b, x, along, chosen, shares):
    """Move all of ``x (k, n, 8)`` along chosen axes ``(k, s)``, by shares of the ways there.

    ``along`` are the axes ``(n, n)``, the rows' components along them ``(n, m)``, its inverse, the
    order of rows, and how many end a step forward and back ``(n, 2)``.
    """
    ways, rates, inverse, order, counts = along
    m, n = A.shape
    slack = np.empty(m * LANES)
    for block in range(len(x)):
        place = block * n * LANES
        _slacks(A, b, x, place, slack)
        for s in range(chosen.shape[1]):
            axis = chosen[block, s]
            rows, inverses, lost = order[axis], inverse[axis], rates[axis]
            high = load_lanes(slack, rows[0] * LANES) * inverses[rows[0]]
            for i in range(1, counts[axis, 0]):
                r = rows[i]
                high = smaller(load_lanes(slack, r * LANES) * inverses[r], high)
            low = load_lanes(slack, rows[m - 1] * LANES) * inverses[rows[m - 1]]
            for i in range(m - counts[axis, 1], m - 1):
                r = rows[i]
                low = larger(load_lanes(slack, r * LANES) * inverses[r], low)
            far = low + load_lanes(shares, (block * chosen.shape[1] + s) * LANES) * (high - low)
            for i in range(m):
                left = load_lanes(slack, i * LANES) - far * lost[i]
                store_lanes(slack, i * LANES, larger(left, every(0.0)))
            for j in range(n):
                at = place + j * LANES
                store_lanes(x, at, load_lanes(x, at) + far * ways[axis, j])
