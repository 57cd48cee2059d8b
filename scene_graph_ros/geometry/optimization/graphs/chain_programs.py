"""The rows and costs of a path in a banded program."""

from __future__ import annotations

import math

from scene_graph_ros.geometry.compiled.kernel import lean_kernel
from scene_graph_ros.geometry.optimization.graphs.chain_layout import (
    FIRST_CONE,
    FIRST_COORDINATE,
    FIRST_EQUATION,
    FIRST_IN_CONE,
    FIRST_NUMBER,
    FIRST_PLACE,
    FIRST_ROW,
    FIRST_WHOLE,
    rows_of_atom,
    size_of,
)
from scene_graph_ros.geometry.optimization.graphs.packed_terms import (
    AMBIENT,
    ATOMS,
    BALLS,
    CONES,
    COORDINATES_U,
    COORDINATES_V,
    EDGE_HEAD,
    EDGE_ROWS,
    EQUATIONS,
    INEQUALITIES,
    NUMBERS,
    SET_EQUATIONS,
    SET_HEAD,
    SET_INEQUALITIES,
    VARIABLES,
    VARIABLES_U,
    VARIABLES_V,
)
from scene_graph_ros.geometry.optimization.graphs.term_kernels import (
    NORM,
    NORM_INF,
    QUOTIENT,
    SQUARES,
)

__all__ = ["fill_edge", "fill_set"]


@lean_kernel
def fill_set(path, p, sets, k, number_of):
    """Fill what is asked of a set's variables."""
    head, f = path.sets[sets[k, FIRST_WHOLE] :], path.set_numbers[sets[k, FIRST_NUMBER] :]
    n, count, place = head[AMBIENT], head[VARIABLES], sets[k, FIRST_PLACE]
    at = 4 * n + n * count
    for e in range(head[SET_EQUATIONS]):
        r = sets[k, FIRST_EQUATION] + e
        p.at[r] = place + count + e
        p.signs[p.at[r]] = -1.0
        p.first[r], p.lengths[r] = place, count
        for j in range(count):
            p.values[r, j] = f[at + e * count + j]
        p.constant[r] = -f[at + head[SET_EQUATIONS] * count + e]
    at += head[SET_EQUATIONS] * (count + 1)
    for i in range(head[SET_INEQUALITIES]):
        r = number_of[0] + sets[k, FIRST_ROW] + i
        p.first[r], p.lengths[r] = place, count
        for j in range(count):
            p.values[r, j] = -f[at + i * count + j]
        p.constant[r] = f[at + head[SET_INEQUALITIES] * count + i]
    r, entry = number_of[1] + sets[k, FIRST_IN_CONE], SET_HEAD
    for c in range(head[BALLS]):
        size, scale = head[entry], head[entry + 1]
        p.sizes[sets[k, FIRST_CONE] + c] = size + 1
        for i in range(size + 1):
            p.first[r + i], p.lengths[r + i] = place, count
        if scale >= 0:
            p.values[r, scale] = 1.0
        else:
            p.constant[r] = 1.0
        for i in range(size):
            p.values[r + 1 + i, head[entry + 2 + i]] = 1.0
        r += size + 1
        entry += size + 2


@lean_kernel
def _put(p, r, head, f, row, spot, factor):
    """Fill a row of an edge times a factor; ``spot`` are the places of both sets."""
    rows, u, v = head[EDGE_ROWS], head[VARIABLES_U], head[VARIABLES_V]
    over_u, over_v = 1 + row * u, 1 + rows * u + row * v
    constants = 1 + rows * (u + v + head[COORDINATES_U] + head[COORDINATES_V])
    p.first[r], p.lengths[r] = spot[0], spot[1] + v - spot[0]
    for j in range(u):
        p.values[r, j] = factor * f[over_u + j]
    for j in range(v):
        p.values[r, spot[1] - spot[0] + j] = factor * f[over_v + j]
    p.constant[r] = factor * f[constants + row]


