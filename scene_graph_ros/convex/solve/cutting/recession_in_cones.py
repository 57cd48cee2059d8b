"""Does a set of rows and matrices go on for ever: a direction, or weights of planes."""

from __future__ import annotations

from fractions import Fraction

import numpy as np

from scene_graph_ros.convex.solve.cones.lift import joined, Lift
from scene_graph_ros.convex.solve.cutting.cones import excess, first_cuts, holds, new_cuts
from scene_graph_ros.convex.solve.cutting.cutting import (
    Cut,
    find_in_cones,
    rows_with_cuts,
)
from scene_graph_ros.convex.solve.exact.proof import Proof
from scene_graph_ros.convex.solve.exact.recession import recession
from scene_graph_ros.convex.solve.exact.rows import Rows

__all__ = ["recession_in_cones"]

_MOST_ROUNDS = 60
"""Rounds of cutting: what is bounded by much is shown to be in a few."""

_CLOSE = 1e-9
"""Relative to a matrix's largest eigenvalue: a direction outside by less may be at the border."""

_COARSE = (2.0**-10, 2.0**-20, 2.0**-30)
"""Relative to a direction's largest entry: to what it is rounded, as borders are often found at
numbers of few digits."""


def recession_in_cones(lift: Lift) -> tuple[Proof, tuple[Cut, ...], float]:
    """Decide whether a direction leads on for ever in the rows of directions and all matrices.

    Returns it, or multipliers of rows and cuts as `recession`, with the cuts; ``undecided`` with a
    direction and how far it is outside, where neither was found.
    """
    rows = lift.directions
    if not lift.matrices:
        return recession(rows), (), 0.0
    inner = _inner_direction(lift, rows)
    if inner is not None:
        return Proof("recession", inner), (), 0.0
    places = [k for k, cone in enumerate(lift.cones) if cone in lift.matrices]
    cuts = [Cut(k, u) for k in places for u in first_cuts(lift.cones[k])]
    best, nearest = np.inf, Proof("undecided", ())
    for _ in range(_MOST_ROUNDS):
        proof = recession(rows_with_cuts(lift, cuts, rows))
        if proof.kind == "multipliers":
            return proof, tuple(cuts), 0.0
        for way in (proof.vector, *_rounded(rows, proof.vector)):
            if all(holds(matrix, way) for matrix in lift.matrices):
                return Proof("recession", way), (), 0.0
        d = np.array([float(v) for v in proof.vector])
        outside = max(excess(matrix, d) for matrix in lift.matrices)
        if outside < best:
            best, nearest = outside, Proof("undecided", proof.vector)
        added = [Cut(k, u) for k in places for u in new_cuts(lift.cones[k], d, -_CLOSE)]
        if not added:
            break
        cuts += added
    return nearest, (), max(best, 0.0)


def _inner_direction(lift: Lift, rows: Rows) -> tuple[Fraction, ...] | None:
    """Return a direction of the set's inside, within a cube, None where none was found."""
    k = lift.num_variables
    split = rows.num_equalities
    cube = Lift(
        rows.A[:split],
        rows.b[:split],
        np.concatenate([rows.A[split:], np.eye(k), -np.eye(k)]),
        np.append(rows.b[split:], np.ones(2 * k)),
        lift.matrices,
    )
    found = find_in_cones(joined([cube]))
    return found.vector if found.kind == "point" and any(found.vector) else None


def _rounded(rows: Rows, way: tuple[Fraction, ...]) -> list[tuple[Fraction, ...]]:
    """Return directions of few digits near to one, of those that break no row."""
    from scene_graph_ros.convex.solve.exact.rows import is_inside

    d = np.array([float(v) for v in way])
    largest = float(np.abs(d).max(initial=0.0))
    found = []
    for step in _COARSE:
        near = np.rint(d / (largest * step)) * step if largest else d
        if near.any() and is_inside(rows, near):
            found.append(tuple(Fraction(v) for v in near.tolist()))
    return found
