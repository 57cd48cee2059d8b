"""Rows and costs of an edge in a program, and its own rows' weights by their multipliers."""

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
    VARIABLES_U,
    VARIABLES_V,
)
from scene_graph_ros.convex.graphs.expressions.term_kernels import (
    EXPONENTIAL,
    NORM,
    NORM_INF,
    QUOTIENT,
    SQUARES,
)
from scene_graph_ros.convex.graphs.relax.edge_layout import (
    FIRST_ATOM,
    FIRST_CONE,
    FIRST_EQUATION,
    FIRST_IN_CONE,
    FIRST_IN_MATRIX,
    FIRST_IN_POWER,
    FIRST_MATRIX,
    FIRST_ROW,
    rows_of_atom,
    SECOND_ORDER,
    SEMIDEFINITE,
    size_of,
)
from scene_graph_ros.convex.solve.banded.step_systems import BandedProgram
from scene_graph_ros.geometry.compiled.kernel import kernel, lean_kernel

__all__ = ["empty_program", "fill_edge", "weigh_rows"]

_ROOT_2 = math.sqrt(2.0)


@kernel
def empty_program(of):
    """Return a program with places and rows for all terms, and its first rows.

    These are those of each sort, of which equations are the first.
    """
    singles = of.equations
    in_cones = singles + of.rows
    in_matrices = in_cones + of.in_cones
    in_powers = in_matrices + of.in_matrices
    number = in_powers + of.in_powers
    program = BandedProgram(
        np.zeros(of.places + of.atoms),
        np.ones(of.places + of.atoms),
        np.zeros(number, np.int64),
        np.zeros(number, np.int64),
        np.zeros((number, of.width)),
        np.zeros(number),
        np.full(number, -1),
        np.zeros(number),
        np.zeros(of.equations, np.int64),
        of.rows,
        np.zeros(of.cones, np.int64),
        np.zeros((of.atoms, 2), np.int64),
    )
    return program, (singles, in_cones, in_matrices, in_powers)


@lean_kernel
def _put(p, r, head, f, row, spot, factor):
    """Fill a row of an edge times a factor; ``spot`` are the places of both sets."""
    rows, u, v = head[EDGE_ROWS], head[VARIABLES_U], head[VARIABLES_V]
    over_u, over_v = 1 + row * u, 1 + rows * u + row * v
    constants = 1 + rows * (u + v + head[COORDINATES_U] + head[COORDINATES_V])
    _put_none(p, r, head, spot)
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
def _fill_atom(p, head, f, atom, rows, spot, r, unit):
    """Fill the rows of an atom, from r on, with its own variable.

    ``rows`` are its kind, the first of its own, and how many these are.
    """
    kind, row, count = rows
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
            # |w|^2 <= s t as |(t - s, 2 w)| <= t + s.
            p.own_values[r + i] = 1.0 if i < 2 else 0.0
            factor = (1.0 - 2.0 * i) / divisor if i < 2 else 2.0 / math.sqrt(unit * divisor)
            _put(p, r + i, head, f, row + max(0, i - 1), spot, factor)
        elif kind == EXPONENTIAL:
            # exp(w) <= unit t as exp(w - log(unit)) <= t.
            p.own_values[r + i] = 1.0 if i == 2 else 0.0
            if i == 0:
                _put(p, r, head, f, row, spot, 1.0)
                p.constant[r] -= math.log(unit)
            else:
                _put_none(p, r + i, head, spot)
                p.constant[r + i] = 1.0 if i == 1 else 0.0
        elif i < size - count:
            p.own_values[r + i] = 1.0
            _put_none(p, r + i, head, spot)
            if kind == SQUARES:
                # |w|^2 <= t as |(t - 1, 2 w)| <= t + 1.
                p.constant[r + i] = 1.0 - 2.0 * i
        else:
            factor = 1.0 / unit if kind == NORM else 2.0 / math.sqrt(unit)
            _put(p, r + i, head, f, row + i - size + count, spot, factor)


@lean_kernel
def _is_beside_diagonal(i):
    """Tell of the i-th of an upper triangle, column after column, if it is off the diagonal."""
    column = int((math.sqrt(8.0 * i + 1.0) - 1.0) / 2.0)
    return i != column * (column + 3) // 2


