"""The convex relaxation of a shortest path problem: flows along edges, points in perspective.

Marcucci, Umenberger, Parrilo and Tedrake, "Shortest Paths in Graphs of Convex Sets", SIAM Journal
on Optimization 34(1), 2024, section 5: each edge has a flow and, for both of its sets, a point of
the set times the flow; flows and points are conserved at each vertex.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from scene_graph_ros.geometry.optimization.graphs.edge_terms import EdgeTerms, Multipliers
from scene_graph_ros.geometry.optimization.graphs.functions import FunctionTerm
from scene_graph_ros.geometry.optimization.graphs.network import Network, TwoCycle
from scene_graph_ros.geometry.optimization.graphs.placed_set import PlacedSet
from scene_graph_ros.geometry.optimization.solve.cone_program import (
    Cone,
    ConeProgram,
    ConeSolution,
    Rows,
)
from scene_graph_ros.geometry.optimization.solve.solver_choice import SolverChoice

__all__ = ["CyclePrice", "PlacedFunction", "Problem", "Relaxed", "program_of", "relax"]


@dataclass(frozen=True, eq=False)
class Problem:
    """A shortest path problem: a network, its sets, and the terms of its edges.

    ``forced`` are edges that every path has to take. ``unit`` is what costs are measured in.
    ``functions`` are costs and constraints of edges that need not be convex; of them the
    restriction alone knows. Programs are solved by ``solver``, by Clarabel if it is None.
    """

    network: Network
    sets: list[PlacedSet]
    terms: list[EdgeTerms]
    forced: tuple[int, ...]
    unit: float
    functions: Mapping[int, tuple[PlacedFunction, ...]] = field(default_factory=dict)
    solver: SolverChoice | None = None


class PlacedFunction(NamedTuple):
    """A function of the points of an edge's vertices: which of ``(xu, xv)`` it takes."""

    term: FunctionTerm
    takes_u: bool
    takes_v: bool

    def at(self, xu: np.ndarray, xv: np.ndarray) -> Any:
        """Return what the term does at points ``(n,)``."""
        numbers = [k for k, takes in enumerate((self.takes_u, self.takes_v)) if takes]
        return self.term.at({0: xu, 1: xv}, numbers)


@dataclass(frozen=True, eq=False)
class CyclePrice:
    """What the relaxation's solution says of a cycle of two edges: ``level + slope . x``.

    About the centre of its vertex's set, in which it is at least 0 to rounding of the solver.
    """

    of: TwoCycle
    level: float
    slope: np.ndarray


@dataclass(frozen=True, eq=False)
class Relaxed:
    """What the relaxation's solution says; none of it is proven.

    ``flows (m,)``; ``points_u``, ``points_v`` are the flow times the point, of each edge, less the
    centre; ``levels (n,)`` and ``slopes`` ``(k,)`` of each vertex are its potential, an affine
    function about its centre; ``visits (n,)`` the price of visiting a vertex at most once, and
    ``prizes`` of the forced edges; ``cost`` is infinite where no path is possible.
    """

    cost: float
    flows: np.ndarray
    points_u: list[np.ndarray]
    points_v: list[np.ndarray]
    levels: np.ndarray
    slopes: list[np.ndarray]
    visits: np.ndarray
    prizes: np.ndarray
    multipliers: list[Multipliers]
    residual: float
    cycles: list[CyclePrice]


def relax(problem: Problem, cycles: Sequence[TwoCycle] = ()) -> Relaxed:
    """Solve the relaxation, in which no path takes two edges of one of the cycles.

    Raises SolverError where the solver fails.
    """
    return _Relaxation(problem, cycles).solve()


def program_of(problem: Problem) -> tuple[ConeProgram, np.ndarray]:
    """Return the relaxation's program, in units of cost, and the columns ``(m,)`` of its flows."""
    made = _Relaxation(problem, ())
    return made._program, made._flows


