"""The largest clique of a graph: quickly, or exactly."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
import time
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scene_graph_ros.convex.errors import SolverError
from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.real_arrays import real_array
from scene_graph_ros.planning.cliques.adjacency import (
    checked_adjacency,
    CliqueError,
    is_clique,
    sparse,
)
from scene_graph_ros.planning.cliques.branch_and_bound import largest_clique

__all__ = [
    "MaxCliqueSolverBase",
    "MaxCliqueSolverViaBranchAndBound",
    "MaxCliqueSolverViaGreedy",
    "MaxCliqueSolverViaMip",
]


@one_line()
class MaxCliqueSolverBase(ABC):
    """Looks for vertices of a graph that are all adjacent to each other, as many as it can.

    A derived class chooses it, by ``_do_solve_max_clique``.
    """

    def solve_max_clique(self, adjacency_matrix: Any) -> NDArray[np.bool_]:
        """Return a mask ``(n,)`` of the vertices in the clique; the diagonal does not count.

        ``adjacency_matrix`` is a sparse or dense ``(n, n)``. Raises CliqueError where it is not
        symmetric, and where the answer of a solver of your own is no clique.
        """
        adjacent = checked_adjacency(adjacency_matrix)
        n = len(adjacent)
        if not n:
            return np.zeros(0, dtype=np.bool_)
        found = np.asarray(self._do_solve_max_clique(sparse(adjacent)))
        name = type(self).__name__
        if found.shape != (n,) or not (found == found.astype(np.bool_)).all():
            raise CliqueError(
                f"{name} must return which of {n} vertices are in the clique, not {quoted(found)}"
            )
        members = found.astype(np.bool_)
        if not is_clique(adjacent, np.flatnonzero(members)):
            raise CliqueError(
                f"{name} returned {np.flatnonzero(members).tolist()}, which is no clique"
            )
        return members

    @abstractmethod
    def _do_solve_max_clique(self, adjacency_matrix: Any) -> ArrayLike:
        """Answer about a symmetric csc_matrix ``(n, n)`` of bool, n at least 1, zero diagonal."""


class MaxCliqueSolverViaGreedy(MaxCliqueSolverBase):
    """Takes the vertex with most neighbours among the candidates, until none is left.

    Candidates are then its neighbours among them. Of equals it is the first.
    """

    def _do_solve_max_clique(self, adjacency_matrix: Any) -> NDArray[np.bool_]:
        return greedy_clique(adjacency_matrix.toarray())


class MaxCliqueSolverViaBranchAndBound(MaxCliqueSolverBase):
    """Finds a largest clique, by branch and bound on bitsets; the same each time.

    Some 200 vertices of a visibility graph take milliseconds. Ctrl-C ends it within 0.1 s.
    """

    def __init__(self, time_limit: float | None = None) -> None:
        """Give it a time limit in seconds, or none. Raises CliqueError unless it is positive."""
        self._time_limit = _time_limit(time_limit)

    def _do_solve_max_clique(self, adjacency_matrix: Any) -> NDArray[np.bool_]:
        adjacent = adjacency_matrix.toarray()
        deadline = None if self._time_limit is None else time.monotonic() + self._time_limit
        found, is_proven = largest_clique(adjacent, greedy_clique(adjacent), deadline)
        if not is_proven:
            raise SolverError(
                f"MaxCliqueSolverViaBranchAndBound: {self._time_limit} s did not show that a"
                f" clique of {int(found.sum())} is the largest of {len(found)} vertices; give it"
                " more time, or take MaxCliqueSolverViaGreedy"
            )
        return found


class MaxCliqueSolverViaMip(MaxCliqueSolverBase):
    """Finds a largest clique, as a mixed-integer program that HiGHS solves.

    Maximize ``sum x`` subject to ``x_i + x_j <= 1`` where i and j are not adjacent, x binary.
    `MaxCliqueSolverViaBranchAndBound` gives as large cliques, sooner.
    """

    def __init__(
        self,
        initial_guess: ArrayLike | None = None,
        solver_options: Mapping[str, Any] | None = None,
    ) -> None:
        """Take a guess ``(n,)``, of which a clique is at least as large as, and HiGHS' options.

        Entries above 0.5 in the guess count; unless that is a clique, it is no help. Options are
        those of ``scipy.optimize.milp``: ``time_limit`` (s), ``mip_rel_gap``, ``node_limit``,
        ``presolve``, ``disp``.
        """
        self.set_initial_guess(initial_guess)
        self.set_solver_options({} if solver_options is None else solver_options)

    def get_initial_guess(self) -> NDArray[np.float64] | None:
        """Return the guess ``(n,)``, or None."""
        return None if self._guess is None else self._guess.copy()

    def set_initial_guess(self, initial_guess: ArrayLike | None) -> None:
        """Set the guess ``(n,)``. Raises CliqueError unless it is a vector of finite numbers."""
        if initial_guess is None:
            self._guess: NDArray[np.float64] | None = None
            return
        guess = real_array(initial_guess, "initial_guess must be finite numbers (n,)", CliqueError)
        if guess.ndim != 1 or not np.isfinite(guess).all():
            raise CliqueError(
                f"initial_guess must be finite numbers (n,), not {quoted(initial_guess)}"
            )
        self._guess = guess

    def get_solver_options(self) -> dict[str, Any]:
        """Return HiGHS' options."""
        return dict(self._options)

    def set_solver_options(self, solver_options: Mapping[str, Any]) -> None:
        """Set HiGHS' options. Raises CliqueError for one that there is not."""
        known = ("disp", "mip_rel_gap", "node_limit", "presolve", "time_limit")
        if not isinstance(solver_options, Mapping):
            raise CliqueError(f"solver_options must be a mapping, not {quoted(solver_options)}")
        for name in solver_options:
            if name not in known:
                raise CliqueError(
                    f"solver_options has {quoted(name)}; there are {', '.join(known)}"
                )
        self._options = dict(solver_options)

    def _do_solve_max_clique(self, adjacency_matrix: Any) -> NDArray[np.bool_]:
        from scipy.optimize import LinearConstraint, milp
        from scipy.sparse import csr_array

        adjacent = adjacency_matrix.toarray()
        n = len(adjacent)
        i, j = np.nonzero(np.triu(~adjacent, 1))
        each = np.arange(len(i))
        ones = np.ones(2 * len(i))
        A = csr_array((ones, (np.tile(each, 2), np.append(i, j))), shape=(len(i), n))
        constraints = [LinearConstraint(A, -np.inf, 1.0)] if len(i) else []
        constraints += self._at_least(adjacent)
        found = milp(
            -np.ones(n),
            integrality=np.ones(n),
            bounds=(0.0, 1.0),
            constraints=constraints,
            options=self._options,
        )
        if found.status != 0:
            raise SolverError(f"MaxCliqueSolverViaMip: HiGHS ended early: {found.message}")
        result: NDArray[np.bool_] = found.x > 0.5
        return result

    def _at_least(self, adjacent: NDArray[np.bool_]) -> list[Any]:
        """Return the guess's lower bound of the size of the clique."""
        from scipy.optimize import LinearConstraint

        n = len(adjacent)
        if self._guess is None:
            return []
        if len(self._guess) != n:
            raise CliqueError(
                f"initial_guess has {len(self._guess)} entries, adjacency_matrix has {n} vertices"
            )
        members = np.flatnonzero(self._guess > 0.5)
        if not is_clique(adjacent, members):
            return []
        return [LinearConstraint(np.ones((1, n)), len(members), np.inf)]


def greedy_clique(adjacent: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return the clique ``(n,)`` of `MaxCliqueSolverViaGreedy`."""
    members = np.zeros(len(adjacent), dtype=np.bool_)
    candidates = np.arange(len(adjacent))
    inside = adjacent
    while len(candidates):
        chosen = int(np.argmax(inside.sum(axis=1)))
        members[candidates[chosen]] = True
        kept = inside[chosen]
        candidates, inside = candidates[kept], inside[np.ix_(kept, kept)]
    return members


def _time_limit(value: Any) -> float | None:
    if value is None:
        return None
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not value > 0.0:
        raise CliqueError(f"time_limit must be positive seconds, or None, not {quoted(value)}")
    return float(value)
