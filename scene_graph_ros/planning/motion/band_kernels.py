"""Systems of equations whose matrix is a band, compiled."""

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel
from scene_graph_ros.geometry.compiled.lanes import LANES, load_lanes, store_lanes

__all__ = ["solve_band"]


@inlined_kernel
def solve_band(band, width, right, shares, inverses):
    """Solve a symmetric positive definite system for two right sides ``(2, n)``, in place.

    ``band`` ``(n, at least width + LANES)`` has the diagonal and what is right of it in each row:
    column s of row p is entry (p, p + s). It is 0 from column ``width`` on, and beyond the matrix.
    By L D L^T, row by row (Golub and Van Loan, *Matrix Computations*, 2013, section 4.3); the band
    becomes D L^T. ``shares`` ``(width,)`` and ``inverses`` ``(n,)`` are scratch.
    """
    n, stride = band.shape
    for row in range(n):
        first = max(0, row - width + 1)
        for p in range(first, row):
            share = band[p, row - p] * inverses[p]
            shares[p - first] = share
            right[0, row] -= share * right[0, p]
            right[1, row] -= share * right[1, p]
        for s in range(0, width, LANES):
            total = load_lanes(band, row * stride + s)
            for p in range(max(first, row + s - width + 1), row):
                total = total - shares[p - first] * load_lanes(band, p * stride + row - p + s)
            store_lanes(band, row * stride + s, total)
        inverses[row] = 1.0 / band[row, 0]
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
