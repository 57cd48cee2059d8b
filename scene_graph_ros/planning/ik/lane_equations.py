"""Small positive definite equations, eight at a time."""

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel
from scene_graph_ros.geometry.compiled.lanes import LANES, larger, load_lanes, store_lanes

__all__ = ["solve_in_place"]

_PIVOT = 1e-14
"""Relative to the diagonal's entry: a smaller pivot is rounding."""


@inlined_kernel
def solve_in_place(H, g, v, inverse, n):
    """Replace g ``(n, LANES)`` by the solution of ``H x = g``, by LDL^T in place."""
    for i in range(n):
        row = i * (i + 1) // 2
        pivot = load_lanes(H, (row + i) * LANES)
        least = _PIVOT * pivot
        y = load_lanes(g, i * LANES)
        for j in range(i):
            at = j * (j + 1) // 2
            total = load_lanes(H, (row + j) * LANES)
            for k in range(j):
                total = total - load_lanes(v, k * LANES) * load_lanes(H, (at + k) * LANES)
            store_lanes(v, j * LANES, total)
            entry = total * load_lanes(inverse, j * LANES)
            store_lanes(H, (row + j) * LANES, entry)
            pivot = pivot - total * entry
            y = y - entry * load_lanes(g, j * LANES)
        store_lanes(inverse, i * LANES, 1.0 / larger(pivot, least))
        store_lanes(g, i * LANES, y)
    for i in range(n - 1, -1, -1):
        y = load_lanes(g, i * LANES) * load_lanes(inverse, i * LANES)
        for k in range(i + 1, n):
            entry = load_lanes(H, (k * (k + 1) // 2 + i) * LANES)
            y = y - entry * load_lanes(g, k * LANES)
        store_lanes(g, i * LANES, y)
