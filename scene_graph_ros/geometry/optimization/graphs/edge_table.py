"""Costs and constraints of many edges at once: rows of a program, and bounds from multipliers.

Edges that have the same kinds of terms, in the same numbers of rows and variables, are a family;
its arrays have an entry for each of them, so that a graph takes as many calls as it has families.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
import functools
from typing import Any, NamedTuple

import numpy as np

from scene_graph_ros.geometry.optimization.graphs.edge_terms import (
    EdgeTerms,
    Layout,
    Part,
    sizes_of,
)
from scene_graph_ros.geometry.optimization.graphs.placed_set import PlacedSet
from scene_graph_ros.geometry.optimization.graphs.term_atoms import (
    lower_atoms,
    minorants_of,
    sizes_of_atoms,
    values_of,
    weights_of,
)
from scene_graph_ros.geometry.optimization.graphs.term_cones import into_dual, solver_factors
from scene_graph_ros.geometry.optimization.solve.cone_program import (
    Cone,
    ConeProgram,
    ConeSolution,
    Rows,
)
from scene_graph_ros.geometry.tolerances import EPSILON

__all__ = ["Columns", "EdgeTable", "Family", "Lowered", "Minorants", "Multipliers"]


class Columns(NamedTuple):
    """Which variables of a program edges have, ``(m,)`` each.

    The first of the tail's set, which others follow, and of the head's; and what their terms are
    scaled by, None where nothing scales them.
    """

    tails: np.ndarray
    heads: np.ndarray
    scales: np.ndarray | None


class Multipliers(NamedTuple):
    """What a solver says of a family: ``(G, k)`` for each atom, both kinds of rows, each cone."""

    atoms: tuple[np.ndarray, ...]
    equations: np.ndarray
    inequalities: np.ndarray
    cones: tuple[np.ndarray, ...] = ()


class Minorants(NamedTuple):
    """``a + alpha . (xu - center) + beta . (xv - center)``, below costs at all allowed points.

    ``a (G,)``, ``alpha`` and ``beta`` ``(G, n)``. ``rounding`` is what floats may be off by, of
    the constants and the slopes.
    """

    a: np.ndarray
    alpha: np.ndarray
    beta: np.ndarray
    rounding: np.ndarray
    rounding_alpha: np.ndarray
    rounding_beta: np.ndarray


class Lowered(NamedTuple):
    """Rows of a program for a family's atoms, equations, inequalities and cones."""

    atoms: tuple[Rows, ...]
    equations: Rows
    inequalities: Rows
    cones: tuple[Rows, ...]


