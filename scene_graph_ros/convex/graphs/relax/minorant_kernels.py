"""Lower bounds of edges' costs: their minorants.

As `bounds` says, for any multipliers; rounding is counted throughout.
"""

from __future__ import annotations

import math

import numpy as np

from scene_graph_ros.convex.graphs.expressions.packed_terms import (
    ATOMS,
    CONES,
    COORDINATES_U,
    COORDINATES_V,
    EDGE_HEAD,
    EDGE_ROWS,
    EQUATIONS,
    INEQUALITIES,
    NUMBERS,
    VARIABLES_U,
    VARIABLES_V,
)
from scene_graph_ros.convex.graphs.expressions.term_kernels import shorten
from scene_graph_ros.convex.graphs.relax.edge_layout import (
    COLUMNS,
    FIRST_COORDINATE,
    FIRST_NUMBER,
    FIRST_WEIGHT,
    FIRST_WHOLE,
    lay_out_edges,
    SECOND_ORDER,
)
from scene_graph_ros.geometry.compiled.kernel import kernel, lean_kernel
from scene_graph_ros.geometry.tolerances import EPSILON

__all__ = ["add_minorant", "make_valid", "minorants_of_edges"]


@lean_kernel
def make_valid(head, y, is_cost):
    """Make an edge's multipliers such that they bound its cost, and return their error.

    That is: ``y . rows`` less the error is at most the cost wherever the constraints hold;
    without cost it is at most 0 there. Weights of matrices and exponential cones are so already.
    """
    atoms, cones, row, taken = head[ATOMS], head[CONES], 0, 0.0
    for a in range(atoms):
        kind, count = head[EDGE_HEAD + a], head[EDGE_HEAD + atoms + a]
        if is_cost:
            taken += shorten(kind, y, row, count)
        else:
            for i in range(count):
                y[row + i] = 0.0
        row += count
    y[row] = 1.0 if is_cost else 0.0
    row += 1 + head[EQUATIONS]
    for _ in range(head[INEQUALITIES]):
        y[row] = max(y[row], 0.0)
        row += 1
    for c in range(cones):
        size, kind = head[EDGE_HEAD + 2 * atoms + c], head[EDGE_HEAD + 2 * atoms + cones + c]
        if kind == SECOND_ORDER:
            square = 0.0
            for i in range(1, size):
                square += y[row + i] * y[row + i]
            # In the cone's dual for sure.
            length = math.sqrt(square) * (1.0 + 4.0 * size * EPSILON)
            y[row] = -max(-y[row], length)
        row += size
    return taken


@lean_kernel
def add_minorant(head, f, y, constant, firsts, D, off, totals):
    """Add an edge's minorant to slopes at coordinates, and its constant to the totals."""
    rows, nu, nv = head[EDGE_ROWS], head[COORDINATES_U], head[COORDINATES_V]
    at = 1 + rows * (head[VARIABLES_U] + head[VARIABLES_V])
    m = at + rows * (nu + nv)
    size, a = abs(constant), constant
    for i in range(rows):
        size += abs(y[i]) * f[m + rows + i]
        a += y[i] * f[m + i]
    rounding = 2.0 * (rows + nu + 8) * EPSILON
    totals[0] += a
    totals[1] += rounding * size
    totals[2] += abs(a)
    for end in range(2):
        n = nv if end else nu
        for j in range(n):
            slope, sizes = 0.0, 0.0
            for i in range(rows):
                entry = y[i] * f[at + i * n + j]
                slope += entry
                sizes += abs(entry)
            D[firsts[end] + j] += slope
            off[firsts[end] + j] += rounding * sizes
        at += rows * nu


@kernel
def minorants_of_edges(edges, numbers, count, weights, is_cost):
    """Return affine functions that are below the costs of so many edges, from rows' weights.

    For each edge its constant, its rounding, and its size, ``(count, 3)``; slopes
    of the points of its tail and of its head, less their centres, edge after edge, and their
    rounding; and the first indices of both, ``(count, 2)``. Weights ``(r,)`` are any, but for the
    conditions of `make_valid`.
    """
    table = np.zeros((count, COLUMNS), np.int64)
    of = lay_out_edges(edges, table)
    y, totals = weights.copy(), np.zeros((count, 3))
    D, off = np.zeros(of.coordinates), np.zeros(of.coordinates)
    firsts = np.zeros((count, 2), np.int64)
    for k in range(count):
        head, first = edges[table[k, FIRST_WHOLE] :], table[k, FIRST_NUMBER]
        f, mine = numbers[first : first + head[NUMBERS]], y[table[k, FIRST_WEIGHT] :]
        firsts[k, 0] = table[k, FIRST_COORDINATE]
        firsts[k, 1] = firsts[k, 0] + head[COORDINATES_U]
        taken = make_valid(head, mine, is_cost)
        add_minorant(head, f, mine, -taken, (firsts[k, 0], firsts[k, 1]), D, off, totals[k])
    return totals, D, off, firsts
