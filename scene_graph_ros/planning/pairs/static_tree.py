"""A tree of balls around the bodies that do not move, to find those that are near to a robot's.

Balls hold balls (Quinlan, *Efficient Distance Computation between Non-Convex Objects*, 1994). A
node is followed by its descendants, and knows the row that comes after that.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

__all__ = ["FEWEST", "StaticNodes", "no_nodes", "static_nodes"]

FEWEST = 32
"""Bodies that a tree is worth: fewer are looked at one by one as fast."""

_ROUNDING = 1.0 + 1e-12
"""Times radii: far more than rounding takes off them."""


class StaticNodes(NamedTuple):
    """The nodes of a tree, none where it is not worth it."""

    centers: NDArray[np.float64]
    """``(n, 3)`` in W."""
    radii: NDArray[np.float64]
    """``(n,)``."""
    skips: NDArray[np.int64]
    """``(n,)``: the row after all that is below."""
    bodies: NDArray[np.int64]
    """``(n,)``: the body of a leaf, else -1."""


def no_nodes() -> StaticNodes:
    """Return a tree of nothing."""
    rows = np.empty(0, np.int64)
    return StaticNodes(np.empty((0, 3)), np.empty(0), rows, rows)


class _Shape(NamedTuple):
    """The structure of a tree of so many bodies, at any poses."""

    skips: NDArray[np.int64]
    leaves: NDArray[np.int64]
    """``(m,)``: the row of each body's leaf, in the order of leaves."""
    levels: tuple[tuple[NDArray[np.int64], NDArray[np.int64]], ...]
    """Of each level rows of nodes, and where their bodies begin, in the order of leaves."""


def static_nodes(
    bodies: NDArray[np.int64], centers: NDArray[np.float64], radii: NDArray[np.float64]
) -> StaticNodes:
    """Return the tree of bodies ``(m,)`` with balls around them, ``(m, 3)`` in W and ``(m,)``."""
    count = len(bodies)
    if count < FEWEST:
        return no_nodes()
    shape = _shape(count)
    order = np.arange(count)
    for _, starts in shape.levels:
        order = order[_along_widest_axes(centers[order], starts)]
    C, R = centers[order], radii[order]
    nodes = StaticNodes(
        np.empty((len(shape.skips), 3)),
        np.empty(len(shape.skips)),
        shape.skips,
        np.full(len(shape.skips), -1),
    )
    for rows, starts in shape.levels:
        sizes = np.diff(starts, append=count)
        lower = np.minimum.reduceat(C - R[:, np.newaxis], starts)
        upper = np.maximum.reduceat(C + R[:, np.newaxis], starts)
        middles = 0.5 * (lower + upper)
        out = np.linalg.norm(C - np.repeat(middles, sizes, axis=0), axis=1) + R
        nodes.centers[rows], nodes.radii[rows] = middles, np.maximum.reduceat(out, starts)
    nodes.centers[shape.leaves], nodes.radii[shape.leaves] = C, R
    nodes.bodies[shape.leaves] = bodies[order]
    return nodes._replace(radii=nodes.radii * _ROUNDING)


def _along_widest_axes(
    centers: NDArray[np.float64], starts: NDArray[np.int64]
) -> NDArray[np.int64]:
    """Return the order in which each part of the bodies is sorted along its widest axis."""
    sizes = np.diff(starts, append=len(centers))
    widths = np.maximum.reduceat(centers, starts) - np.minimum.reduceat(centers, starts)
    axes = np.repeat(widths.argmax(axis=1), sizes)
    parts = np.repeat(np.arange(len(starts)), sizes)
    along = np.take_along_axis(centers, axes[:, np.newaxis], axis=1)[:, 0]
    return np.lexsort((along, parts))


@lru_cache(maxsize=16)
def _shape(count: int) -> _Shape:
    """Return the shape of a tree that halves its bodies until one is left."""
    skips: list[int] = []
    leaves = np.empty(count, np.int64)
    levels: list[list[tuple[int, int]]] = []

    def grow(first: int, last: int, depth: int) -> None:
        row = len(skips)
        skips.append(row)
        if len(levels) == depth:
            levels.append([])
        levels[depth].append((row, first))
        if last - first == 1:
            leaves[first] = row
        else:
            middle = (first + last) // 2
            grow(first, middle, depth + 1)
            grow(middle, last, depth + 1)
        skips[row] = len(skips)

    grow(0, count, 0)
    # Where some halves have one body and others two, the last level does not hold all of them.
    whole = [np.array(level, np.int64).T for level in levels]
    depth = len(levels) - (len(levels[-1]) < count)
    return _Shape(
        np.array(skips, np.int64), leaves, tuple((rows, starts) for rows, starts in whole[:depth])
    )
