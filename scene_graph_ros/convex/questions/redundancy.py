"""Which rows follow from others, each with its proof."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np

from scene_graph_ros.convex.errors import ConvexSetError
from scene_graph_ros.convex.questions.certificates import (
    Certificate,
    Decision,
    ExactRows,
    length_bound,
)
from scene_graph_ros.convex.questions.quick_answers import rows_that_follow
from scene_graph_ros.convex.questions.row_geometry import later_twins
from scene_graph_ros.convex.solve.exact.feasibility import find_deepest, find_point
from scene_graph_ros.convex.solve.exact.maximize import prove_bound
from scene_graph_ros.convex.solve.exact.proof import Proof
from scene_graph_ros.convex.solve.exact.rational_simplex import fractions_of
from scene_graph_ros.convex.solve.exact.rows import is_inside, Rows
from scene_graph_ros.convex.solve.floats.quick_points import OPEN
from scene_graph_ros.convex.solve.floats.quick_rows import INSIDE
from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.reals import as_float

__all__ = ["Reduction", "checked_tolerance", "contained_in", "implied_rows", "reduce_rows"]


@one_line()
@dataclass(frozen=True)
class Reduction:
    """Rows that can be left out, and those that can't.

    ``removed`` has for each row its multipliers of all rows ``(m,)``, 0 for removed ones, whose
    weighted sum is the row with a right side no larger than its own moved out by the tolerance;
    ``kept`` has for each row a point ``(n,)`` that fulfils the other kept rows and not this one.
    Of an empty set, rows are kept that contradict each other, without points; removed ones have
    the weights that show it.
    """

    removed: dict[int, tuple[Fraction, ...]]
    kept: dict[int, tuple[Fraction, ...]]

    def verify(self, polyhedron: Any, tol: float = 1e-9) -> bool:
        """Tell whether this is shown of a polyhedron and the tolerance asked, in fractions.

        That each kept row is needed is not shown of an empty set.
        """
        rows = ExactRows(polyhedron.lifted.rows)
        is_each_row_there = sorted([*self.removed, *self.kept]) == list(range(len(rows.b)))
        return (
            is_each_row_there
            and all(
                not any(weights[k] for k in self.removed)
                and (
                    rows.contradict(weights)
                    or rows.implies(weights, rows.A[i], _moved(rows, i, tol))
                )
                for i, weights in self.removed.items()
            )
            and all(self._is_needed(rows, i, tol) for i in self.kept if self.kept[i])
        )

    def _is_needed(self, rows: ExactRows, i: int, tol: float) -> bool:
        """Tell whether the point of a row is beyond it, moved out, and fulfils the others."""
        heights = [rows.height(k, self.kept[i]) for k in self.kept]
        return all(
            height > _moved(rows, k, tol) if k == i else height <= rows.b[k]
            for k, height in zip(self.kept, heights, strict=True)
        )


def checked_tolerance(tol: Any, label: str = "contained_in") -> float:
    """Return a finite tolerance. Raises ConvexSetError."""
    number = as_float(tol)
    if number is None or not np.isfinite(number):
        raise ConvexSetError(f"{label}: tol must be a finite number, not {quoted(tol)}")
    return number


def _moved(rows: ExactRows, i: int, tol: float) -> Fraction:
    """Return the right side of row i, moved out by a distance."""
    return rows.b[i] + Fraction(tol) * length_bound(rows.A[i])


def _moved_out(row: np.ndarray, side: float, tol: float) -> Fraction:
    """Return a right side for a row that is moved out by a distance."""
    return Fraction(side) + Fraction(tol) * Fraction(float(np.linalg.norm(row)))


def _inner_point(rows: Rows) -> Proof:
    """Return a point as deep inside as floats find it, or the one of `find_point`."""
    deepest = find_deepest(rows)
    if is_inside(rows, deepest.x):
        return Proof("point", fractions_of(deepest.x))
    return find_point(rows)


def contained_in(asked: Any, other: Any, tol: float) -> Decision:
    """Decide whether a set of linear rows is in a polyhedron, as `HPolyhedron.contained_in`."""
    tol = checked_tolerance(tol, "contained_in")
    rows = asked.lifted.rows
    start = _inner_point(rows)
    sets = (asked, other)
    if start.kind == "farkas":
        return Decision(True, Certificate("farkas", start.vector, "contained_in", sets, tol=tol))
    shown = []
    for row, side in zip(other.A, other.b, strict=True):
        c = np.zeros(rows.A.shape[1])
        c[: len(row)] = row
        proof = prove_bound(rows, c, _moved_out(row, side, tol), start)
        if proof.kind == "point":
            return Decision(
                False, Certificate("point", proof.vector, "contained_in", sets, tol=tol)
            )
        shown.append(proof.vector)
    return Decision(True, Certificate("multipliers", tuple(shown), "contained_in", sets, tol=tol))


def implied_rows(polyhedron: Any, other: Any, tol: float) -> list[int]:
    """Return the rows of another polyhedron that follow from those of the first."""
    tol = checked_tolerance(tol, "intersection")
    quick = rows_that_follow(polyhedron, other, tol)
    implied = np.flatnonzero(quick == INSIDE).tolist()
    left_open = np.flatnonzero(quick == OPEN).tolist()
    if not left_open:
        return implied
    rows = polyhedron.lifted.rows
    start = _inner_point(rows)
    if start.kind == "farkas":
        return list(range(len(other.b)))
    for i in left_open:
        bound = _moved_out(other.A[i], float(other.b[i]), tol)
        if prove_bound(rows, other.A[i], bound, start).kind == "multipliers":
            implied.append(i)
    return sorted(implied)


def reduce_rows(polyhedron: Any, tol: float) -> Reduction:
    """Find rows of a polyhedron that follow from the others, moved out by a distance.

    One after the other is left out if those still there imply it. At last each is proven from
    those that stay, or comes back, so that distances do not add up.
    """
    tol = checked_tolerance(tol, "reduce_inequalities")
    start = _inner_point(polyhedron.lifted.rows)
    if start.kind == "farkas":
        return _of_empty(start, len(polyhedron.b))
    twins = later_twins(polyhedron.A, polyhedron.b) if tol >= 0.0 else {}
    if not twins:
        return _reduce(polyhedron.lifted.rows, start, tol)
    alone = np.delete(np.arange(len(polyhedron.b)), list(twins))
    reduced = _reduce(Rows(polyhedron.A[alone], polyhedron.b[alone]), start, tol)
    removed = {
        int(alone[i]): _spread(weights, alone, len(polyhedron.b))
        for i, weights in reduced.removed.items()
    }
    for i, (twin, factor) in twins.items():
        weights = removed.get(twin)
        if weights is None:
            unit = [Fraction(0)] * len(polyhedron.b)
            unit[twin] = Fraction(1)
            weights = tuple(unit)
        removed[i] = tuple(factor * weight for weight in weights)
    return Reduction(removed, {int(alone[i]): point for i, point in reduced.kept.items()})


def _spread(weights: tuple[Fraction, ...], places: np.ndarray, size: int) -> tuple[Fraction, ...]:
    """Return weights of some rows as weights of all."""
    found = [Fraction(0)] * size
    for place, weight in zip(places.tolist(), weights, strict=True):
        found[place] = weight
    return tuple(found)


def _reduce(rows: Rows, start: Proof, tol: float) -> Reduction:
    """Find rows that follow from others, of a set of which a point is known."""
    A, b = rows.A, rows.b
    stays = np.ones(len(b), dtype=bool)

    def ask(i: int) -> tuple[Proof, np.ndarray]:
        others = np.flatnonzero(stays & (np.arange(len(b)) != i))
        return prove_bound(rows.some(others), A[i], _moved_out(A[i], b[i], tol), start), others

    nothing = np.zeros(0, dtype=np.int64)
    found = {i: (proof, nothing) for i, proof in _met_first(rows, start, tol).items()}
    # These are cut off by no other row, whichever of them stay.
    sure = set(found)
    for i in range(len(b)):
        if i not in sure:
            found[i] = ask(i)
            stays[i] = found[i][0].kind == "point"
    removed = {}
    for i in np.flatnonzero(~stays).tolist():
        proof, others = found[i]
        if any(w != 0 for w, k in zip(proof.vector, others.tolist(), strict=True) if not stays[k]):
            proof, others = ask(i)
        if proof.kind == "point":
            stays[i] = True
            continue
        weights = [Fraction(0)] * len(b)
        for k, weight in zip(others.tolist(), proof.vector, strict=True):
            weights[k] = weight
        removed[i] = tuple(weights)
    came_back = any(stays[i] and found[i][0].kind != "point" for i in found)
    kept = {
        i: (ask(i) if came_back and i not in sure else found[i])[0].vector
        for i in np.flatnonzero(stays).tolist()
    }
    return Reduction(removed, kept)


def _met_first(rows: Rows, start: Proof, tol: float) -> dict[int, Proof]:
    """Return rows that a ray from a point of the set meets alone, each with a point beyond.

    The point is before all other rows and beyond this one moved out: so no others imply it. Rays
    go along each row's normal; rows that they don't meet first may still be needed.
    """
    x = np.array([float(v) for v in start.vector])
    slack = rows.b - rows.A @ x
    lengths = np.linalg.norm(rows.A, axis=1)
    if len(x) == 0 or len(slack) < 2 or not (slack > 0.0).all():
        return {}
    ways = rows.A[lengths > 0.0] / lengths[lengths > 0.0, None]
    with np.errstate(divide="ignore", over="ignore"):
        reach = np.where((rate := ways @ rows.A.T) > 0.0, slack / rate, np.inf)
    found: dict[int, Proof] = {}
    for way, distances in zip(ways, reach, strict=True):
        i = int(distances.argmin())
        if i in found or not np.isfinite(distances[i]):
            continue
        behind = np.delete(distances, i).min()
        beyond = x + 0.5 * (distances[i] + min(behind, 2.0 * distances[i])) * way
        others = np.delete(np.arange(len(slack)), i)
        if is_inside(Rows(rows.A[others], rows.b[others]), beyond):
            point = fractions_of(beyond)
            height = sum(
                (Fraction(a) * v for a, v in zip(rows.A[i].tolist(), point, strict=True)),
                Fraction(0),
            )
            if height > _moved_out(rows.A[i], float(rows.b[i]), tol):
                found[i] = Proof("point", point)
    return found


def _of_empty(farkas: Proof, num_rows: int) -> Reduction:
    """Keep the rows that contradict each other: they imply any others."""
    kept = [i for i in range(num_rows) if farkas.vector[i] != 0]
    return Reduction(
        {i: farkas.vector for i in range(num_rows) if i not in kept}, dict.fromkeys(kept, ())
    )
