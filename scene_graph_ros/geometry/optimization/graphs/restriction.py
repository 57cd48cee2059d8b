"""The convex program that is left when a path is chosen: its points."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from scene_graph_ros.geometry.optimization.errors import SolverError
from scene_graph_ros.geometry.optimization.graphs.bounds import bound_of_points
from scene_graph_ros.geometry.optimization.graphs.functions import FunctionCost
from scene_graph_ros.geometry.optimization.graphs.nonconvex import functions_at, with_functions
from scene_graph_ros.geometry.optimization.graphs.placed_set import PlacedSet
from scene_graph_ros.geometry.optimization.graphs.relaxation import Problem
from scene_graph_ros.geometry.optimization.solve.cone_program import ConeProgram
from scene_graph_ros.geometry.tolerances import EPSILON

__all__ = ["Restricted", "bound_of_prefix", "restrict"]

_VIOLATION = 1e-7
"""Relative to the size of a row's terms, or of a set: the most that a path may break."""


@dataclass(frozen=True, eq=False)
class Restricted:
    """The best points of a path, ``(n,)`` for each vertex; none where constraints can't be kept.

    ``lower_bound`` is proven; ``violation`` is what sets and constraints are broken by, relative
    to the sizes of their terms.
    """

    cost: float
    lower_bound: float
    points: tuple[np.ndarray, ...]
    violation: float


def _solve(
    problem: Problem, path: Sequence[int], end: tuple[float, np.ndarray] | None, what: str
) -> tuple[list[np.ndarray], float, bool]:
    """Return points less their centres, the proven bound, and whether there are any."""
    network = problem.network
    program, unit = ConeProgram(), problem.unit
    vertices = [network.source, *(int(network.heads[e]) for e in path)]
    sets = [problem.sets[v] for v in vertices]
    ys = [program.variables(placed.S.shape[1]) for placed in sets]
    for placed, y in zip(sets, ys, strict=True):
        placed.add_membership(program, y, None)
    lowered = [
        problem.terms[e].lower(program, ys[k], ys[k + 1], None, unit) for k, e in enumerate(path)
    ]
    if end is not None:
        program.add_cost(ys[-1], sets[-1].S.T @ end[1] / unit)
    solution = program.solve(what, by=problem.solver)
    multipliers = [
        problem.terms[e].multipliers(solution, rows, unit)
        for e, rows in zip(path, lowered, strict=True)
    ]
    if not solution.is_feasible:
        return [], bound_of_points(problem, path, multipliers, None, with_cost=False), False
    bound = bound_of_points(problem, path, multipliers, end)
    points = [placed.S @ solution.x[y] for placed, y in zip(sets, ys, strict=True)]
    return points, bound, True


def bound_of_prefix(problem: Problem, path: Sequence[int], end: tuple[float, np.ndarray]) -> float:
    """Return a proven bound of the first edges' cost and the potential at the last vertex.

    Infinite where the constraints can't be kept, -infinite where nothing was found.
    """
    try:
        _, bound, is_feasible = _solve(problem, path, end, "GraphOfConvexSets: a path's start")
    except SolverError:
        return -np.inf
    if is_feasible:
        return bound
    return np.inf if bound > 0.0 else -np.inf


def _kept_functions(
    problem: Problem,
    path: Sequence[int],
    found: list[np.ndarray],
    bound: float,
    guess: Sequence[np.ndarray] | None,
) -> tuple[list[np.ndarray], float]:
    """Return points less their centres that keep functions, too, and the bound that holds."""
    functions = [problem.functions.get(e, ()) for e in path]
    if not any(functions):
        return found, bound
    start: Sequence[np.ndarray] = found
    if guess is not None:
        vertices = [problem.network.source, *(int(problem.network.heads[e]) for e in path)]
        start = [x - problem.sets[v].center for x, v in zip(guess, vertices, strict=True)]
    moved = with_functions(problem, path, start)
    has_costs = any(isinstance(each.term, FunctionCost) for some in functions for each in some)
    return moved, -np.inf if has_costs else bound


def _nearest(placed: PlacedSet, x: np.ndarray) -> tuple[np.ndarray | None, float]:
    """Return the nearest point of a set, None where it is not found, and how far x is outside."""
    try:
        nearest = placed.of.projection(x[None])
    except SolverError:
        # Of sets that are put together: by how much each of them is missed.
        return None, float(placed.of._outside(x[None])[0])
    assert nearest is not None, "sets of a graph are not empty"
    return nearest.points[0], float(nearest.distances[0])


def restrict(
    problem: Problem, path: Sequence[int], guess: Sequence[np.ndarray] | None = None
) -> Restricted:
    """Return the best points of a path; where it has functions, the best near a guess, if any.

    Each is put into its set where no constraint ties it to others. Raises SolverError where
    points break a set or a constraint, or where it was not proven that there are none.
    """
    what = "GraphOfConvexSets.solve_convex_restriction"
    network = problem.network
    vertices = [network.source, *(int(network.heads[e]) for e in path)]
    found, bound, is_feasible = _solve(problem, path, None, what)
    if not is_feasible:
        if bound > 0.0:
            return Restricted(np.inf, np.inf, (), 0.0)
        raise SolverError(
            f"{what}: the solver found no points of a path of {len(path)} edges, but its proof"
            f" does not hold ({bound:.3g} must be above 0)"
        )
    terms = [problem.terms[e] for e in path]
    is_tied = any(each.is_constrained for each in terms)
    found, bound = _kept_functions(problem, path, found, bound, guess)
    is_tied = is_tied or any(e in problem.functions for e in path)
    points, worst = [], 0.0
    for v, way in zip(vertices, found, strict=True):
        placed = problem.sets[v]
        x = placed.center + way
        nearest, outside = _nearest(placed, x)
        rounding = 8.0 * EPSILON * float(np.abs(placed.center).max(initial=0.0))
        if not is_tied and nearest is not None:
            x = nearest
        elif outside > rounding:
            worst = max(worst, outside / float(placed.half.max()))
        points.append(x)
    ways = [x - problem.sets[v].center for x, v in zip(points, vertices, strict=True)]
    cost = 0.0
    for k, each in enumerate(terms):
        cost += each.cost(ways[k], ways[k + 1])
        worst = max(worst, each.violation(ways[k], ways[k + 1]))
        value, broken = functions_at(problem.functions.get(path[k], ()), points[k], points[k + 1])
        cost, worst = cost + value, max(worst, broken)
    if worst > _VIOLATION:
        raise SolverError(
            f"{what}: the points of a path of {len(path)} edges break a set or a constraint by"
            f" {worst:.1e} of its size, accepted is {_VIOLATION:g}"
        )
    return Restricted(cost, bound, tuple(points), worst)
