"""Points, and optima, of rows and cones: each cone is cut out by planes, more where it matters.

`cones` has the planes. The centre of the largest ball within rows and cuts is asked;
where it is outside a cone, a cut through it is added (Elzinga and Moore, "A central cutting plane
algorithm", 1975). For optima the best point is cut off instead
(Kelley 1960), and the part inside on the way to it counts. Rows and cuts together are linear, so
that proofs about them are exact.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction

import numpy as np

from scene_graph_ros.convex.solve.cones.lift import Lift, Semidefinite
from scene_graph_ros.convex.solve.cutting.cones import (
    Cone,
    cut_row,
    excess,
    first_cuts,
    holds,
    new_cuts,
    share_of_way,
    shortened,
)
from scene_graph_ros.convex.solve.cutting.proposals import Proposal, propose
from scene_graph_ros.convex.solve.exact.feasibility import (
    exact_point,
    find_deepest,
    find_point,
)
from scene_graph_ros.convex.solve.exact.maximize import maximize
from scene_graph_ros.convex.solve.exact.proof import Proof
from scene_graph_ros.convex.solve.exact.rows import Rows
from scene_graph_ros.geometry.tolerances import EPSILON

__all__ = [
    "Cut",
    "Found",
    "Reached",
    "find_in_cones",
    "maximize_in_cones",
    "proposed_cuts",
    "rows_with_cuts",
    "tangent_cuts",
]

_MOST_ROUNDS = 300
"""Rounds of cutting; a set whose width shrinks by a tenth in each is then below rounding."""

_CLOSE = 1e-11
"""Relative to a ball's radius: a point outside by less can't be told from one on it for long."""

_GAP = 1e-11
"""Relative to the first gap of an optimum: where cutting ends."""

_UNAIDED = 20
"""Rounds after which the solver of cone programs is asked where to cut balls, once."""

_MOST_PROOFS = 4
"""Rounds in which rows without room between them are asked for a point exactly, which may take
long; after them only where floats see that point in the cones, and in the last round."""

_MOST_IDLE = 10
"""Rounds in a row that took less than a tenth of the gap away: rounding is what is left."""

_ROUNDING = 16.0 * EPSILON
"""Relative to an optimum: a gap that is rounding."""


_NEAR_PROPOSAL = 1e-5
"""Relative to the largest eigenvalue: those below it are planes that a solver's point is at."""


@dataclass(frozen=True, eq=False)
class Cut:
    """A plane of one of a lift's cones, in the words of `cones`: ``u (k,)``."""

    cone: int
    u: np.ndarray


@dataclass(frozen=True)
class Found:
    """``point`` or ``farkas`` with its exact vector, of the rows and then the cuts.

    ``undecided``: the vector is a point, outside the balls by ``gap`` of their radii.
    """

    kind: str
    vector: tuple[Fraction, ...]
    cuts: tuple[Cut, ...]
    gap: float


@dataclass(frozen=True)
class Reached:
    """The largest ``c . x`` found, at a point inside, and a bound that no point exceeds.

    ``size`` is by how much the first bound was above the first point; ``cuts`` are all there were.
    """

    value: float
    x: np.ndarray
    upper: float
    ray: np.ndarray | None
    size: float = 0.0
    cuts: tuple[Cut, ...] = ()


def _cuts(cones: Sequence[Cone], x: np.ndarray, least: float = 0.0) -> list[Cut]:
    return [Cut(k, u) for k, cone in enumerate(cones) for u in new_cuts(cone, x, least)]


def rows_with_cuts(lift: Lift, cuts: Sequence[Cut], rows: Rows | None = None) -> Rows:
    """Return the rows of a lift, or others of its variables, and those of the cuts behind them."""
    start = lift.rows if rows is None else rows
    found = [cut_row(lift.cones[cut.cone], cut.u, lift.num_variables) for cut in cuts]
    A = np.array([row for row, _ in found]).reshape(len(cuts), lift.num_variables)
    b = np.array([side for _, side in found])
    return Rows(np.concatenate([start.A, A]), np.append(start.b, b), start.num_equalities)


def tangent_cuts(cones: Sequence[Cone], x: np.ndarray) -> list[Cut]:
    """Return the planes of cones on the side of a point ``(k,)``, wherever it is."""
    return _cuts(cones, x, -np.inf)


def _is_in_cones(cones: Sequence[Cone], x: Sequence[Fraction]) -> bool:
    return all(holds(cone, x) for cone in cones)


def find_in_cones(lift: Lift, first: Sequence[Cut] = ()) -> Found:
    """Return a point of a lift, proof that there is none, or that neither was found.

    ``first`` are cuts to begin with, of whoever knows where it matters.
    """
    if not lift.cones:
        proof = find_point(lift.rows)
        return Found(proof.kind, proof.vector, (), 0.0)
    search = _Search(lift, first)
    found = search.take_proposal(None) if lift.matrices else None
    for k in range(_MOST_ROUNDS):
        if found is not None or not search.goes_on:
            break
        found = search.take_round()
        if found is None and k == _UNAIDED and not lift.matrices:
            found = search.take_proposal(search.x)
    return found or search.last()


