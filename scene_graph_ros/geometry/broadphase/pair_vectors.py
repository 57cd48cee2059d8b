"""How near two boxes are, all axes of the world at a time."""

import numpy as np

from scene_graph_ros.geometry.broadphase.box_vectors import CORNER
from scene_graph_ros.geometry.compiled.code import ARRAY, generated, NUMBER, PLACE

__all__ = ["square_of_gap"]


def _square_plainly(lower, upper, i, j):
    gap = np.maximum(np.maximum(lower[i] - upper[j], lower[j] - upper[i])[:3], 0.0)
    return float(gap @ gap)


@generated(ARRAY, ARRAY, PLACE, PLACE, plain=_square_plainly, returns=NUMBER)
def square_of_gap(code, lower, upper, i, j):
    """Return the square of the distance of two boxes, rows of (n, 4) corners (m^2)."""
    low_i, high_i, low_j, high_j = [
        corners.vector(row * CORNER, CORNER) for row in (i, j) for corners in (lower, upper)
    ]
    gap = code.larger(low_i - high_j, low_j - high_i)
    gap = code.larger(gap, code.numbers(*[0.0] * CORNER))
    squares = gap * gap
    return code.sum([squares[axis] for axis in range(3)])