@lean_kernel
def _put_none(p, r, head, spot):
    """Fill a row with no entries of the sets."""
    p.first[r], p.lengths[r] = spot[0], spot[1] + head[VARIABLES_V] - spot[0]


@lean_kernel
def _fill_atom(p, head, f, atom, kind, rows, spot, r, unit):
    """Fill the rows of an atom, from r on, with its own variable; ``rows`` are first, count."""
    row, count = rows
    place, size = len(p.cost) - len(p.groups) + atom, sum(rows_of_atom(kind, count))
    p.cost[place] = 1.0
    p.groups[atom, 0], p.groups[atom, 1] = r, size
    most = f[len(f) - head[EDGE_ROWS] :]
    divisor = most[row] if most[row] > 0.0 else 1.0
    for i in range(size):
        p.own[r + i] = place
        if kind == NORM_INF:
            p.own_values[r + i] = 1.0
            sign = -1.0 if i < count else 1.0
            _put(p, r + i, head, f, row + i % count, spot, sign / unit)
        elif kind == QUOTIENT:
            p.own_values[r + i] = 1.0 if i < 2 else 0.0
            factor = (1.0 - 2.0 * i) / divisor if i < 2 else 2.0 / math.sqrt(unit * divisor)
            _put(p, r + i, head, f, row + max(0, i - 1), spot, factor)
        elif i < size - count:
            p.own_values[r + i] = 1.0
            _put_none(p, r + i, head, spot)
            if kind == SQUARES:
                p.constant[r + i] = 1.0 - 2.0 * i
        else:
            factor = 1.0 / unit if kind == NORM else 2.0 / math.sqrt(unit)
            _put(p, r + i, head, f, row + i - size + count, spot, factor)


@lean_kernel
def fill_edge(path, p, sets, edges, k, unit, number_of):
    """Fill an edge's costs and constraints."""
    head = path.edges[edges[k, FIRST_WHOLE] :]
    first = edges[k, FIRST_NUMBER]
    f = path.edge_numbers[first : first + head[NUMBERS]]
    rows, atoms, u, v = head[EDGE_ROWS], head[ATOMS], head[VARIABLES_U], head[VARIABLES_V]
    spot = sets[k, FIRST_PLACE], sets[k + 1, FIRST_PLACE]
    most = f[len(f) - rows :]
    single, in_cone = number_of[0] + edges[k, FIRST_ROW], number_of[1] + edges[k, FIRST_IN_CONE]
    cone, row = edges[k, FIRST_CONE], 0
    for a in range(atoms):
        kind, count = head[EDGE_HEAD + a], head[EDGE_HEAD + atoms + a]
        here, atom = single if kind == NORM_INF else in_cone, edges[k, FIRST_COORDINATE] + a
        _fill_atom(p, head, f, atom, kind, (row, count), spot, here, unit)
        taken = rows_of_atom(kind, count)
        single += taken[0]
        in_cone += taken[1]
        if taken[1]:
            p.sizes[cone] = taken[1]
            cone += 1
        row += count
    for j in range(u):
        p.cost[spot[0] + j] += f[1 + row * u + j] / unit
    for j in range(v):
        p.cost[spot[1] + j] += f[1 + rows * u + row * v + j] / unit
    row += 1
    for e in range(head[EQUATIONS]):
        r = edges[k, FIRST_EQUATION] + e
        _put(p, r, head, f, row, spot, 1.0 / size_of(most, row, 1))
        p.at[r] = edges[k, FIRST_PLACE] + e
        p.signs[p.at[r]] = -1.0
        row += 1
    for i in range(head[INEQUALITIES]):
        _put(p, single + i, head, f, row, spot, -1.0 / size_of(most, row, 1))
        row += 1
    for c in range(head[CONES]):
        size = head[EDGE_HEAD + 2 * atoms + c]
        factor = 1.0 / size_of(most, row, size)
        for i in range(size):
            _put(p, in_cone + i, head, f, row + i, spot, factor)
        p.sizes[cone + c] = size
        in_cone += size
        row += size
