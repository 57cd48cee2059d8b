"""The convex relaxation of a shortest path problem: flows along edges, points in perspective.

Marcucci, Umenberger, Parrilo and Tedrake, "Shortest Paths in Graphs of Convex Sets", SIAM Journal
on Optimization 34(1), 2024, section 5: each edge has a flow and, for both of its sets, a point of
the set times the flow; flows and points are conserved at each vertex. Where one edge leads to a
vertex and one from it, they share their flow and their points there.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
import functools
from typing import Any, NamedTuple

import numpy as np

from scene_graph_ros.convex.graphs.expressions.functions import FunctionTerm
from scene_graph_ros.convex.graphs.expressions.packed_terms import join, Packed
from scene_graph_ros.convex.graphs.model.memberships import add_memberships
from scene_graph_ros.convex.graphs.model.placed_set import PlacedSet
from scene_graph_ros.convex.graphs.model.set_kernels import moments_of_edges
from scene_graph_ros.convex.graphs.network.network import Network, TwoCycle
from scene_graph_ros.convex.graphs.relax.edge_table import Columns, EdgeTable
from scene_graph_ros.convex.graphs.relax.later import Once
from scene_graph_ros.convex.solve.cones.cone_program import (
    Cone,
    ConeProgram,
    ConeSolution,
    Rows,
)
from scene_graph_ros.convex.solve.cones.solver_choice import SolverChoice

__all__ = ["CyclePrice", "PlacedFunction", "Problem", "Relaxed", "program_of", "relax"]


@dataclass(frozen=True, eq=False)
class Problem:
    """A shortest path problem: a network, its sets, and the terms of its edges.

    ``forced`` are edges that every path has to take. ``unit`` is the unit of costs.
    ``functions`` are costs and constraints of edges that need not be convex; of them the
    restriction alone knows. Programs are solved by ``solver``, by Clarabel if it is None, until
    ``is_over`` says that it is time to stop.
    """

    network: Network
    sets: list[PlacedSet]
    terms: EdgeTable
    forced: tuple[int, ...]
    unit: float
    functions: Mapping[int, tuple[PlacedFunction, ...]] = field(default_factory=dict)
    solver: SolverChoice | None = None
    is_over: Callable[[], bool] | None = None

    @functools.cached_property
    def packed_sets(self) -> Packed:
        """All sets for kernels."""
        return join([placed.packed for placed in self.sets])


class PlacedFunction(NamedTuple):
    """A function of the points of an edge's vertices: which of ``(xu, xv)`` it takes."""

    term: FunctionTerm
    takes_u: bool
    takes_v: bool

    def at(self, xu: np.ndarray, xv: np.ndarray) -> Any:
        """Return the value of the term at points ``(n,)``."""
        numbers = [k for k, takes in enumerate((self.takes_u, self.takes_v)) if takes]
        return self.term.at({0: xu, 1: xv}, numbers)


@dataclass(frozen=True, eq=False)
class CyclePrice:
    """The relaxation's price of a cycle of two edges: ``level + slope . x``.

    About the centre of its vertex's set, in which it is at least 0 to rounding of the solver.
    """

    of: TwoCycle
    level: float
    slope: np.ndarray


@dataclass(frozen=True, eq=False)
class Relaxed:
    """The relaxation's solution; none of it is proven.

    ``flows (m,)``; ``points`` are the flow times the point, of each edge, less the centre, of all
    tails and of all heads; ``levels (n,)`` and ``slopes`` ``(k,)`` of each vertex are its
    potential, an affine function about its centre, with levels of 0 where edges share all they
    have; ``visits (n,)`` the price of visiting a vertex at most once, and ``prizes`` of the forced
    edges; ``cost`` is infinite where no path is possible.
    """

    cost: float
    flows: np.ndarray
    points: Once[tuple[list[np.ndarray], list[np.ndarray]]]
    levels: np.ndarray
    slopes: list[np.ndarray]
    visits: np.ndarray
    prizes: np.ndarray
    weights: np.ndarray
    """Of all edges' rows, edge after edge."""
    residual: float
    cycles: list[CyclePrice]


def relax(problem: Problem, cycles: Sequence[TwoCycle] = (), tolerance: float = 1e-10) -> Relaxed:
    """Solve the relaxation, in which no path takes two edges of one of the cycles.

    To a tolerance, relative to the cost. Raises SolverError where the solver fails.
    """
    return _Relaxation(problem, cycles).solve(tolerance)


