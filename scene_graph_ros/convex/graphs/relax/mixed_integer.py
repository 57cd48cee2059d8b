"""The exact problem as one mixed-integer program: the relaxation with flows of 0 and 1."""

from __future__ import annotations

import numpy as np

from scene_graph_ros.convex.errors import SolverError
from scene_graph_ros.convex.graphs.network.network import Network
from scene_graph_ros.convex.graphs.relax.relaxation import Problem, program_of
from scene_graph_ros.convex.solve.cones.cone_program import Cone
from scene_graph_ros.convex.solve.cones.solver_choice import SolverChoice

__all__ = ["solve_mixed_integer"]

_MOST_CUTS = 100
"""How often circles beside the path are cut off; forced edges may be on such."""

_WHAT = "GraphOfConvexSets.solve_shortest_path: the mixed-integer program"


def solve_mixed_integer(
    problem: Problem, by: SolverChoice
) -> tuple[tuple[int, ...] | None, float]:
    """Return the edges of the best path, and the solver's lower bound of all costs.

    Neither is proven. None where it says that there is no path. Raises SolverError where it fails.
    """
    program, flows = program_of(problem)
    for _ in range(_MOST_CUTS):
        x, bound = program.solve_mixed_integer(flows, _WHAT, by)
        if x is None:
            return None, np.inf
        taken = np.flatnonzero(x[flows] > 0.5).tolist()
        path = _path(problem.network, taken)
        if set(problem.forced) <= set(path):
            return path, bound * problem.unit
        circles = [e for e in taken if e not in path]
        ones = -np.ones((1, len(circles)))
        program.add_rows(
            Cone.NONNEGATIVE, [(flows[circles], ones)], np.array([len(circles) - 1.0])
        )
    raise SolverError(f"{_WHAT}: after {_MOST_CUTS} cuts forced edges are still on circles")


def _path(network: Network, taken: list[int]) -> tuple[int, ...]:
    """Return the edges from source to target of those that are taken."""
    leaving = {int(network.tails[e]): e for e in taken}
    path: list[int] = []
    at = network.source
    while at != network.target and len(path) <= len(taken):
        e = leaving.get(at)
        if e is None:
            raise SolverError(f"{_WHAT}: the flows of its solution are no path")
        path.append(e)
        at = int(network.heads[e])
    return tuple(path)
