"""The best points of a path by a method for paths: compiled, in time with its length."""

from __future__ import annotations

from collections.abc import Sequence
import itertools
from typing import NamedTuple

import numpy as np

from scene_graph_ros.convex.graphs.expressions.packed_terms import join
from scene_graph_ros.convex.graphs.model.edge_terms import EdgeTerms
from scene_graph_ros.convex.graphs.model.placed_set import nearest_of, PlacedSet
from scene_graph_ros.convex.graphs.restrict.chain_kernels import (
    cost_of_path,
    place_points,
    solve_path,
)
from scene_graph_ros.convex.graphs.restrict.chain_layout import Path
from scene_graph_ros.convex.solve.banded.banded_cones import IMPROVE
from scene_graph_ros.geometry.tolerances import EPSILON

__all__ = ["Chain", "Chained", "Placed"]

_LIMITS = (1e-10, 40)
"""What the method is asked for, relative and absolute, in units of the cost; and the most places
that rows of one edge may take: a band of more costs more than it saves."""

_ACCEPTED = 1e-9
"""The largest residual of a solution that is taken."""

_NOWHERE = np.zeros(0)


class Chained(NamedTuple):
    """Points less their centres, ``(n,)`` of all sets in turn, and the proven bound."""

    ways: np.ndarray
    bound: float


class Placed(NamedTuple):
    """Points of the sets, their cost, and their largest violation of a set or constraint.

    Relative to the sizes of their terms.
    """

    points: tuple[np.ndarray, ...]
    cost: float
    violation: float


class Chain:
    """Edges, one behind the other, and the sets that they lead through."""

    def __init__(self, edges: Sequence[EdgeTerms], sets: Sequence[PlacedSet]) -> None:
        self._sets, self._count = sets, len(edges)
        self.is_known = all(each.is_quadratic for each in edges) and not any(
            placed.matrices for placed in sets
        )
        """Whether kernels know all kinds of cones here."""
        self._is_constrained = any(each.layout.is_constrained for each in edges)
        if self.is_known:
            self._path = Path(
                *(a for some in (edges, sets) for a in join([e.packed for e in some]))
            )

    def solve(
        self, unit: float = 0.0, end: tuple[float, np.ndarray] | None = None
    ) -> Chained | None:
        """Return the best points and their bound; None where the method did not find them.

        Costs are measured in ``unit``, in the edges' largest cost where it is 0. ``end`` is a
        potential at the last point, level and slope ``(n,)``, which is added.
        """
        if not self.is_known:
            return None
        level, slope = (0.0, _NOWHERE) if end is None else end
        ways, D, totals, residual = solve_path(
            self._path, self._count, unit, slope, _LIMITS, IMPROVE.address()
        )
        if not residual <= _ACCEPTED:
            return None
        total, lost, size = totals.tolist()
        for placed, d in zip(self._sets, self._split(D), strict=True):
            if not placed.tells_reach:
                reach, rounding = placed.reach(-d[None])
                total, lost = total - float(reach[0]), lost + float(rounding[0])
                size += abs(float(reach[0]))
        total, size = total + level, size + abs(level)
        return Chained(ways, total - lost - 2.0 * (2 * self._count + 8) * EPSILON * size)

    def place(self, ways: np.ndarray) -> Placed:
        """Return the points, each in its set where no constraint ties it to others."""
        is_tied = self._is_constrained
        together, worst = place_points(self._path, self._count, ways, is_tied)
        points = self._split(together)
        others = [k for k, placed in enumerate(self._sets) if not placed.has_corners]
        found = nearest_of([self._sets[k] for k in others], [points[k] for k in others])
        for k, (nearest, outside) in zip(others, found, strict=True):
            center, half = self._sets[k].center, self._sets[k].half
            if not is_tied and nearest is not None:
                points[k] = nearest
            elif outside > 8.0 * EPSILON * float(np.abs(center).max(initial=0.0)):
                worst = max(worst, outside / float(half.max()))
        if others and not is_tied:
            ways = np.concatenate(
                [x - placed.center for x, placed in zip(points, self._sets, strict=True)]
            )
        cost, broken = cost_of_path(self._path, self._count, ways)
        return Placed(tuple(points), float(cost), max(float(worst), float(broken)))

    def _split(self, together: np.ndarray) -> list[np.ndarray]:
        ends = itertools.accumulate((len(placed.center) for placed in self._sets), initial=0)
        return [together[a:b] for a, b in itertools.pairwise(ends)]
