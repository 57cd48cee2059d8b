"""The convex program that is left when a path is chosen: its points."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from scene_graph_ros.convex.errors import SolverError
from scene_graph_ros.convex.graphs.expressions.functions import FunctionCost
from scene_graph_ros.convex.graphs.model.memberships import add_memberships
from scene_graph_ros.convex.graphs.model.placed_set import nearest_of
from scene_graph_ros.convex.graphs.relax.bounds import bound_of_points
from scene_graph_ros.convex.graphs.relax.edge_table import Columns, EdgeTable
from scene_graph_ros.convex.graphs.relax.relaxation import Problem
from scene_graph_ros.convex.graphs.restrict.chain import Chain
from scene_graph_ros.convex.graphs.restrict.nonconvex import functions_at, with_functions
from scene_graph_ros.convex.solve.cones.cone_program import ConeProgram
from scene_graph_ros.geometry.tolerances import EPSILON

__all__ = ["Restricted", "best_of_chain", "bound_of_prefix", "restrict"]

_VIOLATION = 1e-7
"""Relative to the size of a row's terms, or of a set: the most that a path may break."""


_GAP = 1e-8
"""Relative: what is between a path's cost and its bound, where it is not solved again."""


@dataclass(frozen=True, eq=False)
class Restricted:
    """The best points of a path, ``(n,)`` for each vertex; none where constraints can't be kept.

    ``lower_bound`` is proven; ``violation`` is the largest violation of sets and constraints,
    relative to the sizes of their terms.
    """

    cost: float
    lower_bound: float
    points: tuple[np.ndarray, ...]
    violation: float


class _Path:
    """A path's edges and the sets that it visits."""

    def __init__(self, problem: Problem, path: Sequence[int]) -> None:
        network = problem.network
        self.problem, self.path = problem, path
        vertices = [network.source, *network.heads[list(path)].tolist()]
        self.sets = [problem.sets[v] for v in vertices]
        self.edges = EdgeTable([problem.terms[e] for e in path])

    @property
    def is_constrained(self) -> bool:
        """Whether edges have constraints."""
        return any(each.layout.is_constrained for each in self.edges)


def _solve(
    of: _Path, end: tuple[float, np.ndarray] | None, what: str
) -> tuple[list[np.ndarray], float, bool]:
    """Return points less their centres, the proven bound, and whether there are any."""
    program, unit, sets, taken = ConeProgram(), of.problem.unit, of.sets, of.edges
    counts = np.array([placed.S.shape[1] for placed in sets])
    columns = program.variables(int(counts.sum()))
    firsts = np.cumsum(counts) - counts
    add_memberships(program, [placed.membership for placed in sets], firsts, None)
    lowered = taken.lower(program, Columns(firsts[:-1], firsts[1:], None), unit)
    ys = np.split(columns, firsts[1:])
    if end is not None:
        program.add_cost(ys[-1], sets[-1].S.T @ end[1] / unit)
    solution = program.solve(what, by=of.problem.solver, is_over=of.problem.is_over)
    weights = taken.weights(solution, lowered)
    if not solution.is_feasible:
        return [], bound_of_points(taken, sets, weights, None, with_cost=False), False
    bound = bound_of_points(taken, sets, weights, end)
    points = [placed.S @ solution.x[y] for placed, y in zip(sets, ys, strict=True)]
    return points, bound, True


def _chain(problem: Problem, path: Sequence[int]) -> Chain:
    network = problem.network
    vertices = [network.source, *network.heads[list(path)].tolist()]
    return Chain([problem.terms[e] for e in path], [problem.sets[v] for v in vertices])


def bound_of_prefix(problem: Problem, path: Sequence[int], end: tuple[float, np.ndarray]) -> float:
    """Return a proven bound of the first edges' cost and the potential at the last vertex.

    Infinite where the constraints can't be kept, -infinite where nothing was found.
    """
    if problem.solver is None:
        chained = _chain(problem, path).solve(problem.unit, end)
        if chained is not None:
            return chained.bound
    try:
        _, bound, is_feasible = _solve(
            _Path(problem, path), end, "GraphOfConvexSets: a path's start"
        )
    except SolverError:
        return -np.inf
    if is_feasible:
        return bound
    return np.inf if bound > 0.0 else -np.inf


