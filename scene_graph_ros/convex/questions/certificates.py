"""Records of certificates, with a check of them in rational arithmetic."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np

from scene_graph_ros.convex.solve.cones.lift import Lift, shared_point
from scene_graph_ros.convex.solve.cutting.cones import holds, is_cut
from scene_graph_ros.convex.solve.cutting.cutting import Cut, rows_with_cuts
from scene_graph_ros.geometry.one_line import one_line

__all__ = ["Certificate", "Decision", "ExactRows", "length_bound"]

Weights = tuple[Fraction, ...]

_ZERO = Fraction(0)
"""Most entries of rows are 0: one for all."""


@one_line()
@dataclass(frozen=True, eq=False)
class Certificate:
    """The proof of an answer about the sets ``of``.

    ``exact`` is a vector of fractions, or some of them; ``vector`` the same in floats. It belongs
    to the rows of the sets (`ConvexSet.lift`, joined in one point where there are several):
    equations first, then inequalities, each set's in turn. ``kind`` is

    - ``point``: a point of all sets, with their further variables behind its coordinates. For
      `contained_in` it is in the one set and not in the other.
    - ``farkas``: weights of the rows, at least 0 for inequalities; the weighted sum of the rows
      has no variables and a negative right side, so that no point fulfils them.
      Where sets are curved, rows of ``cuts`` come last, planes behind which a cone of the lift is.
    - ``undecided``: a point that is outside a curved set by ``gap`` of its radius, or of its
      largest eigenvalue, where nothing was proven; such sets touch, or nearly do. For `is_bounded`
      a direction.
    - ``recession``: a direction that leads on for ever from any point of the set, as ``point``.
    - ``multipliers``: for `is_bounded`, weights of the rows, positive for inequalities, whose
      weighted sum has no variables, of rows that span all directions; or weights for each of
      ``x_1, -x_1, x_2, ...`` whose weighted sum of rows it is. For `contained_in`, weights for
      each row of the other set, whose weighted sum is that row with a right side no larger.
    """

    kind: str
    exact: Weights | tuple[Weights, ...]
    question: str
    of: tuple[Any, ...]
    point: Weights | None = None
    tol: float = 0.0
    cuts: tuple[Cut, ...] = ()
    gap: float = 0.0

    @property
    def vector(self) -> np.ndarray:
        """The vector ``(k,)``, or the vectors ``(j, k)``, in floats."""
        return np.array(self.exact, dtype=np.float64)

    def verify(self, *sets: Any) -> bool:
        """Tell whether the certificate proves its claim about these sets, exactly.

        Without sets, of those that the question was asked of.
        """
        of = sets or self.of
        asked = of[:1] if self.question == "contained_in" else of
        lift = shared_point([s.lift() for s in asked], of[0].ambient_dimension)
        if self.kind == "undecided" or not all(is_cut(lift.cones[c.cone], c.u) for c in self.cuts):
            return False
        if self.kind == "point":
            return self._verify_point(lift, of)
        is_of_directions = self.question == "is_bounded" and self.kind != "farkas"
        start = lift.directions if is_of_directions else lift.rows
        cuts = () if self.kind == "recession" else self.cuts
        rows = ExactRows(rows_with_cuts(lift, cuts, start))
        check = getattr(self, f"_verify_{self.kind}")
        return bool(check(rows, of))

    def _verify_point(self, lift: Lift, of: tuple[Any, ...]) -> bool:
        if not _is_point(lift, self.exact):
            return False
        if self.question != "contained_in":
            return True
        other = ExactRows(of[1].lift().rows)
        return any(
            _dot(row, self.exact) > side + Fraction(self.tol) * length_bound(row)
            for row, side in zip(other.A, other.b, strict=True)
        )

    def _verify_farkas(self, rows: ExactRows, _of: tuple[Any, ...]) -> bool:
        return rows.contradict(self.exact)

    def _verify_recession(self, rows: ExactRows, of: tuple[Any, ...]) -> bool:
        lift = shared_point([of[0].lift()], of[0].ambient_dimension)
        rates = [_dot(row, self.exact) for row in rows.A]
        return (
            any(self.exact[: of[0].ambient_dimension])
            and not any(rates[: rows.split])
            and all(rate <= 0 for rate in rates)
            and self.point is not None
            and _is_point(lift, self.point)
            and all(holds(matrix, self.exact) for matrix in lift.matrices)  # type: ignore[arg-type]
        )

    def _verify_multipliers(self, rows: ExactRows, of: tuple[Any, ...]) -> bool:
        if self.question == "contained_in":
            other = of[1].lift().rows
            goals = ExactRows(other)
            return all(
                rows.implies(weights, row, side + Fraction(self.tol) * length_bound(row))
                for weights, row, side in zip(self.exact, goals.A, goals.b, strict=True)
            )
        n = of[0].ambient_dimension
        if self.exact and isinstance(self.exact[0], tuple):
            units = [
                [Fraction(s * (j == k)) for j in range(rows.n)] for k in range(n) for s in (1, -1)
            ]
            return all(
                rows.implies(weights, unit, None)
                for weights, unit in zip(self.exact, units, strict=True)
            )
        is_positive = all(w > 0 for w in self.exact[rows.split :])  # type: ignore[operator]
        return is_positive and not any(rows.sums(self.exact)) and rows.rank() == rows.n


@one_line()
class Decision(NamedTuple):
    """An answer and its proof: ``value, certificate``."""

    value: bool
    certificate: Certificate


def _dot(a: Sequence[Any], b: Sequence[Any]) -> Fraction:
    return sum((x * y for x, y in zip(a, b, strict=True) if x and y), _ZERO)


def length_bound(row: Sequence[Fraction]) -> Fraction:
    """Return the length of a row to rounding: a tolerance is known no better."""
    return Fraction(float(np.linalg.norm([float(v) for v in row])))


def _is_point(lift: Lift, x: Any) -> bool:
    """Tell whether x fulfils all rows of a lift and is in all its cones."""
    return ExactRows(lift.rows).hold(x) and all(holds(cone, x) for cone in lift.cones)


class ExactRows:
    """Rows as fractions."""

    def __init__(self, rows: Any) -> None:
        self.A = [[Fraction(v) if v else _ZERO for v in row] for row in rows.A.tolist()]
        self.b = [Fraction(v) for v in rows.b.tolist()]
        self.split, self.n = rows.num_equalities, rows.A.shape[1]

    def hold(self, x: Any) -> bool:
        """Tell whether a point fulfils all."""
        slacks = [side - _dot(row, x) for row, side in zip(self.A, self.b, strict=True)]
        return not any(slacks[: self.split]) and all(s >= 0 for s in slacks)

    def height(self, i: int, x: Any) -> Fraction:
        """Return the left side of row i at a point."""
        return _dot(self.A[i], x)

    def contradict(self, weights: Any) -> bool:
        """Tell whether the weighted sum has no variables and a negative right side."""
        has_signs = all(w >= 0 for w in weights[self.split :])
        return has_signs and not any(self.sums(weights)) and _dot(weights, self.b) < 0

    def sums(self, weights: Any) -> list[Fraction]:
        """Return the weighted sum of the rows."""
        return [_dot(weights, [row[k] for row in self.A]) for k in range(self.n)]

    def implies(self, weights: Any, row: Sequence[Fraction], side: Fraction | None) -> bool:
        """Tell whether the weighted sum is a row, with no larger a right side if one is given."""
        return (
            all(w >= 0 for w in weights[self.split :])
            and self.sums(weights) == list(row)
            and (side is None or _dot(weights, self.b) <= side)
        )

    def rank(self) -> int:
        """Count the linearly independent rows, by elimination."""
        rows, rank = [list(row) for row in self.A], 0
        for k in range(self.n):
            pivot = next((i for i in range(rank, len(rows)) if rows[i][k] != 0), None)
            if pivot is None:
                continue
            rows[rank], rows[pivot] = rows[pivot], rows[rank]
            for i in range(rank + 1, len(rows)):
                factor = rows[i][k] / rows[rank][k]
                rows[i] = [a - factor * p for a, p in zip(rows[i], rows[rank], strict=True)]
            rank += 1
        return rank
