"""What an edge costs and asks, of points about the centres of its two sets."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
import functools
from typing import Any, NamedTuple

import numpy as np

from scene_graph_ros.geometry.optimization.errors import ConvexSetError
from scene_graph_ros.geometry.optimization.graphs.expressions import (
    Affine,
    Constraint,
    Cost,
    value_of,
)
from scene_graph_ros.geometry.optimization.graphs.placed_set import PlacedSet
from scene_graph_ros.geometry.optimization.graphs.term_atoms import (
    lower_atom,
    minorant_of,
    size_of,
    slope_of,
    weights_of,
)
from scene_graph_ros.geometry.optimization.graphs.term_cones import (
    into_dual,
    outside,
    solver_factors,
)
from scene_graph_ros.geometry.optimization.solve.cone_program import (
    Cone,
    ConeProgram,
    ConeSolution,
    Rows,
)
from scene_graph_ros.geometry.tolerances import EPSILON

__all__ = ["EdgeTerms", "Minorant", "Multipliers", "Part", "terms_of"]

_NEGATIVE = 1e-12
"""Relative to the terms of a cost: how far below 0 rounding may take its least value."""


@dataclass(frozen=True, eq=False)
class Part:
    """``Mu @ (xu - center) + Mv @ (xv - center) + m``, ``(k,)``, and what rounding makes of m."""

    Mu: np.ndarray
    Mv: np.ndarray
    m: np.ndarray
    size: np.ndarray

    def at(self, xu: np.ndarray, xv: np.ndarray) -> np.ndarray:
        """Return the value ``(k,)`` at points less their centres."""
        return self.Mu @ xu + self.Mv @ xv + self.m


class Multipliers(NamedTuple):
    """What a solver says of an edge: a vector for each atom, weights of both kinds of rows."""

    atoms: tuple[np.ndarray, ...]
    equations: np.ndarray
    inequalities: np.ndarray
    cones: tuple[np.ndarray, ...] = ()


class Minorant(NamedTuple):
    """``a + alpha . (xu - center) + beta . (xv - center)``, below the cost for all allowed points.

    ``rounding`` is what floats may be off by: of the constant, and of the slopes ``(n,)``.
    """

    a: float
    alpha: np.ndarray
    beta: np.ndarray
    rounding: float
    rounding_alpha: np.ndarray
    rounding_beta: np.ndarray


class _Lowered(NamedTuple):
    """Rows of a program for the atoms, for equations, for inequalities and for cones."""

    atoms: tuple[Rows, ...]
    equations: Rows
    inequalities: Rows
    cones: tuple[Rows, ...]


@dataclass(frozen=True, eq=False)
class EdgeTerms:
    """An edge's cost - atoms and a linear rest - and its constraints.

    These are zero, at most zero, or in cones.
    """

    u: PlacedSet
    v: PlacedSet
    kinds: tuple[str, ...]
    atoms: tuple[Part, ...]
    rest: Part
    equations: Part
    inequalities: Part
    cones: tuple[Part, ...] = ()
    cone_kinds: tuple[Cone, ...] = ()

    def cost(self, xu: np.ndarray, xv: np.ndarray) -> float:
        """Return the cost at points less their centres."""
        total = float(self.rest.at(xu, xv)[0])
        for kind, part in zip(self.kinds, self.atoms, strict=True):
            total += value_of(kind, part.at(xu, xv))
        return total

    def gradient(self, xu: np.ndarray, xv: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return a slope of the cost along both points; one of several where there are."""
        along_u, along_v = self.rest.Mu[0].copy(), self.rest.Mv[0].copy()
        for kind, part in zip(self.kinds, self.atoms, strict=True):
            y = slope_of(kind, part.at(xu, xv))
            along_u += y @ part.Mu
            along_v += y @ part.Mv
        return along_u, along_v

    def most(self) -> float:
        """Return about what it costs at most, over the boxes around both sets: a size of it."""
        parts = zip((*self.kinds, "norm_inf"), (*self.atoms, self.rest), strict=True)
        return sum(size_of(kind, self._most_of(part), part.m) for kind, part in parts)

    def _most_of(self, part: Part) -> np.ndarray:
        return np.abs(part.Mu) @ self.u.half + np.abs(part.Mv) @ self.v.half + np.abs(part.m)

    def violation(self, xu: np.ndarray, xv: np.ndarray) -> float:
        """Return by how much constraints are broken, beside the size of their terms."""
        broken = np.concatenate(
            [np.abs(self.equations.at(xu, xv)), np.maximum(self.inequalities.at(xu, xv), 0.0)]
        )
        worst = float(np.max(broken / self.row_sizes, initial=0.0))
        for cone, part, size in zip(self.cone_kinds, self.cones, self._cone_sizes, strict=True):
            worst = max(worst, outside(cone, part.at(xu, xv)) / size)
        return worst

    @functools.cached_property
    def _atom_sizes(self) -> list[np.ndarray]:
        """What the terms of each atom are at most, row by row."""
        return [self._most_of(part) for part in self.atoms]

    @functools.cached_property
    def _cone_sizes(self) -> list[float]:
        """What each cone's rows are divided by; their terms are as large."""
        return [float(self._most_of(part).max(initial=0.0)) or 1.0 for part in self.cones]

    @functools.cached_property
    def _cone_factors(self) -> list[np.ndarray]:
        """What each cone's rows are multiplied by, for the solver."""
        return [
            solver_factors(cone, len(part.m)) / size
            for cone, part, size in zip(self.cone_kinds, self.cones, self._cone_sizes, strict=True)
        ]

    @functools.cached_property
    def row_sizes(self) -> np.ndarray:
        """What rows of constraints are divided by; their terms are as large."""
        sizes = np.concatenate([self._most_of(self.equations), self._most_of(self.inequalities)])
        return np.where(sizes > 0.0, sizes, 1.0)

    @property
    def is_constrained(self) -> bool:
        """Whether there are constraints."""
        return bool(len(self.equations.m) or len(self.inequalities.m) or self.cones)

    def lower(
        self,
        program: ConeProgram,
        yu: np.ndarray,
        yv: np.ndarray,
        scale: np.ndarray | None,
        unit: float,
    ) -> _Lowered:
        """Add cost and constraints to a program, ``scale`` times as large; costs are in units.

        With ``scale``, the index of a variable in an array, these are the perspectives.
        """
        atoms = tuple(
            lower_atom(
                program,
                kind,
                functools.partial(self._blocks, part, yu, yv, scale),
                scale,
                unit,
                most,
            )
            for kind, part, most in zip(self.kinds, self.atoms, self._atom_sizes, strict=True)
        )
        for columns, values in self._blocks(self.rest, yu, yv, scale, 1.0 / unit)[0]:
            if values.any():
                program.add_cost(columns, values[0])
        rows = []
        sizes = np.split(self.row_sizes, [len(self.equations.m)])
        for cone, part, sign, size in (
            (Cone.ZERO, self.equations, 1.0, sizes[0]),
            (Cone.NONNEGATIVE, self.inequalities, -1.0, sizes[1]),
        ):
            if not len(size):
                rows.append(Rows(cone, 0, 0))
                continue
            factor = sign / size
            blocks, constant = self._blocks(part, yu, yv, scale, factor[:, None])
            rows.append(program.add_rows(cone, blocks, constant))
        cones = tuple(
            program.add_rows(cone, *self._blocks(part, yu, yv, scale, factors[:, None]))
            for cone, part, factors in zip(
                self.cone_kinds, self.cones, self._cone_factors, strict=True
            )
        )
        return _Lowered(atoms, rows[0], rows[1], cones)

    def _blocks(
        self,
        part: Part,
        yu: np.ndarray,
        yv: np.ndarray,
        scale: np.ndarray | None,
        factor: Any,
    ) -> tuple[list[tuple[np.ndarray, np.ndarray]], np.ndarray]:
        over_u, over_v = self._maps[id(part)]
        blocks = [(yu, factor * over_u), (yv, factor * over_v)]
        constant = factor * part.m[:, None]
        if scale is None:
            return blocks, constant[:, 0]
        return [*blocks, (scale, constant)], np.zeros(len(part.m))

    @functools.cached_property
    def _maps(self) -> dict[int, tuple[np.ndarray, np.ndarray]]:
        """Each part's matrices in the variables of the sets."""
        parts = (*self.atoms, self.rest, self.equations, self.inequalities, *self.cones)
        return {id(part): (part.Mu @ self.u.S, part.Mv @ self.v.S) for part in parts}

    def multipliers(self, solution: ConeSolution, lowered: _Lowered, unit: float) -> Multipliers:
        """Return what a solution says of this edge, in the edge's own units."""
        atoms = tuple(
            weights_of(kind, solution.dual(rows), unit, most)
            for kind, most, rows in zip(self.kinds, self._atom_sizes, lowered.atoms, strict=True)
        )
        sizes = np.split(self.row_sizes, [len(self.equations.m)])
        return Multipliers(
            atoms,
            -unit * solution.dual(lowered.equations) / sizes[0],
            unit * solution.dual(lowered.inequalities) / sizes[1],
            tuple(
                unit * solution.dual(rows) * factors
                for rows, factors in zip(lowered.cones, self._cone_factors, strict=True)
            ),
        )

    def minorant(self, multipliers: Multipliers, with_cost: bool = True) -> Minorant:
        """Return an affine function that is below the cost wherever the constraints hold.

        Whatever the multipliers: vectors of atoms are made short enough and weights of
        inequalities taken as 0 where they are negative. Without cost, one that is at most 0 there.
        """
        weighted = [
            (self.equations, multipliers.equations),
            (self.inequalities, np.maximum(multipliers.inequalities, 0.0)),
        ]
        for cone, part, z in zip(self.cone_kinds, self.cones, multipliers.cones, strict=True):
            # What they weigh is at least 0 where the constraint holds.
            weighted.append((part, -into_dual(cone, z)))
        a = 0.0
        if with_cost:
            weighted.append((self.rest, np.ones(1)))
            for kind, part, raw in zip(self.kinds, self.atoms, multipliers.atoms, strict=True):
                y, conjugate = minorant_of(kind, raw)
                a -= conjugate
                weighted.append((part, y))
        terms = sum(len(part.m) for part, _ in weighted) + len(self.u.half) + 8
        alpha, beta = np.zeros(len(self.u.half)), np.zeros(len(self.v.half))
        size, size_alpha, size_beta = abs(a), np.zeros(len(alpha)), np.zeros(len(beta))
        for part, y in weighted:
            if not len(y):
                continue
            a += float(y @ part.m)
            alpha += y @ part.Mu
            beta += y @ part.Mv
            magnitudes = np.abs(y)
            size += float(magnitudes @ part.size)
            size_alpha += magnitudes @ np.abs(part.Mu)
            size_beta += magnitudes @ np.abs(part.Mv)
        unit = 2.0 * terms * EPSILON
        return Minorant(a, alpha, beta, unit * size, unit * size_alpha, unit * size_beta)


