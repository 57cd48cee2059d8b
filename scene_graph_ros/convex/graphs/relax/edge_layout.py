"""Where the rows of edges are in a program, by the cones that they are in.

Edges are those of `packed_terms`, one behind another. Rows are in the order of `Cone`.
"""

from __future__ import annotations

from typing import NamedTuple

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
    WHOLE,
)
from scene_graph_ros.convex.graphs.expressions.term_kernels import (
    EXPONENTIAL,
    NORM_INF,
    SQUARES,
)
from scene_graph_ros.convex.solve.cones.cone_program import Cone
from scene_graph_ros.geometry.compiled.kernel import lean_kernel

__all__ = [
    "COLUMNS",
    "FIRST_ATOM",
    "FIRST_CONE",
    "FIRST_COORDINATE",
    "FIRST_EQUATION",
    "FIRST_IN_CONE",
    "FIRST_IN_MATRIX",
    "FIRST_IN_POWER",
    "FIRST_MATRIX",
    "FIRST_NUMBER",
    "FIRST_PLACE",
    "FIRST_ROW",
    "FIRST_WEIGHT",
    "FIRST_WHOLE",
    "SEMIDEFINITE",
    "Sizes",
    "lay_out_edges",
    "rows_of_atom",
    "size_of",
    "taken_by",
]  # fmt: skip

(
    FIRST_WHOLE,
    FIRST_NUMBER,
    FIRST_PLACE,
    FIRST_EQUATION,
    FIRST_ROW,
    FIRST_IN_CONE,
    FIRST_CONE,
    FIRST_IN_MATRIX,
    FIRST_MATRIX,
    FIRST_IN_POWER,
    FIRST_ATOM,
    FIRST_WEIGHT,
    FIRST_COORDINATE,
) = range(13)
"""Columns of tables of edges and of sets: where their whole numbers, numbers and places begin,
rows of each sort, second-order cones, matrices and atoms; weights of rows, and coordinates."""

COLUMNS = 13

SECOND_ORDER, SEMIDEFINITE = int(Cone.SECOND_ORDER), int(Cone.SEMIDEFINITE)


class Sizes(NamedTuple):
    """How many places, equations, single rows, rows in second-order cones, such cones there are.

    Rows in matrices, matrices, rows in exponential cones, atoms, rows of edges and coordinates;
    and how many values a row has at most, and rows an edge.
    """

    places: int
    equations: int
    rows: int
    in_cones: int
    cones: int
    in_matrices: int
    matrices: int
    in_powers: int
    atoms: int
    weights: int
    coordinates: int
    width: int
    most_rows: int


@lean_kernel
def rows_of_atom(kind, count):
    """Return its numbers of single rows, rows of a second-order and of an exponential cone."""
    if kind == NORM_INF:
        return 2 * count, 0, 0
    if kind == EXPONENTIAL:
        return 0, 0, 3
    return 0, count + 2 if kind == SQUARES else count + 1, 0


@lean_kernel
def size_of(most, first, count):
    """Return the divisor of rows."""
    largest = 0.0
    for i in range(first, first + count):
        largest = max(largest, most[i])
    return largest if largest > 0.0 else 1.0


@lean_kernel
def taken_by(head):
    """Return the counts of an edge: single rows, rows in second-order cones, and such cones.

    And rows in matrices, matrices, and rows in exponential cones.
    """
    atoms, cones = head[ATOMS], head[CONES]
    row, in_cone, cone, in_matrix, matrix, in_power = head[INEQUALITIES], 0, 0, 0, 0, 0
    for a in range(atoms):
        taken = rows_of_atom(head[EDGE_HEAD + a], head[EDGE_HEAD + atoms + a])
        row += taken[0]
        in_cone += taken[1]
        cone += taken[1] > 0
        in_power += taken[2]
    for c in range(cones):
        size, kind = head[EDGE_HEAD + 2 * atoms + c], head[EDGE_HEAD + 2 * atoms + cones + c]
        if kind == SECOND_ORDER:
            in_cone += size
            cone += 1
        elif kind == SEMIDEFINITE:
            in_matrix += size
            matrix += 1
        else:
            in_power += size
    return row, in_cone, cone, in_matrix, matrix, in_power


@lean_kernel
def lay_out_edges(edges, table):
    """Set where each edge begins, with variables of its own; return how much there is of all."""
    at, number, place, equation, row, in_cone, cone = 0, 0, 0, 0, 0, 0, 0
    in_matrix, matrix, in_power, atom, weight, coordinate, width, most = 0, 0, 0, 0, 0, 0, 1, 1
    for k in range(len(table)):
        head, of = edges[at:], table[k]
        of[FIRST_WHOLE], of[FIRST_NUMBER], of[FIRST_PLACE] = at, number, place
        of[FIRST_EQUATION], of[FIRST_ROW] = equation, row
        of[FIRST_IN_CONE], of[FIRST_CONE] = in_cone, cone
        of[FIRST_IN_MATRIX], of[FIRST_MATRIX], of[FIRST_IN_POWER] = in_matrix, matrix, in_power
        of[FIRST_ATOM], of[FIRST_WEIGHT], of[FIRST_COORDINATE] = atom, weight, coordinate
        taken = taken_by(head)
        equation += head[EQUATIONS]
        row += taken[0]
        in_cone += taken[1]
        cone += taken[2]
        in_matrix += taken[3]
        matrix += taken[4]
        in_power += taken[5]
        atom += head[ATOMS]
        weight += head[EDGE_ROWS]
        coordinate += head[COORDINATES_U] + head[COORDINATES_V]
        variables = head[VARIABLES_U] + head[VARIABLES_V]
        width, most = max(width, variables), max(most, head[EDGE_ROWS])
        # One more is its scale's.
        place += variables + 1
        at += head[WHOLE]
        number += head[NUMBERS]
    rows = equation, row, in_cone, cone, in_matrix, matrix, in_power
    return Sizes(place, *rows, atom, weight, coordinate, width, most)
