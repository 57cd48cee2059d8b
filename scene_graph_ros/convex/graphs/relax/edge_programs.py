"""Rows of many edges in a program, as entries of its matrix; and back from its multipliers."""

from __future__ import annotations

import numpy as np

from scene_graph_ros.convex.graphs.expressions.packed_terms import (
    ATOMS,
    COORDINATES_U,
    COORDINATES_V,
    EDGE_HEAD,
    EDGE_ROWS,
    NUMBERS,
    VARIABLES_U,
    VARIABLES_V,
)
from scene_graph_ros.convex.graphs.relax.edge_layout import (
    COLUMNS,
    FIRST_NUMBER,
    FIRST_PLACE,
    FIRST_WEIGHT,
    FIRST_WHOLE,
    lay_out_edges,
)
from scene_graph_ros.convex.graphs.relax.edge_rows import (
    empty_program,
    fill_edge,
    weigh_rows,
)
from scene_graph_ros.geometry.compiled.kernel import kernel, lean_kernel

__all__ = ["lower_edges", "weights_of_edges"]


@kernel
def lower_edges(edges, numbers, columns, unit, own):
    """Return the rows and costs of edges, costs in units.

    ``columns (m, 3)`` are the first of the tail's variables, of the head's, and that of the scale
    by which the terms are multiplied, or -1; ``own`` is the first of the atoms' variables.

    The rows, columns and values of entries, those of each cone's behind the ones before it, and
    how many there are of each; constants, and how many rows each cone has, in the order of `Cone`;
    the sizes of second-order cones and of matrices; columns and values of costs.
    """
    count = len(columns)
    table = np.zeros((count, COLUMNS), np.int64)
    of = lay_out_edges(edges, table)
    matrices = np.zeros(of.matrices, np.int64)
    p, number_of = empty_program(of)
    meant = np.zeros(len(p.cost), np.int64)
    for k in range(count):
        head, first = edges[table[k, FIRST_WHOLE] :], table[k, FIRST_NUMBER]
        u, v, place = head[VARIABLES_U], head[VARIABLES_V], table[k, FIRST_PLACE]
        f = numbers[first : first + head[NUMBERS]]
        fill_edge(p, head, f, table[k], (place, place + u), unit, number_of, matrices)
        for j in range(u):
            meant[place + j] = columns[k, 0] + j
        for j in range(v):
            meant[place + u + j] = columns[k, 1] + j
        meant[place + u + v] = columns[k, 2]
        if columns[k, 2] >= 0:
            p.cost[place + u + v] = _linear_constant(head, f) / unit
    for a in range(of.atoms):
        meant[of.places + a] = own + a
    begin = np.array([0, *number_of, len(p.first)])
    entries = _entries_of(p, begin, meant)
    costs = np.flatnonzero(p.cost)
    return entries, p.constant, np.diff(begin), p.sizes, matrices, meant[costs], p.cost[costs]


@lean_kernel
def _linear_constant(head, f):
    """Return the linear part of an edge's cost at the centres."""
    rows, atoms, row = head[EDGE_ROWS], head[ATOMS], 0
    for a in range(atoms):
        row += head[EDGE_HEAD + atoms + a]
    sides = head[VARIABLES_U] + head[VARIABLES_V] + head[COORDINATES_U] + head[COORDINATES_V]
    return f[1 + rows * sides + row]


@kernel
def _entries_of(p, begin, meant):
    """Return rows, columns and values of a program's entries, and how many each cone has.

    Rows are counted from the first of the same cone's, ``begin``. Places are ``meant`` to be
    columns. Constants of rows that are scaled are entries, and 0 then.
    """
    number = len(p.first)
    most = p.lengths.sum() + 2 * number
    rows, columns = np.zeros(most, np.int64), np.zeros(most, np.int64)
    values, counts, at, cone = np.zeros(most), np.zeros(len(begin) - 1, np.int64), 0, 0
    for r in range(number):
        while r >= begin[cone + 1]:
            cone += 1
        start, length = at, p.lengths[r]
        for k in range(length):
            if p.values[r, k] != 0.0:
                columns[at], values[at] = meant[p.first[r] + k], p.values[r, k]
                at += 1
        if p.own[r] >= 0 and p.own_values[r] != 0.0:
            columns[at], values[at] = meant[p.own[r]], p.own_values[r]
            at += 1
        scale = meant[p.first[r] + length]
        if scale >= 0:
            if p.constant[r] != 0.0:
                columns[at], values[at] = scale, p.constant[r]
                at += 1
            p.constant[r] = 0.0
        for e in range(start, at):
            rows[e] = r - begin[cone]
        counts[cone] += at - start
    return rows[:at], columns[:at], values[:at], counts


@kernel
def weights_of_edges(edges, numbers, count, equations, others, unit):
    """Return the multipliers ``(r,)`` of all rows of edges, edge after edge, in their own units.

    From the multipliers of the equations and the other rows of `lower_edges`.
    """
    table = np.zeros((count, COLUMNS), np.int64)
    of = lay_out_edges(edges, table)
    in_matrices = of.rows + of.in_cones
    number_of = 0, of.rows, in_matrices, in_matrices + of.in_matrices
    y = np.zeros(of.weights)
    for k in range(count):
        head, first = edges[table[k, FIRST_WHOLE] :], table[k, FIRST_NUMBER]
        f, mine = numbers[first : first + head[NUMBERS]], y[table[k, FIRST_WEIGHT] :]
        weigh_rows(head, f, table[k], (equations, others), number_of, unit, mine)
    return y