@lean_kernel
def fill_edge(p, head, f, edge, spot, unit, number_of, matrices):
    """Fill an edge's costs and constraints in a banded program, costs in units.

    ``edge`` says where they begin, and ``number_of`` where rows of each sort do, which are not
    equations; ``spot`` are the places of both sets. Sizes of ``matrices`` are set, too.
    """
    rows, atoms, u, v = head[EDGE_ROWS], head[ATOMS], head[VARIABLES_U], head[VARIABLES_V]
    most, cones = f[len(f) - rows :], head[CONES]
    single, in_cone = number_of[0] + edge[FIRST_ROW], number_of[1] + edge[FIRST_IN_CONE]
    in_matrix = number_of[2] + edge[FIRST_IN_MATRIX]
    in_power = number_of[3] + edge[FIRST_IN_POWER]
    cone, matrix, row = edge[FIRST_CONE], edge[FIRST_MATRIX], 0
    for a in range(atoms):
        kind, count = head[EDGE_HEAD + a], head[EDGE_HEAD + atoms + a]
        here = single if kind == NORM_INF else in_power if kind == EXPONENTIAL else in_cone
        _fill_atom(p, head, f, edge[FIRST_ATOM] + a, (kind, row, count), spot, here, unit)
        taken = rows_of_atom(kind, count)
        single += taken[0]
        in_cone += taken[1]
        in_power += taken[2]
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
        _put(p, edge[FIRST_EQUATION] + e, head, f, row, spot, 1.0 / size_of(most, row, 1))
        row += 1
    for i in range(head[INEQUALITIES]):
        _put(p, single + i, head, f, row, spot, -1.0 / size_of(most, row, 1))
        row += 1
    for c in range(cones):
        size, kind = head[EDGE_HEAD + 2 * atoms + c], head[EDGE_HEAD + 2 * atoms + cones + c]
        factor = 1.0 / size_of(most, row, size)
        if kind == SECOND_ORDER:
            r, p.sizes[cone] = in_cone, size
            in_cone += size
            cone += 1
        elif kind == SEMIDEFINITE:
            r, matrices[matrix] = in_matrix, size
            in_matrix += size
            matrix += 1
        else:
            r = in_power
            in_power += size
        for i in range(size):
            is_twice = kind == SEMIDEFINITE and _is_beside_diagonal(i)
            _put(p, r + i, head, f, row + i, spot, factor * _ROOT_2 if is_twice else factor)
        row += size


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
    elif kind == EXPONENTIAL:
        y[row] = -unit * z[r]
    elif kind == QUOTIENT:
        size = most[row] if most[row] > 0.0 else 1.0
        y[row] = -unit * (z[r] - z[r + 1]) / size
        for i in range(1, count):
            y[row + i] = -2.0 * math.sqrt(unit / size) * z[r + 1 + i]
    else:
        for i in range(count):
            y[row + i] = -2.0 * math.sqrt(unit) * z[r + 2 + i]


@lean_kernel
def weigh_rows(head, f, edge, multipliers, number_of, unit, y):
    """Set the weights of an edge's rows ``(r,)``, from multipliers of the program's.

    These are of equations, ``(e,)``, and of all other rows; ``number_of`` says where these begin
    among the others. The cost less the weighted rows has its least value where the program has.
    """
    free, z = multipliers
    atoms, cones, rows = head[ATOMS], head[CONES], head[EDGE_ROWS]
    most = f[len(f) - rows :]
    single, in_cone = number_of[0] + edge[FIRST_ROW], number_of[1] + edge[FIRST_IN_CONE]
    in_matrix = number_of[2] + edge[FIRST_IN_MATRIX]
    in_power, row = number_of[3] + edge[FIRST_IN_POWER], 0
    for a in range(atoms):
        kind, count = head[EDGE_HEAD + a], head[EDGE_HEAD + atoms + a]
        r = single if kind == NORM_INF else in_power if kind == EXPONENTIAL else in_cone
        _slopes_of_atom(kind, (row, count), most, z, r, unit, y)
        taken = rows_of_atom(kind, count)
        single += taken[0]
        in_cone += taken[1]
        in_power += taken[2]
        row += count
    y[row] = 1.0
    row += 1
    for e in range(head[EQUATIONS]):
        y[row] = -unit * free[edge[FIRST_EQUATION] + e] / size_of(most, row, 1)
        row += 1
    for i in range(head[INEQUALITIES]):
        y[row] = unit * z[single + i] / size_of(most, row, 1)
        row += 1
    for c in range(cones):
        size, kind = head[EDGE_HEAD + 2 * atoms + c], head[EDGE_HEAD + 2 * atoms + cones + c]
        factor = -unit / size_of(most, row, size)
        if kind == SECOND_ORDER:
            r = in_cone
            in_cone += size
        elif kind == SEMIDEFINITE:
            r = in_matrix
            in_matrix += size
        else:
            r = in_power
            in_power += size
        for i in range(size):
            is_twice = kind == SEMIDEFINITE and _is_beside_diagonal(i)
            y[row + i] = (factor * _ROOT_2 if is_twice else factor) * z[r + i]
        row += size
