"""Where the variables and rows of a path are, in the banded program of its points.

Arrays are those of `packed_terms`, one behind another. Variables are those of each set, with the
multipliers of its equations and of those of the edge that follows; and behind all of them one for
each atom of an edge, which its rows have for themselves.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from scene_graph_ros.convex.graphs.expressions.packed_terms import (
    AMBIENT,
    ATOMS,
    BALLS,
    EDGE_ROWS,
    EQUATIONS,
    NUMBERS,
    SET_EQUATIONS,
    SET_HEAD,
    SET_INEQUALITIES,
    VARIABLES,
    WHOLE,
)
from scene_graph_ros.convex.graphs.relax.edge_layout import (
    FIRST_ATOM,
    FIRST_CONE,
    FIRST_COORDINATE,
    FIRST_EQUATION,
    FIRST_IN_CONE,
    FIRST_NUMBER,
    FIRST_PLACE,
    FIRST_ROW,
    FIRST_WHOLE,
    Sizes,
    taken_by,
)
from scene_graph_ros.geometry.compiled.kernel import lean_kernel

__all__ = ["Path", "lay_out"]


class Path(NamedTuple):
    """Whole numbers and numbers of edges ``(m,)`` and of one set more."""

    edges: np.ndarray
    edge_numbers: np.ndarray
    sets: np.ndarray
    set_numbers: np.ndarray


@lean_kernel
def lay_out(path, sets, edges):
    """Set where each set and edge begins; return how much there is of everything."""
    place, equation, row, ball, cone, first = 0, 0, 0, 0, 0, 0
    at, number, edge_at, edge_number, width, most, atom, weight = 0, 0, 0, 0, 1, 1, 0, 0
    for k in range(len(sets)):
        head = path.sets[at:]
        sets[k, FIRST_WHOLE], sets[k, FIRST_NUMBER], sets[k, FIRST_PLACE] = at, number, place
        sets[k, FIRST_EQUATION], sets[k, FIRST_ROW], sets[k, FIRST_IN_CONE] = equation, row, ball
        sets[k, FIRST_CONE], sets[k, FIRST_COORDINATE] = cone, first
        if k:
            width = max(width, place + head[VARIABLES] - sets[k - 1, FIRST_PLACE])
        place += head[VARIABLES] + head[SET_EQUATIONS]
        equation += head[SET_EQUATIONS]
        row += head[SET_INEQUALITIES]
        entry = SET_HEAD
        for _ in range(head[BALLS]):
            ball += head[entry] + 1
            cone += 1
            entry += head[entry] + 2
        first += head[AMBIENT]
        at += head[WHOLE]
        number += head[NUMBERS]
        if k == len(edges):
            break
        head = path.edges[edge_at:]
        edges[k, FIRST_WHOLE], edges[k, FIRST_NUMBER] = edge_at, edge_number
        edges[k, FIRST_PLACE], edges[k, FIRST_EQUATION] = place, equation
        edges[k, FIRST_ROW], edges[k, FIRST_IN_CONE], edges[k, FIRST_CONE] = row, ball, cone
        edges[k, FIRST_ATOM] = atom
        taken = taken_by(head)
        row += taken[0]
        ball += taken[1]
        cone += taken[2]
        atom += head[ATOMS]
        weight += head[EDGE_ROWS]
        place += head[EQUATIONS]
        equation += head[EQUATIONS]
        most = max(most, head[EDGE_ROWS])
        edge_at += head[WHOLE]
        edge_number += head[NUMBERS]
    last = path.sets[sets[len(sets) - 1, FIRST_WHOLE] :]
    width = max(width, last[VARIABLES] + last[SET_EQUATIONS])
    return Sizes(place, equation, row, ball, cone, 0, 0, 0, atom, weight, first, width, most)
