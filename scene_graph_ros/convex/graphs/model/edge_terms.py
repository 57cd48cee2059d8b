"""The terms of one edge, of points about the centres of its two sets."""

from __future__ import annotations

from dataclasses import dataclass
import functools
import itertools
from typing import NamedTuple

import numpy as np

from scene_graph_ros.convex.graphs.expressions.expressions import value_of
from scene_graph_ros.convex.graphs.expressions.packed_terms import Packed
from scene_graph_ros.convex.graphs.expressions.term_atoms import sizes_of_atoms, slope_of
from scene_graph_ros.convex.graphs.expressions.term_cones import outside
from scene_graph_ros.convex.graphs.model.placed_set import PlacedSet
from scene_graph_ros.convex.solve.cones.cone_program import Cone

__all__ = ["EdgeTerms", "Layout", "Part", "sizes_of"]


class Layout(NamedTuple):
    """Which rows an edge has: those of its atoms, the linear rest of its cost, its constraints.

    In this order: atoms, one row of the rest, equations, inequalities, cones.
    """

    kinds: tuple[str, ...]
    atoms: tuple[int, ...]
    """How many rows each atom has."""
    equations: int
    inequalities: int
    cone_kinds: tuple[Cone, ...]
    cones: tuple[int, ...]

    def slices(self) -> list[slice]:
        """Return the rows of each atom, of the rest, both kinds of rows and each cone."""
        counts = [*self.atoms, 1, self.equations, self.inequalities, *self.cones]
        ends = itertools.accumulate(counts, initial=0)
        return [slice(a, b) for a, b in itertools.pairwise(ends)]

    @property
    def is_constrained(self) -> bool:
        """Whether there are constraints."""
        return bool(self.equations or self.inequalities or self.cones)

    @property
    def rest(self) -> int:
        """Which of the slices is the rest; equations, inequalities and cones follow."""
        return len(self.atoms)


@dataclass(frozen=True, eq=False)
class Part:
    """``Mu @ (xu - center) + Mv @ (xv - center) + m``, ``(k,)``."""

    Mu: np.ndarray
    Mv: np.ndarray
    m: np.ndarray

    def at(self, xu: np.ndarray, xv: np.ndarray) -> np.ndarray:
        """Return the value ``(k,)`` at points less their centres."""
        return self.Mu @ xu + self.Mv @ xv + self.m


def sizes_of(most: np.ndarray) -> np.ndarray:
    """Return the divisors of rows, from bounds of their terms: never 0."""
    return np.where(most > 0.0, most, 1.0)


def sizes_of_costs(layout: Layout, m: np.ndarray, most: np.ndarray) -> np.ndarray:
    """Return estimates of the largest costs of edges of a layout ``(G,)``.

    From the rows' values at the centres and bounds of their terms, ``(G, R)``.
    """
    slices = layout.slices()
    total: np.ndarray = most[:, slices[layout.rest]][:, 0].copy()
    for kind, s in zip(layout.kinds, slices, strict=False):
        total += sizes_of_atoms(kind, most[:, s], m[:, s])
    return total


@dataclass(frozen=True, eq=False)
class EdgeTerms:
    """An edge's cost - atoms and a linear rest - and its constraints.

    These are zero, at most zero, or in cones. ``rows`` are of all of them, in the layout's order;
    ``size`` bounds their constants for rounding, and ``most`` bounds their terms,
    ``(R,)``. ``packed`` is all of it for kernels.
    """

    u: PlacedSet
    v: PlacedSet
    layout: Layout
    rows: Part
    size: np.ndarray
    most: np.ndarray
    packed: Packed

    @functools.cached_property
    def _parts(self) -> list[Part]:
        rows = self.rows
        return [Part(rows.Mu[s], rows.Mv[s], rows.m[s]) for s in self.layout.slices()]

    @property
    def equations(self) -> Part:
        """The rows that have to be zero."""
        return self._parts[self.layout.rest + 1]

    @property
    def inequalities(self) -> Part:
        """The rows that have to be at most zero."""
        return self._parts[self.layout.rest + 2]

    @property
    def cones(self) -> list[Part]:
        """The rows that have to be in the cones of the layout."""
        return self._parts[self.layout.rest + 3 :]

    def costs(self) -> list[tuple[str, Part, slice]]:
        """Return the kind of each function of its cost, its rows and which they are.

        The last is the linear rest, of the kind ``"sum"``.
        """
        kinds = (*self.layout.kinds, "sum")
        return list(zip(kinds, self._parts, self.layout.slices(), strict=False))

    def cost(self, xu: np.ndarray, xv: np.ndarray) -> float:
        """Return the cost at points less their centres."""
        values, slices = self.rows.at(xu, xv), self.layout.slices()
        total = float(values[slices[self.layout.rest]][0])
        for kind, rows in zip(self.layout.kinds, slices, strict=False):
            total += value_of(kind, values[rows])
        return total

    def gradient(self, xu: np.ndarray, xv: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return a slope of the cost along both points; one of several where there are."""
        rest = self._parts[self.layout.rest]
        along_u, along_v = rest.Mu[0].copy(), rest.Mv[0].copy()
        for kind, part in zip(self.layout.kinds, self._parts, strict=False):
            y = slope_of(kind, part.at(xu, xv))
            along_u += y @ part.Mu
            along_v += y @ part.Mv
        return along_u, along_v

    def violation(self, xu: np.ndarray, xv: np.ndarray) -> float:
        """Return by how much constraints are broken, beside the size of their terms."""
        if not self.layout.is_constrained:
            return 0.0
        values, slices, worst = self.rows.at(xu, xv), self.layout.slices(), 0.0
        equations, inequalities, *cones = slices[self.layout.rest + 1 :]
        broken = np.concatenate([np.abs(values[equations]), np.maximum(values[inequalities], 0.0)])
        worst = float(np.max(broken / self.row_sizes, initial=0.0))
        for cone, rows in zip(self.layout.cone_kinds, cones, strict=True):
            size = float(sizes_of(self.most[rows].max(initial=0.0)))
            worst = max(worst, outside(cone, values[rows]) / size)
        return worst

    @functools.cached_property
    def is_quadratic(self) -> bool:
        """Whether rows and second-order cones are enough for it."""
        cones = self.layout.cone_kinds
        return "exponential" not in self.layout.kinds and set(cones) <= {Cone.SECOND_ORDER}

    @property
    def cost_at_most(self) -> float:
        """An estimate of its largest cost: the size of its cost."""
        return float(self.packed.numbers[0])

    @functools.cached_property
    def row_sizes(self) -> np.ndarray:
        """The divisors of rows of equations and inequalities; their terms are as large."""
        equations, inequalities = self.layout.slices()[self.layout.rest + 1 :][:2]
        return sizes_of(np.concatenate([self.most[equations], self.most[inequalities]]))
