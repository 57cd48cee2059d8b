"""Entries of sparse matrices, from blocks and into columns."""

from __future__ import annotations

import numpy as np

from scene_graph_ros.geometry.compiled.kernel import kernel

__all__ = ["compress_columns", "entries_of_blocks"]


@kernel
def entries_of_blocks(columns, blocks):
    """Return the rows, columns and values ``(e,)`` of what is not 0 in G blocks, below each other.

    ``columns`` are ``(G, k)`` and ``blocks`` ``(G, m, k)``.
    """
    G, m, k = blocks.shape
    count = 0
    for g in range(G):
        for i in range(m):
            for j in range(k):
                count += blocks[g, i, j] != 0.0
    rows, found, values = np.zeros(count, np.int64), np.zeros(count, np.int64), np.zeros(count)
    at = 0
    for g in range(G):
        for i in range(m):
            for j in range(k):
                if blocks[g, i, j] != 0.0:
                    rows[at], found[at], values[at] = g * m + i, columns[g, j], blocks[g, i, j]
                    at += 1
    return rows, found, values


@kernel
def compress_columns(rows, columns, values, num_rows, num_columns):
    """Return a matrix's entries ``(e,)`` by columns: values, rows, and where each begins.

    In order of the rows; those of one place are added up.
    """
    first = np.zeros(num_rows + 1, np.int64)
    for r in rows:
        first[r + 1] += 1
    for r in range(num_rows):
        first[r + 1] += first[r]
    by_rows = np.zeros(len(rows), np.int64)
    for e in range(len(rows)):
        by_rows[first[rows[e]]] = e
        first[rows[e]] += 1
    begin, last = np.zeros(num_columns + 1, np.int32), np.full(num_columns, -1)
    for e in by_rows:
        if last[columns[e]] != rows[e]:
            last[columns[e]] = rows[e]
            begin[columns[e] + 1] += 1
    for c in range(num_columns):
        begin[c + 1] += begin[c]
    places, sums, at = np.zeros(begin[-1], np.int32), np.zeros(begin[-1]), begin[:-1].copy()
    last[:] = -1
    for e in by_rows:
        c = columns[e]
        if last[c] != rows[e]:
            last[c] = rows[e]
            places[at[c]] = rows[e]
            at[c] += 1
        sums[at[c] - 1] += values[e]
    return sums, places, begin
