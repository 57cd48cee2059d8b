"""The optimum of a program in standard form: solvers and tolerances in turn, residuals checked.

The solver is Clarabel, unless another is chosen. Its verdict is looked at here alone, and is no
answer: the residuals of its numbers are.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from scene_graph_ros.convex.errors import SolverError
from scene_graph_ros.convex.solve.cones.by_clarabel import ask_clarabel
from scene_graph_ros.convex.solve.cones.by_highs import ask_highs
from scene_graph_ros.convex.solve.cones.by_scs import ask_scs
from scene_graph_ros.convex.solve.cones.solver_choice import SolverChoice
from scene_graph_ros.convex.solve.cones.standard_form import Cone, Reply, StandardForm, Status
from scene_graph_ros.convex.solve.linear_algebra.sparse_kernels import products

__all__ = ["TOLERANCES", "ConeSolution", "Rows", "optimum"]

TOLERANCES = (1e-10, 1e-8, 1e-6)
"""What the solver is asked for in turn, relative and absolute: programs come scaled to a size of
1. It may lose its way where more is asked than rounding allows."""

_ACCEPTED = 1e-5
"""Largest residual of a solution that is passed on."""

_ACCEPTED_ROUGH = 1e-3
"""The same of programs whose solutions only suggest what to look at, and whose bounds are computed
from the multipliers, whatever they are."""

_TRUSTED_ROUGH = 1e-8
"""The largest residual of such a program that is not solved again with refined steps: refining
them takes as long as finding them. What the solver says of its solution does not matter here."""

_PLAIN = SolverChoice("clarabel")

_UNREFINED = SolverChoice("clarabel", {"iterative_refinement_enable": False})

_CAREFUL = SolverChoice("clarabel", {"equilibrate_enable": False, "max_step_fraction": 0.9})
"""Where it lost its way: steps end further from the border, exponential cones' above all."""


class Rows(NamedTuple):
    """Some rows of a program: which of their cone's."""

    cone: Cone
    first: int
    size: int


@dataclass(frozen=True)
class ConeSolution:
    """An optimum, or a proof in floats that there is none.

    ``is_feasible`` is False for the latter: the multipliers then are such that no x has
    ``-sum of multipliers times rows`` at most 0. ``x (n,)``. ``residual`` is the largest of
    those of equations, cones, stationarity and the gap.
    """

    is_feasible: bool
    x: np.ndarray
    duals: tuple[np.ndarray, ...]
    residual: float

    def dual(self, rows: Rows) -> np.ndarray:
        """Return multipliers z ``(size,)``: the cost less ``z . rows`` has its least value at x.

        They are in the dual of the rows' cone to rounding of the solver.
        """
        return self.duals[rows.cone][rows.first : rows.first + rows.size]


def optimum(
    form: StandardForm,
    what: str,
    is_rough: bool,
    by: SolverChoice | None,
    tolerance: float,
    is_over: Callable[[], bool] | None = None,
) -> ConeSolution:
    """Return the optimum, or that there is none, as `ConeProgram.solve`."""
    best: tuple[float, Reply | None] = (np.inf, None)
    accepted = max(_ACCEPTED, _ACCEPTED_ROUGH) if is_rough else _ACCEPTED
    attempts = [(each, _PLAIN if by is None else by) for each in _tolerances(by)]
    if is_rough and by is None:
        attempts.insert(0, (tolerance, _UNREFINED))
    if by is None:
        attempts.append((tolerance, _CAREFUL))
    status, word = Status.UNSURE, ""
    for asked, solver in attempts:
        if solver is _CAREFUL and (best[0] <= accepted or status is Status.UNBOUNDED):
            break
        reply = _ask(form, asked, what, solver, is_over)
        status, word = reply.status, reply.word
        residual = _residual(form, reply)
        if residual < best[0] and status is not Status.UNBOUNDED:
            best = residual, reply
        enough = max(_TRUSTED_ROUGH, 10.0 * asked) if solver is _UNREFINED else _ACCEPTED
        is_sure = is_rough or status in (Status.SOLVED, Status.INFEASIBLE)
        if residual <= enough and is_sure:
            break
    # What it gave up on may be as near: its residuals say so, not its word.
    residual, found = best
    if found is None or not residual <= accepted:
        endless = "; its cost may go down for ever" if status is Status.UNBOUNDED else ""
        off = f"largest residual {residual:.1e}, accepted {accepted:g}"
        raise SolverError(
            f"{what}: the program of {form.A.shape[1]} variables and {form.A.shape[0]} rows was"
            f" not solved ({word}, {off}){endless}"
        )
    firsts = np.cumsum([form.counts[cone] for cone in Cone])
    duals = tuple(np.split(found.z, firsts[:-1]))
    return ConeSolution(found.status is not Status.INFEASIBLE, found.x, duals, residual)


def _tolerances(by: SolverChoice | None) -> tuple[float, ...]:
    """Return the tolerances in turn; one, where the caller has given it."""
    is_given = by is not None and (
        by.name != "clarabel" or any(name.startswith("tol_") for name in by.options)
    )
    return TOLERANCES[:1] if is_given else TOLERANCES


def _residual(form: StandardForm, reply: Reply) -> float:
    """Return the largest residual of a solution's equations, stationarity and gap."""
    A, b, q = form.A, form.b, form.q
    x, z, s = reply.x, reply.z, reply.s
    is_ray = reply.status is Status.INFEASIBLE
    if not all(np.isfinite(each).all() for each in ((z,) if is_ray else (x, z, s))):
        return np.inf
    if is_ray:
        size = abs(float(b @ z))
        return float(np.abs(A.T @ z).max(initial=0.0)) / size if size else np.inf
    size = 1.0 + float(np.abs(b).max(initial=0.0))
    along, across = products(A.data, A.indices, A.indptr, x, z)
    equations = float(np.abs(along + s - b).max(initial=0.0)) / size
    stationarity = float(np.abs(across + q).max(initial=0.0)) / (1.0 + np.abs(q).max(initial=0.0))
    gap = abs(float(q @ x + b @ z)) / (1.0 + abs(float(q @ x)))
    return max(equations, stationarity, gap)


def _ask(
    form: StandardForm,
    tolerance: float,
    what: str,
    by: SolverChoice,
    is_over: Callable[[], bool] | None,
) -> Reply:
    if by.name == "highs":
        return ask_highs(form, by.options, what)
    if by.name == "scs":
        return ask_scs(form, by.options, what)
    return ask_clarabel(form, tolerance, by.options, what, is_over)
