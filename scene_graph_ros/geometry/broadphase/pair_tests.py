"""Which two rows may form a pair, and whether their boxes come near: shared by all searches."""

from scene_graph_ros.geometry.broadphase.box_vectors import CORNER
from scene_graph_ros.geometry.compiled.kernel import inlined_kernel
from scene_graph_ros.geometry.compiled.lanes import larger, load_four
from scene_graph_ros.geometry.tolerances import BOX_ROUNDING

__all__ = [
    "box_reaches_half_space",
    "boxes_are_near",
    "is_pair_wanted",
    "square_of_gap",
    "square_within",
]


@inlined_kernel
def is_pair_wanted(frame, filter_bits, i, j):
    """Tell whether rows i and j may be reported.

    Rows of one frame never are, and so neither are two anchored ones, whose frame is the world.
    ``filter_bits`` has bit j & 7 of byte j >> 3 of row i set for an excluded pair; an array
    without rows excludes nothing.
    """
    if frame[i] == frame[j]:
        return False
    return len(filter_bits) == 0 or (filter_bits[i, j >> 3] >> (j & 7)) & 1 == 0


@inlined_kernel
def square_within(margin):
    """Return the square of a distance that, rounded, is still one of at most ``margin``."""
    return margin * margin * (1.0 + BOX_ROUNDING)


@inlined_kernel
def square_of_gap(lower, upper, i, j):
    """Return the square of the distance of two boxes, rows of (n, 4) corners (m^2).

    All axes of the world are taken at a time.
    """
    low_i, high_i = load_four(lower, i * CORNER), load_four(upper, i * CORNER)
    low_j, high_j = load_four(lower, j * CORNER), load_four(upper, j * CORNER)
    gap = larger(larger(low_i - high_j, low_j - high_i), 0.0)
    squares = gap * gap
    return squares[0] + squares[1] + squares[2]


@inlined_kernel
def boxes_are_near(lower, upper, i, j, margin):
    """Tell whether the boxes of rows i and j are at most ``margin`` apart (Euclidean)."""
    x = max(lower[i, 0] - upper[j, 0], lower[j, 0] - upper[i, 0], 0.0)
    y = max(lower[i, 1] - upper[j, 1], lower[j, 1] - upper[i, 1], 0.0)
    z = max(lower[i, 2] - upper[j, 2], lower[j, 2] - upper[i, 2], 0.0)
    return x * x + y * y + z * z <= square_within(margin)


@inlined_kernel
def box_reaches_half_space(lower, upper, i, X_WG, h, margin):
    """Tell whether the box of row i comes within ``margin`` of the half space of row h."""
    height = 0.0
    scale = 0.0
    for axis in range(3):
        nz = X_WG[h, axis, 2]
        corner = lower[i, axis] if nz > 0.0 else upper[i, axis]
        if nz != 0.0:
            height += nz * (corner - X_WG[h, axis, 3])
            scale += abs(nz) * (abs(corner) + abs(X_WG[h, axis, 3]))
    return height <= margin + BOX_ROUNDING * scale
