"""The banded program of a path's points: rows of its sets and edges, and their costs."""

from __future__ import annotations

import numpy as np

from scene_graph_ros.convex.graphs.expressions.packed_terms import (
    AMBIENT,
    BALLS,
    EQUATIONS,
    NUMBERS,
    SET_EQUATIONS,
    SET_HEAD,
    SET_INEQUALITIES,
    VARIABLES,
)
from scene_graph_ros.convex.graphs.relax.edge_layout import (
    FIRST_CONE,
    FIRST_EQUATION,
    FIRST_IN_CONE,
    FIRST_NUMBER,
    FIRST_PLACE,
    FIRST_ROW,
    FIRST_WHOLE,
)
from scene_graph_ros.convex.graphs.relax.edge_rows import empty_program, fill_edge
from scene_graph_ros.geometry.compiled.kernel import kernel, lean_kernel

__all__ = ["program_of"]


@lean_kernel
def _fill_set(path, p, sets, k, number_of):
    """Fill the membership of a set's variables."""
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


@kernel
def program_of(path, of, sets, edges, unit, end):
    """Return the banded program of a path's points, in units of cost.

    ``end`` is the slope ``(n,)`` of a further cost at the last point, or empty.
    """
    p, number_of = empty_program(of)
    last, none = len(edges), np.zeros(0, np.int64)
    for k in range(last + 1):
        _fill_set(path, p, sets, k, number_of)
        if k == last:
            break
        edge, first = edges[k], edges[k, FIRST_NUMBER]
        head = path.edges[edge[FIRST_WHOLE] :]
        f = path.edge_numbers[first : first + head[NUMBERS]]
        spot = sets[k, FIRST_PLACE], sets[k + 1, FIRST_PLACE]
        fill_edge(p, head, f, edge, spot, unit, number_of, none)
        for e in range(head[EQUATIONS]):
            at = edge[FIRST_PLACE] + e
            p.at[edge[FIRST_EQUATION] + e], p.signs[at] = at, -1.0
    head, f = path.sets[sets[last, FIRST_WHOLE] :], path.set_numbers[sets[last, FIRST_NUMBER] :]
    n, v = head[AMBIENT], head[VARIABLES]
    for j in range(v):
        for i in range(len(end)):
            p.cost[sets[last, FIRST_PLACE] + j] += end[i] * f[4 * n + i * v + j] / unit
    return p
