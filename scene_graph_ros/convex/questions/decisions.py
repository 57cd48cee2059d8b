"""Decide emptiness and boundedness of sets that are lifts of linear rows, with proofs."""

from __future__ import annotations

from typing import Any

import numpy as np

from scene_graph_ros.convex.questions.certificates import Certificate, Decision
from scene_graph_ros.convex.questions.quick_answers import reached
from scene_graph_ros.convex.questions.surrounding import surround
from scene_graph_ros.convex.questions.touching import meet_by_plane
from scene_graph_ros.convex.solve.cones.lift import shared_point
from scene_graph_ros.convex.solve.cutting.cutting import find_in_cones, rows_with_cuts
from scene_graph_ros.convex.solve.cutting.recession_in_cones import recession_in_cones
from scene_graph_ros.convex.solve.exact.feasibility import find_point
from scene_graph_ros.convex.solve.exact.nearest_exactly import (
    corners_meet,
    corners_meet_ball,
)
from scene_graph_ros.convex.solve.exact.rows import Rows

__all__ = ["is_bounded", "is_empty", "meet_by_reach"]


def is_empty(sets: tuple[Any, ...], question: str) -> Decision:
    """Decide whether sets have no point in common; undecided sets count as touching."""
    if len(sets) == 1:
        found = sets[0].found
    else:
        found = find_in_cones(shared_point([s.lifted for s in sets], sets[0].ambient_dimension))
    shown = Certificate(found.kind, found.vector, question, sets, cuts=found.cuts, gap=found.gap)
    return Decision(found.kind == "farkas", shown)


def is_bounded(asked: Any) -> Decision:
    """Decide whether a set is bounded; one that is empty is. Undecided sets count as not."""
    lift = shared_point([asked.lifted], asked.ambient_dimension)
    n = asked.ambient_dimension
    proof, cuts, gap = recession_in_cones(lift)
    rows = rows_with_cuts(lift, cuts, lift.directions)
    if proof.kind == "undecided":
        shown = Certificate("undecided", proof.vector, "is_bounded", (asked,), gap=gap)
        return Decision(False, shown)
    if proof.kind == "recession":
        # Further variables alone may go on for ever while the points don't.
        way = proof.vector if any(proof.vector[:n]) else _way_of_points(rows, n)
        empty = is_empty((asked,), "is_bounded")
        if empty.value:
            return Decision(True, empty.certificate)
        if not isinstance(way, list) and empty.certificate.kind == "undecided":
            # The direction leads on from a point of the set, of which none was found.
            gap = empty.certificate.gap
            shown = Certificate("undecided", way, "is_bounded", (asked,), gap=gap)
            return Decision(False, shown)
        if not isinstance(way, list):
            point = empty.certificate.exact
            shown = Certificate("recession", way, "is_bounded", (asked,), point=point)  # type: ignore[arg-type]
            return Decision(False, shown)
        shown = Certificate("multipliers", tuple(way), "is_bounded", (asked,), cuts=cuts)
        return Decision(True, shown)
    shown = Certificate(proof.kind, proof.vector, "is_bounded", (asked,), cuts=cuts)
    return Decision(True, shown)


def _way_of_points(rows: Rows, n: int) -> Any:
    """Return a direction of the recession cone that moves points, or a proof that there is none.

    For each coordinate and sign: rows of the cone and ``+-d_k >= 1`` have a point, or weights that
    contradict; scaled, these make ``+-x_k`` of the rows.
    """
    shown = []
    split = rows.num_equalities
    for k in range(n):
        for sign in (1.0, -1.0):
            last = np.zeros((1, rows.A.shape[1]))
            last[0, k] = -sign
            cone = Rows(
                np.concatenate([rows.A, last]), np.append(np.zeros(len(rows.b)), -1.0), split
            )
            proof = find_point(cone)
            if proof.kind == "point":
                return proof.vector
            weight = proof.vector[-1]
            shown.append(tuple(v / weight for v in proof.vector[:-1]))
    return shown


def meet_by_reach(*sets: Any) -> bool | None:
    """Tell whether two sets meet by how far they reach, None where that is left open.

    It is asked where one has many points or members, and the other one reaches quickly. Curved
    sets that come as near as rounding count as touching.
    """
    if not any(each._HAS_QUICK_SUPPORT for each in sets):
        return None
    if any(each.is_empty() for each in sets):
        return False
    if not sets[0].ambient_dimension:
        return True
    if not all(each.is_bounded() for each in sets) or sets[1]._has_matrices():
        return None
    has_few = all(_has_few_corners(each) for each in sets)
    exact = _by_corners(*sets) if has_few else None
    if exact is not None:
        return exact
    quick = meet_by_plane(*sets) if _is_left_to_planes(*sets) else None
    if quick is not None:
        return quick
    known = reached(*sets)
    if known.is_apart:
        return False
    if surround(*sets):
        return True
    exact = None if has_few else _by_corners(*sets)
    if exact is not None:
        return exact
    if known.is_near and any(each.lifted.cones for each in sets):
        return True
    kinds = (each._hull_of_points() for each in sets)
    fewer = tuple(
        each if kind is None else kind(found)
        for each, kind, found in zip(sets, kinds, known.points, strict=True)
    )
    if fewer[0] is sets[0] and fewer[1] is sets[1]:
        return None
    return True if not is_empty(fewer, "intersects_with").value else None


_FEW_CORNERS = 500
"""So many rows of numbers are asked in fractions at once; more of them in floats before."""


def _is_left_to_planes(one: Any, other: Any) -> bool:
    """Tell whether corners don't tell exactly whether two sets meet."""
    if one.corners is None:
        one, other = other, one
    return one.corners is None or (other.corners is None and not hasattr(other, "form"))


def _has_few_corners(of: Any) -> bool:
    return of.corners is None or sum(map(len, of.corners.numbers())) <= _FEW_CORNERS


def _by_corners(one: Any, other: Any) -> bool | None:
    """Tell exactly whether two sets meet, where corners tell all of one and nearly of the other.

    The other one has them, too, or is an ellipsoid.
    """
    if one.corners is None and other.corners is not None:
        one, other = other, one
    if one.corners is None:
        return None
    if other.corners is not None:
        return corners_meet(one.corners, other.corners)
    form = getattr(other, "form", None)
    return None if form is None else corners_meet_ball(one.corners, *form)
