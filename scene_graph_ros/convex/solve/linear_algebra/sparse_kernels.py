"""Sparse matrices by columns, from their entries."""

from __future__ import annotations

import numpy as np

from scene_graph_ros.geometry.compiled.kernel import kernel

__all__ = ["compress_columns", "products"]


@kernel
def compress_columns(rows, columns, values, num_rows, num_columns):
    """Return a matrix's entries ``(e,)`` by columns: values, rows, and where each begins.

    In order of the rows; those of one place are added up.
    """
    first = np.zeros(num_rows + 1, np.int64)
    for e in range(len(rows)):
        first[rows[e] + 1] += 1
    for r in range(num_rows):
        first[r + 1] += first[r]
    by_rows = np.zeros(len(rows), np.int64)
    for e in range(len(rows)):
        by_rows[first[rows[e]]] = e
        first[rows[e]] += 1
    begin, last = np.zeros(num_columns + 1, np.int32), np.full(num_columns, -1)
    for i in range(len(rows)):
        e = by_rows[i]
        if last[columns[e]] != rows[e]:
            last[columns[e]] = rows[e]
            begin[columns[e] + 1] += 1
    for c in range(num_columns):
        begin[c + 1] += begin[c]
    places, sums, at = np.zeros(begin[-1], np.int32), np.zeros(begin[-1]), begin[:-1].copy()
    last[:] = -1
    for i in range(len(rows)):
        e = by_rows[i]
        c = columns[e]
        if last[c] != rows[e]:
            last[c] = rows[e]
            places[at[c]] = rows[e]
            at[c] += 1
        sums[at[c] - 1] += values[e]
    return sums, places, begin


@kernel
def products(values, places, begin, x, z):
    """Return ``A x`` and ``A' z`` of a matrix by columns, as `compress_columns` has it."""
    along, across = np.zeros(len(z)), np.zeros(len(x))
    for c in range(len(x)):
        for e in range(begin[c], begin[c + 1]):
            along[places[e]] += values[e] * x[c]
            across[c] += values[e] * z[places[e]]
    return along, across
