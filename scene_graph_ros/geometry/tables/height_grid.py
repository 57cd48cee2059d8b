"""Heights in rows and columns, and how high they are in blocks of 8 x 8 cells, for kernels.

Blocks of blocks, and so on, make a pyramid with 1/63 of the numbers that the heights are: a
quadtree with eight children along each axis (compare Samet, *The Quadtree and Related Hierarchical
Data Structures*, 1984), in which nothing but the place says where a block is.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel
from scene_graph_ros.geometry.compiled.lanes import LANES
from scene_graph_ros.geometry.tables.holding import Holding

__all__ = [
    "FLOOR",
    "SIZE_X",
    "SIZE_Y",
    "HeightGrid",
    "PlacedHeights",
    "borrowed_heights",
    "grid_heights_again",
    "place_heights",
    "x_of",
    "y_of",
]

FloatArray = NDArray[np.float64]

SIZE_X = 0
SIZE_Y = 1
FLOOR = 2
"""Where a grid's numbers are."""


class HeightGrid(NamedTuple):
    """What kernels read of heights; level 0 are the cells, level 1 blocks of 8 x 8 of them."""

    heights: np.ndarray
    """``(rows cols + LANES,)`` m, row by row; the last LANES are there to be loaded."""
    tops: np.ndarray
    """``(nodes + LANES,)`` m: the largest height of each block, level by level from 1 on."""
    starts: np.ndarray
    """``(levels + 1,)`` int64: the first node of each level from 1 on, and how many there are."""
    counts: np.ndarray
    """``(levels + 1, 2)`` int64: rows and columns of nodes of each level; the last has one."""
    numbers: np.ndarray
    """``(3,)`` m: the lengths along x and y, and z of the floor."""


class PlacedHeights(NamedTuple):
    """A grid and where its arrays are."""

    grid: HeightGrid
    places: Any
    """What ``borrowed_heights`` takes; right as long as the grid lives."""

    @property
    def num_elements(self) -> int:
        """How many prisms there are."""
        return 2 * int(self.grid.counts[0].prod())

    def heights(self) -> FloatArray:
        """Return the heights ``(rows, cols)``, in m: a view of them."""
        rows, cols = self.grid.counts[0] + 1
        return self.grid.heights[: rows * cols].reshape(rows, cols)

    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """Return the lower and upper corner ``(3,)`` of the box around it, in m."""
        half = 0.5 * self.grid.numbers[:2]
        top = self.grid.tops[self.grid.starts[-1] - 1]
        return np.array([*-half, self.grid.numbers[FLOOR]]), np.array([*half, top])


@inlined_kernel
def x_of(grid, j):
    """Return the x (m) of a column of heights, a number or lanes."""
    return (j / np.float64(grid.counts[0, 1]) - 0.5) * grid.numbers[SIZE_X]


@inlined_kernel
def y_of(grid, i):
    """Return the y (m) of a row of heights."""
    return (i / np.float64(grid.counts[0, 0]) - 0.5) * grid.numbers[SIZE_Y]


@inlined_kernel
def _top_of_cells(grid, i, j):
    """Return the largest height of the 8 x 8 cells of a block."""
    cols, heights = grid.counts[0, 1] + 1, grid.heights
    top = -np.inf
    for row in range(LANES * i, min(LANES * i + LANES, grid.counts[0, 0]) + 1):
        for col in range(LANES * j, min(LANES * j + LANES, grid.counts[0, 1]) + 1):
            top = max(top, heights[row * cols + col])
    return top


@lean_kernel
def _fill_tops(grid):
    """Write the largest heights of all blocks."""
    for level in range(1, len(grid.counts)):
        rows, cols = grid.counts[level, 0], grid.counts[level, 1]
        rows_below, cols_below = grid.counts[level - 1, 0], grid.counts[level - 1, 1]
        for i in range(rows):
            for j in range(cols):
                place = grid.starts[level - 1] + i * cols + j
                if level == 1:
                    grid.tops[place] = _top_of_cells(grid, i, j)
                    continue
                first, top = grid.starts[level - 2], -np.inf
                for row in range(LANES * i, min(LANES * i + LANES, rows_below)):
                    for col in range(LANES * j, min(LANES * j + LANES, cols_below)):
                        top = max(top, grid.tops[first + row * cols_below + col])
                grid.tops[place] = top


def _new_grid(shape: tuple[int, int], size: tuple[float, float], floor: float) -> HeightGrid:
    """Return a grid without heights."""
    counts = [(shape[0] - 1, shape[1] - 1)]
    while len(counts) == 1 or max(counts[-1]) > 1:
        counts.append((-(-counts[-1][0] // LANES), -(-counts[-1][1] // LANES)))
    nodes = [rows * cols for rows, cols in counts[1:]]
    starts = np.concatenate([[0], np.cumsum(nodes)]).astype(np.int64)
    return HeightGrid(
        np.empty(shape[0] * shape[1] + LANES),
        np.full(int(starts[-1]) + LANES, -np.inf),
        starts,
        np.array(counts, np.int64),
        np.array([*size, floor]),
    )


_holding = Holding("a grid of heights", lambda: _new_grid((2, 2), (1.0, 1.0), 0.0))
borrowed_heights = _holding.borrowed
"""Return, in a lean kernel, the grid that the ``places`` of PlacedHeights describe."""


def grid_heights_again(placed: PlacedHeights) -> PlacedHeights:
    """Return a grid with its places in this process, into which it was unpickled."""
    return placed._replace(places=_holding.places(placed.grid))


def place_heights(heights: FloatArray, size: tuple[float, float], floor: float) -> PlacedHeights:
    """Return heights ``(rows, cols)`` above a floor for kernels, all in m; checked before."""
    grid = _new_grid((heights.shape[0], heights.shape[1]), size, floor)
    grid.heights[: heights.size] = heights.reshape(-1)
    grid.heights[heights.size :] = floor
    _fill_tops(grid)
    return PlacedHeights(grid, _holding.places(grid))
