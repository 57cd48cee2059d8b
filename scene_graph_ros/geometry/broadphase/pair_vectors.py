"""How near two boxes are, all axes of the world at a time."""

from scene_graph_ros.geometry.broadphase.box_vectors import CORNER
from scene_graph_ros.geometry.compiled.kernel import inlined_kernel
from scene_graph_ros.geometry.compiled.lanes import larger, load_four

__all__ = ["square_of_gap"]


@inlined_kernel
def square_of_gap(lower, upper, i, j):
    """Return the square of the distance of two boxes, rows of (n, 4) corners (m^2)."""
    low_i, high_i = load_four(lower, i * CORNER), load_four(upper, i * CORNER)
    low_j, high_j = load_four(lower, j * CORNER), load_four(upper, j * CORNER)
    gap = larger(larger(low_i - high_j, low_j - high_i), 0.0)
    squares = gap * gap
    return squares[0] + squares[1] + squares[2]