class _Relaxation:
    """The program, and which of its rows is what."""

    def __init__(self, problem: Problem, cycles: Sequence[TwoCycle]) -> None:
        self._problem, self._cycles = problem, cycles
        network = problem.network
        self._program = program = ConeProgram()
        m = len(network.tails)
        self._flows = program.variables(m)
        self._ends: list[tuple[np.ndarray, np.ndarray]] = []
        self._lowered = []
        for e, (u, v) in enumerate(
            zip(network.tails.tolist(), network.heads.tolist(), strict=True)
        ):
            su, sv, scale = problem.sets[u], problem.sets[v], self._flows[e : e + 1]
            program.add_rows(Cone.NONNEGATIVE, [(scale, np.ones((1, 1)))], np.zeros(1))
            yu = program.variables(su.S.shape[1])
            yv = program.variables(sv.S.shape[1])
            su.add_membership(program, yu, scale)
            sv.add_membership(program, yv, scale)
            self._ends.append((yu, yv))
            self._lowered.append(problem.terms[e].lower(program, yu, yv, scale, problem.unit))
        self._conserve()
        self._limit_visits()
        self._part_cycles()
        self._force()

    def _conserve(self) -> None:
        network, sets = self._problem.network, self._problem.sets
        self._balance: list[Rows] = []
        self._moments: list[Rows | None] = []
        for v in range(network.size):
            into, out = network.entering[v], network.leaving[v]
            blocks = [(self._flows[into], np.ones((1, len(into))))]
            blocks.append((self._flows[out], -np.ones((1, len(out)))))
            excess = float(v == network.source) - float(v == network.target)
            self._balance.append(self._program.add_rows(Cone.ZERO, blocks, np.array([excess])))
            S = sets[v].S
            if v in (network.source, network.target) or not S.shape[1]:
                self._moments.append(None)
                continue
            scaled = S / _extent(sets[v])
            blocks = [(self._ends[e][1], scaled) for e in into]
            blocks += [(self._ends[e][0], -scaled) for e in out]
            rows = self._program.add_rows(Cone.ZERO, blocks, np.zeros(len(S)))
            self._moments.append(rows)

    def _limit_visits(self) -> None:
        """Ask that no vertex on a circle is visited more than once."""
        network = self._problem.network
        of = network.strong_components()
        is_on_circle = np.bincount(of)[of] > 1
        self._visits: list[Rows | None] = []
        for v in range(network.size):
            out = network.leaving[v]
            if not out or not is_on_circle[v]:
                self._visits.append(None)
                continue
            blocks = [(self._flows[out], -np.ones((1, len(out))))]
            self._visits.append(self._program.add_rows(Cone.NONNEGATIVE, blocks, np.ones(1)))

    def _part_cycles(self) -> None:
        """Ask that what came by an edge leaves by another than the one back.

        Of a cycle of two edges, what leaves on other edges less what came by this one is a flow
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
            scaled = placed.S / _extent(placed)
            blocks = [(y, scaled)]
            blocks += [(self._ends[e][0], -scaled) for e in others]
            blocks += [(self._ends[e][1], scaled) for e in into]
            moment = program.add_rows(Cone.ZERO, blocks, np.zeros(len(scaled)))
            self._parted.append((balance, moment))

    def _force(self) -> None:
        self._forced = [
            self._program.add_rows(
                Cone.ZERO, [(self._flows[[e]], np.ones((1, 1)))], np.array([-1.0])
            )
            for e in self._problem.forced
        ]

    def solve(self) -> Relaxed:
        """Solve, and read flows, points and multipliers."""
        problem, unit = self._problem, self._problem.unit
        solution = self._program.solve(
            "GraphOfConvexSets.solve_shortest_path: the relaxation",
            is_rough=True,
            by=problem.solver,
        )

        def price(rows: Rows | None) -> float:
            return 0.0 if rows is None else unit * float(solution.dual(rows)[0])

        slopes = [
            np.zeros(len(s.S)) if rows is None else -unit * solution.dual(rows) / _extent(s)
            for s, rows in zip(problem.sets, self._moments, strict=True)
        ]
        flows = solution.x[self._flows] if solution.is_feasible else np.zeros(len(self._flows))
        multipliers = [
            terms.multipliers(solution, lowered, unit)
            for terms, lowered in zip(problem.terms, self._lowered, strict=True)
        ]
        tails, heads = problem.network.tails, problem.network.heads
        u = [
            problem.sets[v].S @ self._at(solution, y)
            for v, (y, _) in zip(tails, self._ends, strict=True)
        ]
        v = [
            problem.sets[v].S @ self._at(solution, y)
            for v, (_, y) in zip(heads, self._ends, strict=True)
        ]
        cost = np.inf
        if solution.is_feasible:
            cost = self._program.cost_of(solution.x) * unit
        return Relaxed(
            cost,
            flows,
            u,
            v,
            np.array([-price(rows) for rows in self._balance]),
            slopes,
            np.array([price(rows) for rows in self._visits]),
            np.array([-price(rows) for rows in self._forced]),
            multipliers,
            solution.residual,
            self._prices(solution),
        )

    def _prices(self, solution: ConeSolution) -> list[CyclePrice]:
        unit, sets = self._problem.unit, self._problem.sets
        return [
            CyclePrice(
                cycle,
                -unit * float(solution.dual(balance)[0]),
                -unit * solution.dual(moment) / _extent(sets[cycle.vertex]),
            )
            for cycle, (balance, moment) in zip(self._cycles, self._parted, strict=True)
        ]

    def _at(self, solution: ConeSolution, columns: np.ndarray) -> np.ndarray:
        return solution.x[columns] if solution.is_feasible else np.zeros(len(columns))


def _extent(placed: PlacedSet) -> float:
    return float(placed.half.max(initial=0.0)) or 1.0