def best_of_chain(chain: Chain, unit: float = 0.0) -> Restricted | None:
    """Return the best points of a path, as `restrict` does; None where they are not found.

    Costs are measured in ``unit``, in the edges' largest cost where it is 0; and in the cost
    found, if that leaves a gap.
    """
    best = _once(chain, unit)
    if best is not None and 0.0 < _GAP * best.cost < best.cost - best.lower_bound:
        again = _once(chain, best.cost)
        if again is not None and again.cost - again.lower_bound < best.cost - best.lower_bound:
            return again
    return best


def _once(chain: Chain, unit: float) -> Restricted | None:
    chained = chain.solve(unit)
    if chained is None:
        return None
    points, cost, worst = chain.place(chained.ways)
    return Restricted(cost, chained.bound, points, worst) if worst <= _VIOLATION else None


def _kept_functions(
    of: _Path,
    found: list[np.ndarray],
    bound: float,
    guess: Sequence[np.ndarray] | None,
    limit: float,
) -> tuple[list[np.ndarray], float]:
    """Return points less their centres that keep functions, too, and the bound that holds."""
    functions = [of.problem.functions.get(e, ()) for e in of.path]
    if not any(functions):
        return found, bound
    start: Sequence[np.ndarray] = found
    if guess is not None:
        start = [x - placed.center for x, placed in zip(guess, of.sets, strict=True)]
    moved = with_functions(of.problem, of.path, start, limit)
    return moved, -np.inf if _has_costs(of) else bound


def _has_costs(of: _Path) -> bool:
    """Tell whether a path has costs that are functions."""
    functions = (each for e in of.path for each in of.problem.functions.get(e, ()))
    return any(isinstance(each.term, FunctionCost) for each in functions)


def restrict(
    problem: Problem,
    path: Sequence[int],
    guess: Sequence[np.ndarray] | None = None,
    *,
    limit: float = np.inf,
) -> Restricted:
    """Return the best points of a path; where it has functions, the best near a guess, if any.

    A path with constraints that are functions has none where those of the convex part cost
    ``limit`` at least.

    Each is put into its set where no constraint ties it to others. Raises SolverError where
    points break a set or a constraint, or where it was not proven that there are none.
    """
    what = "GraphOfConvexSets.solve_convex_restriction"
    if problem.solver is None and not any(e in problem.functions for e in path):
        best = best_of_chain(_chain(problem, path), problem.unit)
        if best is not None:
            return best
    of = _Path(problem, path)
    found, bound, is_feasible = _solve(of, None, what)
    if not is_feasible:
        if bound > 0.0:
            return Restricted(np.inf, np.inf, (), 0.0)
        raise SolverError(
            f"{what}: the solver found no points of a path of {len(path)} edges, but its proof"
            f" does not hold ({bound:.3g} must be above 0)"
        )
    if bound >= limit and not _has_costs(of):
        return Restricted(np.inf, bound, (), 0.0)
    found, bound = _kept_functions(of, found, bound, guess, limit)
    is_tied = of.is_constrained or any(e in problem.functions for e in path)
    sets = of.sets
    points, worst = [placed.center + way for placed, way in zip(sets, found, strict=True)], 0.0
    for k, (nearest, outside) in enumerate(nearest_of(sets, points)):
        rounding = 8.0 * EPSILON * float(np.abs(sets[k].center).max(initial=0.0))
        if not is_tied and nearest is not None:
            points[k] = nearest
        elif outside > rounding:
            worst = max(worst, outside / float(sets[k].half.max()))
    ways = [x - placed.center for x, placed in zip(points, sets, strict=True)]
    cost = sum(each.cost(ways[k], ways[k + 1]) for k, each in enumerate(of.edges))
    for k, each in enumerate(of.edges if is_tied else ()):
        worst = max(worst, each.violation(ways[k], ways[k + 1]))
        value, broken = functions_at(problem.functions.get(path[k], ()), points[k], points[k + 1])
        cost, worst = cost + value, max(worst, broken)
    if worst > _VIOLATION:
        raise SolverError(
            f"{what}: the points of a path of {len(path)} edges break a set or a constraint by"
            f" {worst:.1e} of its size, accepted is {_VIOLATION:g}"
        )
    return Restricted(cost, bound, tuple(points), worst)