def program_of(problem: Problem) -> tuple[ConeProgram, np.ndarray]:
    """Return the relaxation's program, in units of cost, and the columns ``(m,)`` of its flows."""
    made = _Relaxation(problem, ())
    return made._program, made._flows


class _Relaxation:
    """The program, and the meaning of its rows."""

    def __init__(self, problem: Problem, cycles: Sequence[TwoCycle]) -> None:
        self._problem, self._cycles = problem, cycles
        network, sets = problem.network, problem.sets
        self._program = program = ConeProgram()
        self._before = before = network.ways_on
        self._extents = np.array([placed.extent for placed in sets])
        counts = np.array([placed.S.shape[1] for placed in sets], dtype=np.int64)
        self._counts = counts
        is_own = np.ones(len(network.tails), dtype=bool)
        is_own[list(before)] = False
        own = np.flatnonzero(is_own)
        flows = program.variables(len(own))
        program.add_entries(
            Cone.NONNEGATIVE,
            [(np.arange(len(own)), flows, np.ones(len(own)))],
            np.zeros(len(own)),
        )
        self._flows = np.zeros(len(network.tails), dtype=np.int64)
        self._flows[own] = flows
        for e, came_by in before.items():
            self._flows[e] = self._flows[came_by]
        self._passed = network.tails[list(before)]
        """Vertices whose edges share what they have."""
        needed = np.concatenate([counts[network.tails[own]], counts[network.heads]])
        columns = program.variables(int(needed.sum()))
        firsts = int(columns[0] if len(columns) else 0) + np.cumsum(needed) - needed
        heads = firsts[len(own) :]
        tails = np.zeros(len(network.tails), dtype=np.int64)
        tails[own] = firsts[: len(own)]
        tails[list(before)] = heads[list(before.values())]
        self._tails, self._heads = tails, heads
        vertices = [*network.tails[own].tolist(), *network.heads.tolist()]
        scales = np.concatenate([self._flows[own], self._flows])
        asked = [sets[v].membership for v in vertices]
        add_memberships(program, asked, firsts, scales)
        self._lowered = problem.terms.lower(
            program, Columns(tails, heads, self._flows), problem.unit
        )
        self._conserve()
        self._limit_visits()
        self._part_cycles()
        self._force()

    def _conserve(self) -> None:
        network, sets = self._problem.network, self._problem.sets
        is_passed = np.zeros(network.size, dtype=bool)
        is_passed[self._passed] = True
        rows = np.full(network.size, -1)
        kept = np.flatnonzero(~is_passed)
        rows[kept] = np.arange(len(kept))
        self._kept = kept
        excess = np.zeros(network.size)
        excess[network.source] += 1.0
        excess[network.target] -= 1.0
        into, out = (np.flatnonzero(rows[ends] >= 0) for ends in (network.heads, network.tails))
        entries = [
            (rows[network.heads[into]], self._flows[into], np.ones(len(into))),
            (rows[network.tails[out]], self._flows[out], -np.ones(len(out))),
        ]
        self._balance = self._program.add_entries(Cone.ZERO, entries, excess[kept])
        # Points: as many rows as the set has coordinates.
        is_passed[[network.source, network.target]] = True
        is_passed |= self._counts == 0
        lengths = np.where(is_passed, 0, [len(placed.S) for placed in sets])
        first = np.cumsum(lengths) - lengths
        ends = np.column_stack([network.tails, network.heads])
        columns = np.column_stack([self._tails, self._heads])
        entries = [moments_of_edges(*self._problem.packed_sets, ends, columns, first, lengths)]
        total = int(lengths.sum())
        self._moments = self._program.add_entries(Cone.ZERO, entries, np.zeros(total))
        self._moment_rows = first, lengths

    def _limit_visits(self) -> None:
        """Ask that no vertex on a circle is visited more than once."""
        network = self._problem.network
        of = network.strong_components()
        is_limited = np.bincount(of)[of] > 1
        is_limited[self._passed] = False
        is_limited &= np.array([bool(out) for out in network.leaving])
        self._limited = np.flatnonzero(is_limited)
        rows = np.cumsum(is_limited) - 1
        out = np.flatnonzero(is_limited[network.tails])
        entries = [(rows[network.tails[out]], self._flows[out], -np.ones(len(out)))]
        ones = np.ones(len(self._limited))
        self._visits = self._program.add_entries(Cone.NONNEGATIVE, entries, ones)

    def _part_cycles(self) -> None:
        """Ask that flow by an edge leaves by another than the one back.

        Of a cycle of two edges, the flow out on other edges less that of this one is a flow
        with its point, of the vertex's set (Marcucci et al., section 5.3).
        """
        network, program = self._problem.network, self._program
        self._parted: list[tuple[Rows, Rows]] = []
        for cycle in self._cycles:
            placed = self._problem.sets[cycle.vertex]
            others = [e for e in network.leaving[cycle.vertex] if e not in cycle.back]
            y, flow = program.variables(placed.S.shape[1]), program.variables(1)
            into = list(cycle.into)
            program.add_rows(Cone.NONNEGATIVE, [(flow, np.ones((1, 1)))], np.zeros(1))
            placed.add_membership(program, y, flow)
            blocks = [(flow, np.ones((1, 1)))]
            blocks.append((self._flows[others], -np.ones((1, len(others)))))
            blocks.append((self._flows[into], np.ones((1, len(into)))))
            balance = program.add_rows(Cone.ZERO, blocks, np.zeros(1))
            scaled = placed.S / placed.extent
            blocks = [(y, scaled)]
            here = np.arange(len(y))
            blocks += [(self._tails[e] + here, -scaled) for e in others]
            blocks += [(self._heads[e] + here, scaled) for e in into]
            moment = program.add_rows(Cone.ZERO, blocks, np.zeros(len(scaled)))
            self._parted.append((balance, moment))

    def _force(self) -> None:
        forced = list(self._problem.forced)
        entries = [(np.arange(len(forced)), self._flows[forced], np.ones(len(forced)))]
        self._forced = self._program.add_entries(Cone.ZERO, entries, -np.ones(len(forced)))

    def solve(self, tolerance: float) -> Relaxed:
        """Solve, and read flows, points and multipliers."""
        problem, unit, network = self._problem, self._problem.unit, self._problem.network
        solution = self._program.solve(
            "GraphOfConvexSets.solve_shortest_path: the relaxation",
            is_rough=True,
            by=problem.solver,
            tolerance=tolerance,
            is_over=problem.is_over,
        )
        levels, visits = np.zeros(network.size), np.zeros(network.size)
        levels[self._kept] = -unit * solution.dual(self._balance)
        visits[self._limited] = unit * solution.dual(self._visits)
        moments, (first, lengths) = solution.dual(self._moments), self._moment_rows
        slopes = [
            -unit * moments[a : a + k] / extent if k else np.zeros(len(placed.S))
            for a, k, extent, placed in zip(
                first.tolist(), lengths.tolist(), self._extents, problem.sets, strict=True
            )
        ]
        is_feasible = solution.is_feasible
        x = solution.x if is_feasible else np.zeros(self._program.num_variables)
        return Relaxed(
            self._program.cost_of(x) * unit if is_feasible else np.inf,
            x[self._flows],
            Once(
                lambda: (
                    self._points(x, network.tails, self._tails),
                    self._points(x, network.heads, self._heads),
                )
            ),
            levels,
            slopes,
            visits,
            -unit * solution.dual(self._forced),
            problem.terms.weights(solution, self._lowered),
            solution.residual,
            self._prices(solution),
        )

    def _points(self, x: np.ndarray, vertices: np.ndarray, firsts: np.ndarray) -> list[np.ndarray]:
        sets = self._problem.sets
        return [
            sets[v].S @ x[a : a + k]
            for v, a, k in zip(
                vertices.tolist(), firsts.tolist(), self._counts[vertices].tolist(), strict=True
            )
        ]

    def _prices(self, solution: ConeSolution) -> list[CyclePrice]:
        unit, sets = self._problem.unit, self._problem.sets
        return [
            CyclePrice(
                cycle,
                -unit * float(solution.dual(balance)[0]),
                -unit * solution.dual(moment) / sets[cycle.vertex].extent,
            )
            for cycle, (balance, moment) in zip(self._cycles, self._parted, strict=True)
        ]
