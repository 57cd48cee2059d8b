"""Where the variables and rows of a path are, in the banded program of its points.

Arrays are those of `packed_terms`, one behind another. Variables are those of each set, with the
multipliers of its equations and of those of the edge that follows; and behind all of them one for
each atom of an edge, which its rows have for themselves.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from scene_graph_ros.geometry.compiled.kernel import lean_kernel
from scene_graph_ros.geometry.optimization.graphs.packed_terms import (
    AMBIENT,
    ATOMS,
    BALLS,
    CONES,
    EDGE_HEAD,
    EDGE_ROWS,
    EQUATIONS,
    INEQUALITIES,
    NUMBERS,
    SET_EQUATIONS,
    SET_HEAD,
    SET_INEQUALITIES,
    VARIABLES,
    WHOLE,
)
from scene_graph_ros.geometry.optimization.graphs.term_kernels import (
    NORM_INF,
    SQUARES,
)

__all__ = [
    "FIRST_CONE",
    "FIRST_COORDINATE",
    "FIRST_EQUATION",
    "FIRST_IN_CONE",
    "FIRST_NUMBER",
    "FIRST_PLACE",
    "FIRST_ROW",
    "FIRST_WHOLE",
    "Path",
    "Sizes",
    "lay_out",
    "rows_of_atom",
    "size_of",
]

(
    FIRST_WHOLE,
    FIRST_NUMBER,
    FIRST_PLACE,
    FIRST_EQUATION,
    FIRST_ROW,
    FIRST_IN_CONE,
    FIRST_CONE,
    FIRST_COORDINATE,
) = range(8)
"""Columns of tables of sets and of edges: where their whole numbers, numbers and places begin,
rows of each sort and cones; a set's coordinates, and an edge's atoms. Edges' places are those of
multipliers of their equations."""


class Path(NamedTuple):
    """Whole numbers and numbers of edges ``(m,)`` and of one set more."""

    edges: np.ndarray
    edge_numbers: np.ndarray
    sets: np.ndarray
    set_numbers: np.ndarray


class Sizes(NamedTuple):
    """How many places, equations, single rows, rows in cones, cones and coordinates there are.

    And atoms; and how many values a row has at most, and rows an edge.
    """

    places: int
    equations: int
    rows: int
    in_cones: int
    cones: int
    coordinates: int
    atoms: int
    width: int
    most_rows: int


@lean_kernel
def rows_of_atom(kind, count):
    """Return single rows and those of a cone that an atom of so many rows takes."""
    if kind == NORM_INF:
        return 2 * count, 0
    return 0, count + 2 if kind == SQUARES else count + 1


@lean_kernel
def lay_out(path, sets, edges):
    """Set where each set and edge begins; return how much there is of everything."""
    place, equation, row, ball, cone, first = 0, 0, 0, 0, 0, 0
    at, number, edge_at, edge_number, width, most, atom = 0, 0, 0, 0, 1, 1, 0
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
        edges[k, FIRST_COORDINATE] = atom
        atoms = head[ATOMS]
        for a in range(atoms):
            single, in_cone = rows_of_atom(head[EDGE_HEAD + a], head[EDGE_HEAD + atoms + a])
            row += single
            ball += in_cone
            if in_cone:
                cone += 1
        for c in range(head[CONES]):
            ball += head[EDGE_HEAD + 2 * atoms + c]
            cone += 1
        atom += atoms
        place += head[EQUATIONS]
        equation += head[EQUATIONS]
        row += head[INEQUALITIES]
        most = max(most, head[EDGE_ROWS])
        edge_at += head[WHOLE]
        edge_number += head[NUMBERS]
    last = path.sets[sets[len(sets) - 1, FIRST_WHOLE] :]
    width = max(width, last[VARIABLES] + last[SET_EQUATIONS])
    return Sizes(place, equation, row, ball, cone, first, atom, width, most)


@lean_kernel
def size_of(most, first, count):
    """Return what rows are divided by."""
    largest = 0.0
    for i in range(first, first + count):
        largest = max(largest, most[i])
    return largest if largest > 0.0 else 1.0