@dataclass(frozen=True, eq=False)
class Family:
    """Edges ``(G,)`` of one layout: rows ``Mu @ (xu - center) + Mv @ (xv - center) + m``.

    ``Mu (G, R, nu)``, ``Mv (G, R, nv)``; ``m (G, R)``, and ``size`` what rounding makes of it.
    """

    edges: np.ndarray
    layout: Layout
    tails: Sequence[PlacedSet]
    heads: Sequence[PlacedSet]
    Mu: np.ndarray
    Mv: np.ndarray
    m: np.ndarray
    size: np.ndarray

    @functools.cached_property
    def half_u(self) -> np.ndarray:
        """How far the tails' sets reach from their centres along each axis, ``(G, nu)``."""
        return np.array([placed.half for placed in self.tails])

    @functools.cached_property
    def half_v(self) -> np.ndarray:
        """The same of the heads' sets."""
        return np.array([placed.half for placed in self.heads])

    @functools.cached_property
    def most(self) -> np.ndarray:
        """What the terms of each row are at most, ``(G, R)``, over the boxes around both sets."""
        over_u = (np.abs(self.Mu) @ self.half_u[:, :, None])[:, :, 0]
        over_v = (np.abs(self.Mv) @ self.half_v[:, :, None])[:, :, 0]
        return over_u + over_v + np.abs(self.m)

    @functools.cached_property
    def _over(self) -> tuple[np.ndarray, np.ndarray]:
        """The rows' matrices in the variables of the sets, ``(G, R, k)``."""
        Su, Sv = (np.array([placed.S for placed in ends]) for ends in (self.tails, self.heads))
        return self.Mu @ Su, self.Mv @ Sv

    @functools.cached_property
    def _cone_factors(self) -> list[np.ndarray]:
        """What each cone's rows ``(G, k)`` are multiplied by, for the solver."""
        rows = self.layout.slices()[self.layout.rest + 3 :]
        return [
            solver_factors(cone, count) / sizes_of(self.most[:, s].max(axis=1, keepdims=True))
            for cone, count, s in zip(self.layout.cone_kinds, self.layout.cones, rows, strict=True)
        ]

    def take(self, some: np.ndarray, edges: np.ndarray) -> Family:
        """Return some of them, by their places here, under new numbers."""
        tails, heads = ([ends[k] for k in some] for ends in (self.tails, self.heads))
        arrays = (each[some] for each in (self.Mu, self.Mv, self.m, self.size))
        return Family(edges, self.layout, tails, heads, *arrays)

    def terms(self, k: int) -> EdgeTerms:
        """Return the k-th edge's alone."""
        rows = Part(self.Mu[k], self.Mv[k], self.m[k])
        u, v = self.tails[k], self.heads[k]
        return EdgeTerms(u, v, self.layout, rows, self.size[k], self.most[k])

    def costs_at_most(self) -> np.ndarray:
        """Return about what edges cost at most ``(G,)``: sizes of their costs."""
        slices = self.layout.slices()
        total = self.most[:, slices[self.layout.rest]][:, 0].copy()
        for kind, s in zip(self.layout.kinds, slices, strict=False):
            total += sizes_of_atoms(kind, self.most[:, s], self.m[:, s])
        return total

    def costs(self, xu: np.ndarray, xv: np.ndarray) -> np.ndarray:
        """Return costs ``(G,)`` at points ``(G, n)`` less their centres."""
        values = (self.Mu @ xu[:, :, None] + self.Mv @ xv[:, :, None])[:, :, 0] + self.m
        slices = self.layout.slices()
        total = values[:, slices[self.layout.rest]][:, 0]
        for kind, s in zip(self.layout.kinds, slices, strict=False):
            total = total + values_of(kind, values[:, s])
        return total

    def lower(self, program: ConeProgram, columns: Columns, unit: float) -> Lowered:
        """Add costs and constraints to a program, costs in units; with scales, perspectives."""
        over_u, over_v = self._over
        yu = columns.tails[self.edges][:, None] + np.arange(over_u.shape[2])
        yv = columns.heads[self.edges][:, None] + np.arange(over_v.shape[2])
        scale = None if columns.scales is None else columns.scales[self.edges]

        def blocks(
            s: slice, factor: Any
        ) -> tuple[list[tuple[np.ndarray, np.ndarray]], np.ndarray]:
            shape = self.m[:, s].shape
            factors = factor * np.ones(shape)  # to broadcast takes twice as long
            constant = factors * self.m[:, s]
            found = [
                (yu, factors[:, :, None] * over_u[:, s]),
                (yv, factors[:, :, None] * over_v[:, s]),
            ]
            if scale is None:
                return found, constant
            return [*found, (scale[:, None], constant[:, :, None])], np.zeros(shape)

        slices, rest = self.layout.slices(), self.layout.rest
        atoms = tuple(
            lower_atoms(program, kind, functools.partial(blocks, s), scale, unit, self.most[:, s])
            for kind, s in zip(self.layout.kinds, slices, strict=False)
        )
        for at, values in blocks(slices[rest], 1.0 / unit)[0]:
            if values.any():
                program.add_cost(at.ravel(), values[:, 0].ravel())
        rows = []
        for cone, s, sign in (
            (Cone.ZERO, slices[rest + 1], 1.0),
            (Cone.NONNEGATIVE, slices[rest + 2], -1.0),
        ):
            factor = sign / sizes_of(self.most[:, s])
            rows.append(program.add_blocks(cone, *blocks(s, factor)))
        cones = tuple(
            program.add_blocks(cone, *blocks(s, factors))
            for cone, s, factors in zip(
                self.layout.cone_kinds, slices[rest + 3 :], self._cone_factors, strict=True
            )
        )
        return Lowered(atoms, rows[0], rows[1], cones)

    def multipliers(self, solution: ConeSolution, lowered: Lowered, unit: float) -> Multipliers:
        """Return what a solution says of these edges, in the edges' own units."""
        slices, rest, count = self.layout.slices(), self.layout.rest, len(self.edges)
        atoms = tuple(
            weights_of(kind, solution.dual(rows), unit, self.most[:, s])
            for kind, s, rows in zip(self.layout.kinds, slices, lowered.atoms, strict=False)
        )
        equations, inequalities = (
            sign * unit * solution.dual(rows).reshape(count, -1) / sizes_of(self.most[:, s])
            for rows, s, sign in (
                (lowered.equations, slices[rest + 1], -1.0),
                (lowered.inequalities, slices[rest + 2], 1.0),
            )
        )
        cones = tuple(
            unit * solution.dual(rows).reshape(count, -1) * factors
            for rows, factors in zip(lowered.cones, self._cone_factors, strict=True)
        )
        return Multipliers(atoms, equations, inequalities, cones)

    def minorants(self, given: Multipliers, with_cost: bool = True) -> Minorants:
        """Return affine functions that are below the costs wherever the constraints hold.

        Whatever the multipliers: vectors of atoms are made short enough and weights of
        inequalities taken as 0 where they are negative. Without cost, such that are at most 0
        there.
        """
        count = len(self.edges)
        a, weights = np.zeros(count), []
        for kind, raw in zip(self.layout.kinds, given.atoms, strict=True):
            y, conjugate = minorants_of(kind, raw)
            a -= conjugate
            weights.append(y)
        weights.append(np.ones((count, 1)))
        if not with_cost:
            a, weights = np.zeros(count), [np.zeros_like(y) for y in weights]
        weights += [given.equations, np.maximum(given.inequalities, 0.0)]
        for cone, z in zip(self.layout.cone_kinds, given.cones, strict=True):
            # What they weigh is at least 0 where the constraint holds.
            weights.append(-np.array([into_dual(cone, each) for each in z]))
        Y = np.concatenate(weights, axis=1)[:, None, :]
        sizes = np.abs(Y)
        alpha, beta = (Y @ self.Mu)[:, 0], (Y @ self.Mv)[:, 0]
        size = np.abs(a) + np.sum(sizes[:, 0] * self.size, axis=1)
        a = a + np.sum(Y[:, 0] * self.m, axis=1)
        unit = 2.0 * (Y.shape[2] + self.Mu.shape[2] + 8) * EPSILON
        off_alpha, off_beta = (unit * (sizes @ np.abs(M))[:, 0] for M in (self.Mu, self.Mv))
        return Minorants(a, alpha, beta, unit * size, off_alpha, off_beta)


