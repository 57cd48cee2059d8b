"""Is there a point, where there are many more weights than rows: of hulls of many points.

A weight is a variable of which rows ask that it isn't negative, and equations alone ask more. A
point needs no more of them than there are other rows (Caratheodory 1911), and the proof that
there is none is about those rows. So few weights are asked exactly, the others left at zero;
where there is no point, the weights that the proof misses are added, and it is asked again
(sifting, Bixby, Gregory, Lustig, Marsten and Shanno 1992). Floats choose the first ones: those of
the least squares with weights that aren't negative (Lawson and Hanson 1974).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
import math

import numpy as np

from scene_graph_ros.convex.solve.exact.proof import Proof
from scene_graph_ros.convex.solve.exact.rational_simplex import whole_rows
from scene_graph_ros.convex.solve.exact.rows import Rows

__all__ = ["Weights", "find_by_few", "weights_of"]

_FEWEST = 24
"""So many weights, and more than that in all, are worth a choice."""

_PER_ROW = 2
"""Weights that are taken at a time, for each row that is about them."""


@dataclass(frozen=True)
class Weights:
    """The columns of a polyhedron's weights, and for each the row that keeps it from below 0."""

    columns: np.ndarray
    rows: np.ndarray


def weights_of(rows: Rows) -> Weights | None:
    """Return the weights where they are many more than other rows, else None."""
    if rows.A.shape[1] < _FEWEST:
        return None
    split, is_there = rows.num_equalities, rows.A != 0.0
    inequalities = is_there[split:]
    alone = (inequalities.sum(axis=1) == 1) & (rows.b[split:] == 0.0)
    alone &= rows.A[split:].min(axis=1, initial=0.0) < 0.0
    alone_rows = np.flatnonzero(alone)
    columns = inequalities[alone_rows].argmax(axis=1)
    is_only = inequalities[:, columns].sum(axis=0) == 1
    found = Weights(columns[is_only], split + alone_rows[is_only])
    others = len(rows.b) - len(found.rows)
    return found if len(found.columns) > _FEWEST + _PER_ROW * others else None


def find_by_few(rows: Rows, weights: Weights, find: Callable[[Rows], Proof]) -> Proof:
    """Return the answer of ``find`` for all rows, asked of few weights at a time."""
    left = np.delete(np.arange(len(rows.b)), weights.rows)
    free = np.delete(np.arange(rows.A.shape[1]), weights.columns)
    at_once = _PER_ROW * (len(left) + 1)
    chosen = _first_choice(rows, weights, left, free, at_once)
    whole = None
    while True:
        few = np.flatnonzero(chosen)
        columns = np.concatenate([free, weights.columns[few]])
        # Equations first, in the order that they have.
        kept = np.concatenate([left, weights.rows[few]])
        proof = find(Rows(rows.A[np.ix_(kept, columns)], rows.b[kept], rows.num_equalities))
        if proof.kind == "point":
            return Proof("point", _placed(proof.vector, columns, rows.A.shape[1]))
        whole = whole or _Whole(rows, weights, left)
        prices = whole.prices(proof.vector[: len(left)])
        missed = np.flatnonzero([price < 0 for price in prices])
        if not len(missed):
            return Proof("farkas", whole.multipliers(proof.vector[: len(left)], prices))
        worst = sorted(missed.tolist(), key=lambda k: prices[k])[:at_once]
        chosen[worst] = True


def _placed(vector: tuple[Fraction, ...], places: np.ndarray, size: int) -> tuple[Fraction, ...]:
    """Return a vector of zeros with these entries in their places."""
    found = [Fraction(0)] * size
    for place, value in zip(places.tolist(), vector, strict=True):
        found[place] = value
    return tuple(found)


class _Whole:
    """The weights' columns in the rows that are about them, as whole numbers."""

    def __init__(self, rows: Rows, weights: Weights, left: np.ndarray) -> None:
        self._rows, self._weights, self._left = rows, weights, left
        of_weights = rows.A[np.ix_(left, weights.columns)].T
        self._columns, _, self._factors = whole_rows(of_weights, np.zeros(len(of_weights)))
        self._units = -rows.A[weights.rows, weights.columns]

    def prices(self, y: tuple[Fraction, ...]) -> list[Fraction]:
        """Return the multiplier that each weight's own row needs beside those of the others.

        It is the remainder of the weighted sum of the others in the weight's column, so that
        nothing is left; below zero, the others show nothing about the weight.
        """
        denominator = math.lcm(*(v.denominator for v in y))
        whole = np.array([v.numerator * (denominator // v.denominator) for v in y], dtype=object)
        sums = self._columns @ whole
        return [
            Fraction(total, denominator * factor) / Fraction(unit)
            for total, factor, unit in zip(
                sums.tolist(), self._factors, self._units.tolist(), strict=True
            )
        ]

    def multipliers(self, y: tuple[Fraction, ...], prices: list[Fraction]) -> tuple[Fraction, ...]:
        """Return the multipliers of all rows."""
        places = np.concatenate([self._left, self._weights.rows])
        return _placed((*y, *prices), places, len(self._rows.b))


def _first_choice(
    rows: Rows, weights: Weights, left: np.ndarray, free: np.ndarray, count: int
) -> np.ndarray:
    """Return the weights to ask first: those of the least squares, and those next to them."""
    from scipy.optimize import nnls

    A, b = rows.scaled
    split, m = rows.num_equalities, len(left)
    slacks = np.eye(m)[:, split:]
    # What free variables can make up for plays no part.
    basis, _ = np.linalg.qr(A[np.ix_(left, free)], mode="complete")
    rank = np.linalg.matrix_rank(A[np.ix_(left, free)]) if len(free) else 0
    onto = basis[:, rank:].T
    G = onto @ np.concatenate([A[np.ix_(left, weights.columns)], slacks], axis=1)
    goal = onto @ b[left]
    chosen = np.zeros(len(weights.columns), dtype=np.bool_)
    try:
        shares, _ = nnls(G, goal)
    except RuntimeError:  # its steps are used up
        shares = np.zeros(G.shape[1])
    prices = (G.T @ (goal - G @ shares))[: len(chosen)]
    chosen[np.argsort(-prices, kind="stable")[:count]] = True
    chosen |= shares[: len(chosen)] > 0.0
    return chosen