class _Search:
    """Rows and the cuts so far, and the point that was nearest to being in all cones."""

    def __init__(self, lift: Lift, first: Sequence[Cut]) -> None:
        self.lift = lift
        self.cuts = [Cut(k, u) for k, cone in enumerate(lift.cones) for u in first_cuts(cone)]
        self.cuts += first
        self.goes_on, self.proofs = True, 0
        self.x = self.x_best = np.zeros(lift.num_variables)
        self.best = np.inf

    def take_proposal(self, about: np.ndarray | None) -> Found | None:
        """Take the point that the solver of cone programs proposes, or the cuts.

        Cuts come with the point, too: without those around balls, optima have no bounds.
        """
        proposed = propose(self.lift, None, about)
        point = None if proposed is None else exact_point(self.lift.rows, proposed.x)
        if point is not None and _is_in_cones(self.lift.cones, point):
            return Found("point", point, tuple(self.cuts), 0.0)
        self.cuts += proposed_cuts(self.lift, proposed)
        return None

    def take_round(self) -> Found | None:
        """Ask for the deepest point within rows and cuts, and cut it off."""
        cones, rows = self.lift.cones, rows_with_cuts(self.lift, self.cuts)
        deepest = find_deepest(rows)
        self.x = deepest.x
        outside, has_room = self._excess(), deepest.radius > 0.0
        if outside <= 0.0 if has_room else outside <= _CLOSE or self.proofs < _MOST_PROOFS:
            self.proofs += not has_room
            proof = _proof_at(rows, self.x) if has_room else find_point(rows)
            if self._is_proof(proof):
                return Found(proof.kind, proof.vector, tuple(self.cuts), 0.0)
            self.x = np.array([float(v) for v in proof.vector])
            outside = self._excess()
        if outside < self.best:
            self.best, self.x_best = outside, self.x
        is_small = deepest.radius <= _CLOSE * deepest.cap
        added = _cuts(cones, self.x, -_CLOSE)
        self.goes_on = bool(added) and not (self.best <= _CLOSE and is_small)
        self.cuts += added if self.goes_on else []
        return None

    def last(self) -> Found:
        """Return the answer when no more rounds are taken."""
        if self.proofs >= _MOST_PROOFS:
            proof = find_point(rows_with_cuts(self.lift, self.cuts))
            if self._is_proof(proof):
                return Found(proof.kind, proof.vector, tuple(self.cuts), 0.0)
        vector = tuple(Fraction(v) for v in self.x_best.tolist())
        return Found("undecided", vector, tuple(self.cuts), max(self.best, 0.0))

    def _excess(self) -> float:
        return max(excess(cone, self.x) for cone in self.lift.cones)

    def _is_proof(self, proof: Proof) -> bool:
        return proof.kind == "farkas" or _is_in_cones(self.lift.cones, proof.vector)


def _proof_at(rows: Rows, x: np.ndarray) -> Proof:
    """Return x as a point of rows exactly, or the answer of `find_point`."""
    point = exact_point(rows, x)
    return find_point(rows) if point is None else Proof("point", point)


def proposed_cuts(lift: Lift, proposed: Proposal | None) -> list[Cut]:
    """Return cuts by the proposal of the solver of cone programs."""
    if proposed is None:
        return []
    found = [Cut(k, shortened(u)) for k, u in proposed.planes]
    return found + _cuts(lift.cones, proposed.x, -_NEAR_PROPOSAL)


def _cuts_of_ray(lift: Lift, ray: np.ndarray) -> list[Cut]:
    """Return planes that cut off a direction in which a matrix does not stay semidefinite."""
    return [
        Cut(k, u)
        for k, cone in enumerate(lift.cones)
        if isinstance(cone, Semidefinite)
        for u in new_cuts(cone, ray, _CLOSE)
    ]


def maximize_in_cones(
    lift: Lift, c: np.ndarray, inner: np.ndarray, cuts: Sequence[Cut]
) -> Reached:
    """Return the largest ``c . x``, from a point inside, until the bound is near."""
    cuts, best = list(cuts), Reached(float(c @ inner), inner, np.inf, None)
    if lift.matrices:
        cuts += proposed_cuts(lift, propose(lift, c, inner))
    size, idle, is_proposed = 0.0, 0, bool(lift.matrices)
    for _ in range(_MOST_ROUNDS):
        optimum = maximize(rows_with_cuts(lift, cuts), c, inner)
        if optimum.ray is not None:
            # Planes bound a matrix less than the cone does, and its directions, too.
            more = _cuts_of_ray(lift, optimum.ray)
            if not more:
                return Reached(np.inf, inner, np.inf, optimum.ray)
            cuts += more
            continue
        share = min((share_of_way(cone, inner, optimum.x) for cone in lift.cones), default=1.0)
        x = inner + share * (optimum.x - inner)
        value = float(c @ x)
        size = size or max(0.0, optimum.upper - best.value)
        upper = min(best.upper, optimum.upper)
        improvement = (best.upper - best.value) - (upper - max(value, best.value))
        idle = 0 if improvement > 0.1 * (upper - max(value, best.value)) else idle + 1
        if value > best.value:
            best = Reached(value, x, upper, None, size)
        else:
            best = Reached(best.value, best.x, upper, None, size)
        is_near = upper - best.value <= _GAP * size + _ROUNDING * abs(upper)
        if is_near or (idle > _MOST_IDLE and is_proposed):
            break
        added = _cuts(lift.cones, optimum.x) + _cuts(lift.cones, x, -1e-9)
        if idle > _MOST_IDLE:
            # Where planes are nearly parallel cuts at corners between them say little.
            is_proposed, idle = True, 0
            added += proposed_cuts(lift, propose(lift, c, inner))
        if not added:
            break
        cuts += added
    return replace(best, cuts=tuple(cuts))
