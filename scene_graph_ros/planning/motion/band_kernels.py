"""Systems of equations whose matrix is a band, compiled."""

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel
from scene_graph_ros.geometry.compiled.lanes import LANES, load_lanes, store_lanes

__all__ = ["solve_band"]


@inlined_kernel
def solve_band(band, width, right, inverses):
    """Solve a symmetric positive definite system for two right sides ``(2, n)``, in place.

    ``band`` ``(n, at least width + LANES)`` has the diagonal and what is right of it in each row:
    column s of row p is entry (p, p + s). It is 0 from column ``width`` on, and beyond the matrix.
    By L D L^T, row by row (Golub and Van Loan, *Matrix Computations*, 2013, section 4.3); the band
    becomes D L^T. ``inverses`` ``(n,)`` is scratch. Each row is subtracted from all that follow,
    so that no subtraction waits for the one before.
    """
    n, stride = band.shape
    for p in range(n):
        inverse = 1.0 / band[p, 0]
        inverses[p] = inverse
        first, second = right[0, p], right[1, p]
        for away in range(1, min(width, n - p)):
            row, share = p + away, band[p, away] * inverse
            right[0, row] -= share * first
            right[1, row] -= share * second
            for s in range(0, width - away, LANES):
                own = load_lanes(band, row * stride + s)
                store_lanes(
                    band, row * stride + s, own - share * load_lanes(band, p * stride + away + s)
                )
    for row in range(n - 1, -1, -1):
        for side in range(2):
            # Two sums, which do not wait for each other.
            even, odd, s = right[side, row], 0.0, 1
            end = min(width, n - row)
            while s + 1 < end:
                even -= band[row, s] * right[side, row + s]
                odd -= band[row, s + 1] * right[side, row + s + 1]
                s += 2
            if s < end:
                even -= band[row, s] * right[side, row + s]
            right[side, row] = (even + odd) * inverses[row]
