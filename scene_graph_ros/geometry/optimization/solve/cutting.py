"""Points, and optima, of rows and cones: each cone is cut out by planes, more where it matters.

What planes there are `cones` says. The centre of the largest ball within rows and cuts is asked;
where it is outside a cone, a cut through it is added (Elzinga and Moore, "A central cutting plane
algorithm", 1975). For optima the best point is cut off instead
(Kelley 1960), and what is inside on the way to it counts. Rows and cuts together are linear, so
that what is proven of them is exact.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from scene_graph_ros.geometry.optimization.lift import Lift, Semidefinite
from scene_graph_ros.geometry.optimization.solve.cones import (
    Cone,
    cut_row,
    excess,
    first_cuts,
    holds,
    new_cuts,
    share_of_way,
    shortened,
)
from scene_graph_ros.geometry.optimization.solve.feasibility import (
    exact_point,
    find_deepest,
    find_point,
)
from scene_graph_ros.geometry.optimization.solve.maximize import maximize
from scene_graph_ros.geometry.optimization.solve.proof import Proof
from scene_graph_ros.geometry.optimization.solve.proposals import Proposal, propose
from scene_graph_ros.geometry.optimization.solve.rows import Rows
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

    ``size`` is by how much the first bound was above the first point.
    """

    value: float
    x: np.ndarray
    upper: float
    ray: np.ndarray | None
    size: float = 0.0


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
    cones = lift.cones
    cuts = [Cut(k, u) for k, cone in enumerate(cones) for u in first_cuts(cone)] + list(first)
    best, x_best = np.inf, np.zeros(lift.num_variables)
    if lift.matrices:
        proposed = propose(lift, None)
        point = None if proposed is None else exact_point(lift.rows, proposed.x)
        if point is not None and _is_in_cones(cones, point):
            return Found("point", point, (), 0.0)
        cuts += proposed_cuts(lift, proposed)
    for _ in range(_MOST_ROUNDS):
        rows = rows_with_cuts(lift, cuts)
        deepest = find_deepest(rows)
        x = deepest.x
        if deepest.radius <= 0.0:
            proof = find_point(rows)
            if proof.kind == "farkas" or _is_in_cones(cones, proof.vector):
                return Found(proof.kind, proof.vector, tuple(cuts), 0.0)
            x = np.array([float(v) for v in proof.vector])
        outside = max(excess(cone, x) for cone in cones)
        if outside <= 0.0:
            proof = _proof_at(rows, x)
            if proof.kind == "farkas" or _is_in_cones(cones, proof.vector):
                return Found(proof.kind, proof.vector, tuple(cuts), 0.0)
        if outside < best:
            best, x_best = outside, x
        if best <= _CLOSE and deepest.radius <= _CLOSE * deepest.cap:
            break
        added = _cuts(cones, x, -_CLOSE)
        if not added:
            break
        cuts += added
    vector = tuple(Fraction(v) for v in x_best.tolist())
    return Found("undecided", vector, tuple(cuts), max(best, 0.0))


def _proof_at(rows: Rows, x: np.ndarray) -> Proof:
    """Return x as a point of rows exactly, or what `find_point` says."""
    point = exact_point(rows, x)
    return find_point(rows) if point is None else Proof("point", point)


def proposed_cuts(lift: Lift, proposed: Proposal | None) -> list[Cut]:
    """Return cuts of what the solver of cone programs proposes."""
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
        cuts += proposed_cuts(lift, propose(lift, c))
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
            added += proposed_cuts(lift, propose(lift, c))
        if not added:
            break
        cuts += added
    return best
