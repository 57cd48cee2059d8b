"""Costs and constraints of many edges at once: rows of a program, and bounds from multipliers."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
import functools
import itertools
from typing import Any, NamedTuple

import numpy as np

from scene_graph_ros.convex.graphs.expressions.packed_terms import join, Packed
from scene_graph_ros.convex.graphs.expressions.term_cones import into_dual
from scene_graph_ros.convex.graphs.model.edge_terms import EdgeTerms
from scene_graph_ros.convex.graphs.relax.edge_programs import (
    lower_edges,
    weights_of_edges,
)
from scene_graph_ros.convex.graphs.relax.minorant_kernels import minorants_of_edges
from scene_graph_ros.convex.solve.cones.cone_program import (
    Cone,
    ConeProgram,
    ConeSolution,
    Rows,
)

__all__ = ["Columns", "EdgeTable", "Lowered", "Minorants"]


class Columns(NamedTuple):
    """Which variables of a program edges have, ``(m,)`` each.

    The first of the tail's set, which others follow, and of the head's; and the divisors of their
    terms, None where nothing scales them.
    """

    tails: np.ndarray
    heads: np.ndarray
    scales: np.ndarray | None


class Minorants(NamedTuple):
    """``a + alpha . (xu - center) + beta . (xv - center)``, below costs at all allowed points.

    ``totals (m, 3)`` are a, its rounding, and its size. ``slopes`` are alpha and beta
    of each edge, edge after edge, ``rounding`` their rounding, and ``firsts (m, 2)``
    where the alpha and the beta of an edge begin.
    """

    totals: np.ndarray
    slopes: np.ndarray
    rounding: np.ndarray
    firsts: np.ndarray


class Lowered(NamedTuple):
    """Rows of a program for all edges, of each cone, and the unit of costs."""

    rows: tuple[Rows, ...]
    unit: float


class EdgeTable(Sequence[EdgeTerms]):
    """The terms of edges."""

    def __init__(self, terms: Sequence[EdgeTerms]) -> None:
        self._terms = tuple(terms)

    def __len__(self) -> int:
        """Return the number of edges."""
        return len(self._terms)

    def __getitem__(self, edge: Any) -> Any:
        """Return one edge's terms."""
        return self._terms[edge]

    def __iter__(self) -> Iterator[EdgeTerms]:
        """Return all of them in turn."""
        return iter(self._terms)

    @functools.cached_property
    def _packed(self) -> Packed:
        return join([each.packed for each in self._terms])

    @functools.cached_property
    def _others(self) -> list[tuple[Cone, slice]]:
        """Cones whose duals kernels don't know, and which of all edges' rows are in them."""
        found: list[tuple[Cone, slice]] = []
        first = 0
        for each in self._terms:
            layout = each.layout
            if not each.is_quadratic:
                rows = layout.slices()[layout.rest + 3 :]
                found += [
                    (cone, slice(first + s.start, first + s.stop))
                    for cone, s in zip(layout.cone_kinds, rows, strict=True)
                    if cone is not Cone.SECOND_ORDER
                ]
            first += len(each.most)
        return found

    def costs_at_most(self) -> np.ndarray:
        """Return estimates of edges' largest costs, ``(m,)``: sizes of their costs."""
        return np.array([each.cost_at_most for each in self._terms])

    def lower(self, program: ConeProgram, columns: Columns, unit: float) -> Lowered:
        """Add costs and constraints to a program, costs in units; with scales, perspectives."""
        none = np.full(len(self), -1)
        scales = none if columns.scales is None else columns.scales
        asked = np.column_stack([columns.tails, columns.heads, scales])
        own = program.variables(sum(each.layout.rest for each in self._terms))
        entries, constants, counts, balls, matrices, at, costs = lower_edges(
            *self._packed, asked, unit, own[0] if len(own) else 0
        )
        program.add_cost(at, costs)
        parts, ends = (
            list(itertools.accumulate(each.tolist(), initial=0)) for each in (entries[3], counts)
        )
        sizes = {
            Cone.SECOND_ORDER: balls.tolist(),
            Cone.SEMIDEFINITE: matrices.tolist(),
            Cone.EXPONENTIAL: [3] * (int(counts[Cone.EXPONENTIAL]) // 3),
        }
        rows = []
        for cone in Cone:
            here = slice(*parts[cone : cone + 2])
            mine = [tuple(each[here] for each in entries[:3])]
            constant = constants[slice(*ends[cone : cone + 2])]
            rows.append(program.add_entries(cone, mine, constant, sizes.get(cone)))
        return Lowered(tuple(rows), unit)

    def weights(self, solution: ConeSolution, lowered: Lowered) -> np.ndarray:
        """Return a solution's multipliers of all edges' rows, ``(r,)``, edge after edge."""
        equations, *others = (solution.dual(rows) for rows in lowered.rows)
        asked = equations, np.concatenate(others), lowered.unit
        return weights_of_edges(*self._packed, len(self), *asked)

    def minorants(self, weights: np.ndarray, with_cost: bool = True) -> Minorants:
        """Return affine functions that are below the costs wherever the constraints hold.

        With any weights: vectors of atoms are made short enough and weights of inequalities
        taken as 0 where they are negative. Without cost, such that are at most 0 there.
        """
        if self._others:
            weights = weights.copy()
            for cone, rows in self._others:
                # What they weigh is at least 0 where the constraint holds.
                weights[rows] = -into_dual(cone, -weights[rows])
        return Minorants(*minorants_of_edges(*self._packed, len(self), weights, with_cost))
