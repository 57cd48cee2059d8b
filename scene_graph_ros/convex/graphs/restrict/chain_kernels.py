"""The best points of a path, bounds of its cost, and costs of points, in kernels."""

from __future__ import annotations

import math

import numpy as np

from scene_graph_ros.convex.graphs.expressions.packed_terms import (
    AMBIENT,
    ATOMS,
    CONES,
    COORDINATES_U,
    COORDINATES_V,
    EDGE_HEAD,
    EDGE_ROWS,
    EQUATIONS,
    INEQUALITIES,
    NUMBERS,
    VARIABLES,
    VARIABLES_U,
    VARIABLES_V,
    WHOLE,
)
from scene_graph_ros.convex.graphs.expressions.term_kernels import value
from scene_graph_ros.convex.graphs.model.set_kernels import add_reach
from scene_graph_ros.convex.graphs.relax.edge_layout import (
    COLUMNS,
    FIRST_COORDINATE,
    FIRST_NUMBER,
    FIRST_PLACE,
    FIRST_WHOLE,
    size_of,
)
from scene_graph_ros.convex.graphs.relax.edge_rows import weigh_rows
from scene_graph_ros.convex.graphs.relax.minorant_kernels import (
    add_minorant,
    make_valid,
)
from scene_graph_ros.convex.graphs.restrict.chain_layout import lay_out
from scene_graph_ros.convex.graphs.restrict.chain_programs import program_of
from scene_graph_ros.convex.solve.banded.banded_cones import minimize_banded
from scene_graph_ros.geometry.compiled.kernel import kernel, lean_kernel
from scene_graph_ros.geometry.tolerances import EPSILON

__all__ = ["cost_of_path", "place_points", "solve_path"]


@kernel
def solve_path(path, count, unit, end, limits, improve):
    """Return the best points of a path of so many edges, and bounds of its cost.

    Costs are in units, those of the edges' at most if ``unit`` is 0. ``end`` is the slope ``(n,)``
    of a further cost at the last point, or empty. ``limits`` are the tolerance, and how many
    places rows may take: nothing is solved where they take more. ``improve`` is the address of
    `IMPROVE`.

    Points less their centres and slopes ``(n,)`` of all sets in turn; with them the bound's total,
    its rounding, and its size, without the reach of sets that do not tell it by
    arrays; and the residual of the solver.
    """
    sets = np.zeros((count + 1, COLUMNS), np.int64)
    edges = np.zeros((count, COLUMNS), np.int64)
    of = lay_out(path, sets, edges)
    points, D, off = np.zeros(of.coordinates), np.zeros(of.coordinates), np.zeros(of.coordinates)
    totals, y, last = np.zeros(3), np.zeros(of.most_rows), sets[count, FIRST_COORDINATE]
    tolerance, widest = limits
    if of.width > widest:
        return points, D, totals, np.inf
    if not unit > 0.0:
        for k in range(count):
            unit += path.edge_numbers[edges[k, FIRST_NUMBER]]
        unit = unit if 0.0 < unit < np.inf else 1.0
    p = program_of(path, of, sets, edges, unit, end)
    x, z, residual = minimize_banded(p, tolerance, improve)
    multipliers, number_of = (x[p.at], z), (0, of.rows, 0, 0)
    for k in range(count):
        head, first = path.edges[edges[k, FIRST_WHOLE] :], edges[k, FIRST_NUMBER]
        f = path.edge_numbers[first : first + head[NUMBERS]]
        weigh_rows(head, f, edges[k], multipliers, number_of, unit, y)
        taken = make_valid(head, y, True)
        firsts = sets[k, FIRST_COORDINATE], sets[k + 1, FIRST_COORDINATE]
        add_minorant(head, f, y, -taken, firsts, D, off, totals)
    for i in range(len(end)):
        D[last + i] += end[i]
        off[last + i] += 2.0 * EPSILON * abs(end[i])
    for k in range(count + 1):
        head, f = path.sets[sets[k, FIRST_WHOLE] :], path.set_numbers[sets[k, FIRST_NUMBER] :]
        first, place, v = sets[k, FIRST_COORDINATE], sets[k, FIRST_PLACE], head[VARIABLES]
        S = f[4 * head[AMBIENT] :]
        for i in range(head[AMBIENT]):
            for j in range(v):
                points[first + i] += S[i * v + j] * x[place + j]
        add_reach(head, f, D[first:], off[first:], totals)
    return points, D, totals, residual


