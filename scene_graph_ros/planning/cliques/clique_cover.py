"""Few cliques that have all vertices of a graph in them."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable
import numbers
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.planning.cliques.adjacency import (
    checked_adjacency,
    CliqueError,
    is_clique,
    sparse,
)
from scene_graph_ros.planning.cliques.max_clique import MaxCliqueSolverBase

__all__ = ["MinCliqueCoverSolverBase", "MinCliqueCoverSolverViaGreedy"]


@one_line()
class MinCliqueCoverSolverBase(ABC):
    """Looks for cliques that cover a graph, as few as it can.

    A derived class chooses them, by ``_do_solve_min_clique_cover``.
    """

    def solve_min_clique_cover(
        self, adjacency_matrix: Any, partition: bool = False
    ) -> list[set[int]]:
        """Return the vertices of each clique; with ``partition`` no vertex is in two.

        ``adjacency_matrix`` is a sparse or dense ``(n, n)``. Raises CliqueError where it is not
        symmetric, and where a solver of your own returns sets that are no cliques, or share
        vertices.
        """
        adjacent = checked_adjacency(adjacency_matrix)
        if not len(adjacent):
            return []
        found = self._do_solve_min_clique_cover(sparse(adjacent), bool(partition))
        cliques = [{int(vertex) for vertex in clique} for clique in found]
        name, covered = type(self).__name__, set[int]()
        for clique in cliques:
            if not clique <= set(range(len(adjacent))) or not is_clique(adjacent, clique):
                raise CliqueError(f"{name} returned {sorted(clique)}, which is no clique")
            if partition and covered & clique:
                raise CliqueError(f"{name} returned {min(covered & clique)} in two cliques")
            covered |= clique
        return cliques

    @abstractmethod
    def _do_solve_min_clique_cover(
        self, adjacency_matrix: Any, partition: bool
    ) -> Iterable[Iterable[int]]:
        """Answer about a symmetric csc_matrix ``(n, n)`` of bool, n at least 1, zero diagonal."""


class MinCliqueCoverSolverViaGreedy(MinCliqueCoverSolverBase):
    """Takes the largest clique of the vertices not covered, until it is below a size.

    Each clique takes at least that many vertices out, so n vertices have at most
    ``n / min_clique_size`` cliques. Where that size is above 1, some vertices may stay uncovered.
    """

    def __init__(self, max_clique_solver: MaxCliqueSolverBase, min_clique_size: int = 1) -> None:
        """Take the solver of cliques. Raises CliqueError unless the size is at least 1."""
        if not isinstance(max_clique_solver, MaxCliqueSolverBase):
            raise CliqueError(
                f"max_clique_solver must be a MaxCliqueSolverBase, not {quoted(max_clique_solver)}"
            )
        self._solver = max_clique_solver
        self.set_min_clique_size(min_clique_size)

    def get_min_clique_size(self) -> int:
        """Return the size that ends it."""
        return self._least

    def set_min_clique_size(self, min_clique_size: int) -> None:
        """Set it. Raises CliqueError unless it is at least 1."""
        size: Any = min_clique_size
        if isinstance(size, bool) or not isinstance(size, numbers.Integral) or size < 1:
            raise CliqueError(f"min_clique_size must be an integer >= 1, not {quoted(size)}")
        self._least = int(size)

    def _do_solve_min_clique_cover(
        self, adjacency_matrix: Any, partition: bool
    ) -> list[list[int]]:
        adjacent = adjacency_matrix.toarray()
        left, cliques = np.arange(len(adjacent)), []
        while len(left) >= self._least:
            inside = adjacent[np.ix_(left, left)]
            members = self._solver.solve_max_clique(sparse(inside))
            if members.sum() < self._least:
                break
            clique = left[members]
            cliques.append(clique.tolist() if partition else _extended(adjacent, clique))
            left = left[~members]
        return cliques


def _extended(adjacent: NDArray[np.bool_], clique: NDArray[np.intp]) -> list[int]:
    """Return a clique with vertices that others have, too, until none is adjacent to all."""
    members = clique.tolist()
    candidates = adjacent[clique].all(axis=0)
    while candidates.any():
        rows = np.flatnonzero(candidates)
        best = rows[np.argmax(adjacent[np.ix_(rows, rows)].sum(axis=1))]
        members.append(int(best))
        candidates &= adjacent[best]
    return members