def terms_of(
    costs: Sequence[Cost],
    constraints: Sequence[Constraint],
    ends: tuple[tuple[int, PlacedSet], tuple[int, PlacedSet]],
    label: str,
) -> EdgeTerms:
    """Return costs and constraints of an edge between numbered sets, ``(number, set)``.

    Raises ConvexSetError, which names the edge, where a linear cost may be negative.
    """
    (_, u), (_, v) = ends
    atoms = [atom for cost in costs for atom in cost.atoms]
    rests = [_part(cost.rest, ends) for cost in costs]
    rest = _joined(rests, ends)
    total = (
        Part(*(np.sum(each, axis=0, keepdims=True) for each in rest))
        if rests
        else Part(
            np.zeros((1, len(u.center))), np.zeros((1, len(v.center))), np.zeros(1), np.zeros(1)
        )
    )
    low = float(total.m[0])
    for placed, matrix in ((u, total.Mu), (v, total.Mv)):
        low -= float(placed.reach(-matrix)[0][0]) if matrix.any() else 0.0
    size = float(total.size[0] + (np.abs(total.Mu) @ u.half + np.abs(total.Mv) @ v.half)[0])
    if low < -_NEGATIVE * size:
        raise ConvexSetError(
            f"{label}: the linear part of the cost is {low:.6g} at some points of the sets; costs"
            " must be at least 0 on all of both sets"
        )
    flat = [c for c in constraints if c.cone is None]
    equations = [_part(c.rows, ends) for c in flat if c.is_equation]
    inequalities = [_part(c.rows, ends) for c in flat if not c.is_equation]
    return EdgeTerms(
        u,
        v,
        tuple(atom.kind for atom in atoms),
        tuple(_part(atom.of, ends) for atom in atoms),
        total,
        Part(*_joined(equations, ends)),
        Part(*_joined(inequalities, ends)),
        tuple(_part(c.rows, ends) for c in constraints if c.cone is not None),
        tuple(c.cone for c in constraints if c.cone is not None),
    )


def _part(of: Affine, ends: tuple[tuple[int, PlacedSet], tuple[int, PlacedSet]]) -> Part:
    (key_u, u), (key_v, v) = ends
    k = len(of)
    Mu = of.terms.get(key_u, np.zeros((k, len(u.center))))
    Mv = of.terms.get(key_v, np.zeros((k, len(v.center))))
    m = of.constant + Mu @ u.center + Mv @ v.center
    size = np.abs(of.constant) + np.abs(Mu) @ np.abs(u.center) + np.abs(Mv) @ np.abs(v.center)
    return Part(np.asarray(Mu), np.asarray(Mv), m, size)


def _joined(
    parts: Sequence[Part], ends: tuple[tuple[int, PlacedSet], tuple[int, PlacedSet]]
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    (_, u), (_, v) = ends
    return (
        np.concatenate([np.zeros((0, len(u.center))), *(p.Mu for p in parts)]),
        np.concatenate([np.zeros((0, len(v.center))), *(p.Mv for p in parts)]),
        np.concatenate([np.zeros(0), *(p.m for p in parts)]),
        np.concatenate([np.zeros(0), *(p.size for p in parts)]),
    )