@kernel
def place_points(path, count, ways, is_tied):
    """Return points of all sets in turn, and by how much the worst is outside of its box.

    Beside the box's size. Points are moved into boxes, and the ``ways`` from their centres with
    them, unless they are tied; sets without corners in their arrays are left alone.
    """
    points, at, number, first, worst = np.zeros(len(ways)), 0, 0, 0, 0.0
    for _ in range(count + 1):
        head, f = path.sets[at:], path.set_numbers[number:]
        n, square, size, largest = head[AMBIENT], 0.0, 0.0, 0.0
        for i in range(n):
            x = f[i] + ways[first + i]
            points[first + i] = x
            # Not a number where there are no corners.
            if f[2 * n + i] <= f[3 * n + i]:
                nearest = min(max(x, f[2 * n + i]), f[3 * n + i])
                square += (x - nearest) ** 2
                if not is_tied:
                    points[first + i], ways[first + i] = nearest, nearest - f[i]
            size, largest = max(size, f[n + i]), max(largest, abs(f[i]))
        outside = math.sqrt(square)
        if is_tied and outside > 8.0 * EPSILON * largest:
            worst = max(worst, outside / size)
        first += n
        at += head[WHOLE]
        number += head[NUMBERS]
    return points, worst


@lean_kernel
def _violation(head, f, w, row):
    """Return by how much constraints are broken beside the size of their terms."""
    rows, worst = head[EDGE_ROWS], 0.0
    most = f[len(f) - rows :]
    for i in range(head[EQUATIONS] + head[INEQUALITIES]):
        broken = abs(w[row]) if i < head[EQUATIONS] else w[row]
        worst = max(worst, broken / size_of(most, row, 1))
        row += 1
    for c in range(head[CONES]):
        size, square = head[EDGE_HEAD + 2 * head[ATOMS] + c], 0.0
        for i in range(1, size):
            square += w[row + i] * w[row + i]
        worst = max(worst, (math.sqrt(square) - w[row]) / size_of(most, row, size))
        row += size
    return worst


@kernel
def cost_of_path(path, count, points):
    """Return a path's cost at points less their centres, of all sets in turn.

    And by how much edges' constraints are broken, beside the size of their terms.
    """
    at, first, total, worst = 0, 0, 0.0, 0.0
    w = np.zeros(1)
    begin = 0
    for _ in range(count):
        head = path.edges[at:]
        f = path.edge_numbers[first : first + head[NUMBERS]]
        rows, nu, nv = head[EDGE_ROWS], head[COORDINATES_U], head[COORDINATES_V]
        if len(w) < rows:
            w = np.zeros(rows)
        M = 1 + rows * (head[VARIABLES_U] + head[VARIABLES_V])
        for i in range(rows):
            along_u, along_v = 0.0, 0.0
            for j in range(nu):
                along_u += f[M + i * nu + j] * points[begin + j]
            for j in range(nv):
                along_v += f[M + rows * nu + i * nv + j] * points[begin + nu + j]
            w[i] = along_u + along_v + f[M + rows * (nu + nv) + i]
        row, atoms, cost = 0, head[ATOMS], 0.0
        for a in range(atoms):
            size = head[EDGE_HEAD + atoms + a]
            cost += value(head[EDGE_HEAD + a], w, row, size)
            row += size
        total += cost + w[row]
        worst = max(worst, _violation(head, f, w, row + 1))
        begin += nu
        at += head[WHOLE]
        first += head[NUMBERS]
    return total, worst