class EdgeTable(Sequence[EdgeTerms]):
    """What edges cost and ask: families, and each edge alone by its number."""

    def __init__(
        self, families: Sequence[Family], terms: Mapping[int, EdgeTerms] | None = None
    ) -> None:
        self.families = tuple(families)
        self._terms = dict(terms or {})
        count = sum(len(family.edges) for family in families)
        self._family, self._place = np.zeros(count, int), np.zeros(count, int)
        for k, family in enumerate(self.families):
            self._family[family.edges] = k
            self._place[family.edges] = np.arange(len(family.edges))

    @classmethod
    def of(cls, terms: Sequence[EdgeTerms]) -> EdgeTable:
        """Return single edges' terms together."""
        alike: dict[Any, list[int]] = {}
        for k, each in enumerate(terms):
            shapes = (each.rows.Mu.shape[1], each.rows.Mv.shape[1])
            sizes = (each.u.S.shape[1], each.v.S.shape[1])
            alike.setdefault((each.layout, shapes, sizes), []).append(k)
        families = []
        for edges in alike.values():
            some = [terms[k] for k in edges]
            families.append(
                Family(
                    np.array(edges),
                    some[0].layout,
                    [each.u for each in some],
                    [each.v for each in some],
                    np.array([each.rows.Mu for each in some]),
                    np.array([each.rows.Mv for each in some]),
                    np.array([each.rows.m for each in some]),
                    np.array([each.size for each in some]),
                )
            )
        return cls(families, dict(enumerate(terms)))

    def __len__(self) -> int:
        """Return the number of edges."""
        return len(self._family)

    def __getitem__(self, edge: Any) -> Any:
        """Return one edge's terms, which are kept."""
        if edge not in self._terms:
            self._terms[edge] = self.families[self._family[edge]].terms(self._place[edge])
        return self._terms[edge]

    def __iter__(self) -> Iterator[EdgeTerms]:
        """Return all of them in turn."""
        return (self[e] for e in range(len(self)))

    def take(self, some: Sequence[int]) -> EdgeTable:
        """Return some edges in a new order, their numbers."""
        chosen = np.asarray(some, dtype=np.int64)
        of, place = self._family[chosen], self._place[chosen]
        families = []
        for k in np.unique(of):
            edges = np.flatnonzero(of == k)
            families.append(self.families[k].take(place[edges], edges))
        return EdgeTable(families)

    def costs_at_most(self) -> np.ndarray:
        """Return about what edges cost at most, ``(m,)``: sizes of their costs."""
        found = np.zeros(len(self))
        for family in self.families:
            found[family.edges] = family.costs_at_most()
        return found

    def costs(self, xu: Sequence[np.ndarray], xv: Sequence[np.ndarray]) -> np.ndarray:
        """Return costs ``(m,)`` at points ``(n,)`` of tails and heads less their centres."""
        found = np.zeros(len(self))
        for family in self.families:
            edges = family.edges.tolist()
            at = (np.array([points[e] for e in edges]) for points in (xu, xv))
            found[family.edges] = family.costs(*at)
        return found

    def lower(self, program: ConeProgram, columns: Columns, unit: float) -> list[Lowered]:
        """Add costs and constraints of all to a program, see `Family.lower`."""
        return [family.lower(program, columns, unit) for family in self.families]

    def multipliers(
        self, solution: ConeSolution, lowered: Sequence[Lowered], unit: float
    ) -> list[Multipliers]:
        """Return what a solution says of each family."""
        return [
            family.multipliers(solution, rows, unit)
            for family, rows in zip(self.families, lowered, strict=True)
        ]

    def minorants(
        self, multipliers: Sequence[Multipliers], with_cost: bool = True
    ) -> list[Minorants]:
        """Return what is below each family's costs."""
        return [
            family.minorants(each, with_cost)
            for family, each in zip(self.families, multipliers, strict=True)
        ]
