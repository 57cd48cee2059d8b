"""What bounds a path's cost from below: minorants of its edges, and what its sets reach.

As `bounds` says, whatever the multipliers are; rounding is counted throughout.
"""

from __future__ import annotations

import math

from scene_graph_ros.geometry.compiled.kernel import lean_kernel
from scene_graph_ros.geometry.optimization.graphs.chain_layout import (
    FIRST_EQUATION,
    FIRST_IN_CONE,
    FIRST_ROW,
    rows_of_atom,
    size_of,
)
from scene_graph_ros.geometry.optimization.graphs.packed_terms import (
    AMBIENT,
    ATOMS,
    BY_CORNERS,
    CONES,
    COORDINATES_U,
    COORDINATES_V,
    EDGE_HEAD,
    EDGE_ROWS,
    EQUATIONS,
    INEQUALITIES,
    REACH,
    VARIABLES,
    VARIABLES_U,
    VARIABLES_V,
)
from scene_graph_ros.geometry.optimization.graphs.term_kernels import (
    NORM,
    NORM_INF,
    QUOTIENT,
    shorten,
)
from scene_graph_ros.geometry.tolerances import EPSILON

__all__ = ["add_minorant", "add_reach", "weights_of_rows"]


@lean_kernel
def _slopes_of_atom(kind, rows, most, z, r, unit, y):
    """Set the slopes ``y`` that an atom's multipliers stand for; ``rows`` are first, count."""
    row, count = rows
    if kind == NORM_INF:
        for i in range(count):
            y[row + i] = z[r + i] - z[r + count + i]
    elif kind == NORM:
        for i in range(count):
            y[row + i] = -z[r + 1 + i]
    elif kind == QUOTIENT:
        size = most[row] if most[row] > 0.0 else 1.0
        y[row] = -unit * (z[r] - z[r + 1]) / size
        for i in range(1, count):
            y[row + i] = -2.0 * math.sqrt(unit / size) * z[r + 1 + i]
    else:
        for i in range(count):
            y[row + i] = -2.0 * math.sqrt(unit) * z[r + 2 + i]


@lean_kernel
def weights_of_rows(head, f, edge, found, numbers, unit, y):
    """Set what an edge's rows weigh in a minorant of its cost, and return its constant.

    Whatever the multipliers ``found``, it is below the cost wherever the constraints hold.
    """
    x, z, at = found
    atoms, rows = head[ATOMS], head[EDGE_ROWS]
    most = f[len(f) - rows :]
    single, in_cone, row, constant = edge[FIRST_ROW], numbers + edge[FIRST_IN_CONE], 0, 0.0
    for a in range(atoms):
        kind, count = head[EDGE_HEAD + a], head[EDGE_HEAD + atoms + a]
        r = single if kind == NORM_INF else in_cone
        _slopes_of_atom(kind, (row, count), most, z, r, unit, y)
        constant -= shorten(kind, y, row, count)
        taken = rows_of_atom(kind, count)
        single += taken[0]
        in_cone += taken[1]
        row += count
    y[row] = 1.0
    row += 1
    for e in range(head[EQUATIONS]):
        y[row] = -unit * x[at[edge[FIRST_EQUATION] + e]] / size_of(most, row, 1)
        row += 1
    for i in range(head[INEQUALITIES]):
        y[row] = unit * max(z[single + i], 0.0) / size_of(most, row, 1)
        row += 1
    for c in range(head[CONES]):
        size = head[EDGE_HEAD + 2 * atoms + c]
        factor, square = unit / size_of(most, row, size), 0.0
        for i in range(1, size):
            y[row + i] = -factor * z[in_cone + i]
            square += y[row + i] * y[row + i]
        # In the cone's dual for sure.
        length = math.sqrt(square) * (1.0 + 4.0 * size * EPSILON)
        y[row] = -max(factor * z[in_cone], length)
        in_cone += size
        row += size
    return constant


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


@lean_kernel
def add_reach(head, f, D, off, totals):
    """Take what a set reaches against slopes ``D`` from the totals, if that is told by arrays."""
    n, count = head[AMBIENT], head[VARIABLES]
    sizes, lost, offset = 0.0, 0.0, 0.0
    for j in range(n):
        sizes += abs(D[j]) * f[n + j]
        offset += abs(D[j]) * abs(f[j])
        lost += (off[j] + 4.0 * EPSILON * abs(D[j])) * f[n + j]
    totals[1] += lost
    if head[REACH] > BY_CORNERS:
        return
    reach, rounding = sizes, sizes
    if head[REACH] == BY_CORNERS:
        reach, rounding = -math.inf, sizes + offset
        for c in range(count):
            along = 0.0
            for j in range(n):
                along -= D[j] * f[4 * n + j * count + c]
            reach = max(reach, along)
    totals[0] -= reach
    totals[1] += 2.0 * (n + 4) * EPSILON * rounding
    totals[2] += abs(reach)
