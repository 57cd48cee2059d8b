"""Programs of functions that CasADi writes out and differentiates, solved nearby by IPOPT.

Waechter and Biegler, "On the implementation of an interior-point filter line-search algorithm for
large-scale nonlinear programming", Mathematical Programming 106(1), 2006.
"""

from __future__ import annotations

from collections.abc import Callable
import importlib
import importlib.util
from typing import Any

import numpy as np

from scene_graph_ros.convex.solve.cones.cone_program import Cone
from scene_graph_ros.convex.solve.iteration_callback import iteration_callback, IterationCallback

__all__ = ["SmoothProgram", "has_ipopt"]

_SMOOTHED = (1e-3, 1e-6)
"""Norms are ``sqrt(|w|^2 + s^2)``, s being these parts of their sizes, one run after the other."""

_DEPENDENT = 1e-11
"""Of the longest row: what is left of a row less others, where it depends on them."""

_OPTIONS = {
    "ipopt.print_level": 0,
    "ipopt.sb": "yes",
    "print_time": False,
    "show_eval_warnings": False,
    "ipopt.tol": 1e-9,
    "ipopt.constr_viol_tol": 1e-10,
    "ipopt.max_iter": 300,
    # Bounds hold as they are, not relaxed by 1e-8.
    "ipopt.bound_relax_factor": 0.0,
    # A point is a solution if its optimality conditions hold, and not for lack of progress.
    "ipopt.acceptable_iter": 0,
}

_DERIVATIVES = {"grad_f": "nlp_grad_f", "jac_g": "nlp_jac_g", "hess_lag": "nlp_hess_l"}
"""CasADi's options for derivatives, and the names of those that a solver has written out."""

_PUSH = 1e-8

_NEAR = {
    "ipopt.mu_init": 1e-4,
    "ipopt.bound_push": 1e-6,
    "ipopt.bound_frac": 1e-6,
    "ipopt.slack_bound_push": 1e-6,
    "ipopt.slack_bound_frac": 1e-6,
}
"""A weak barrier, which leaves the search near its start; a strong one first centres it."""

_AGAIN = {
    "ipopt.mu_init": 1e-5,
    "ipopt.warm_start_init_point": "yes",
    "ipopt.warm_start_bound_push": _PUSH,
    "ipopt.warm_start_bound_frac": _PUSH,
    "ipopt.warm_start_slack_bound_push": _PUSH,
    "ipopt.warm_start_slack_bound_frac": _PUSH,
    "ipopt.warm_start_mult_bound_push": _PUSH,
}
"""From the point and multipliers of the run before."""


def has_ipopt() -> bool:
    """Tell whether CasADi, which has IPOPT, is installed."""
    return importlib.util.find_spec("casadi") is not None


class SmoothProgram:
    """Costs and constraints of variables y ``(n,)``; rows are ``M @ y + m``, ``(k,)``.

    A search ends where ``is_over``, which is asked at each iteration, says so: then its point is
    no local optimum.
    """

    def __init__(self, count: int, is_over: Callable[[], bool] | None = None) -> None:
        self._is_over = is_over
        self._stop: IterationCallback | None = None
        self._ca = importlib.import_module("casadi")
        self._y = self._ca.SX.sym("y", count)
        self._smoothed = self._ca.SX.sym("s")
        self._equations = [(np.zeros((0, count)), np.zeros(0))]
        self._others: list[Any] = []
        self._most = [np.zeros(0)]
        self._costs: list[Any] = []
        self._largest: list[tuple[Any, np.ndarray, np.ndarray]] = []
        self._solvers: list[Any] = []

    def at(self, M: np.ndarray, m: np.ndarray) -> Any:
        """Return rows as an expression ``(k, 1)``."""
        ca = self._ca
        # Of a long program's variables a row takes few.
        taken = np.flatnonzero(M.any(axis=0))
        if not len(taken):
            return ca.SX(ca.DM(m))
        some = ca.sparsify(ca.DM(M[:, taken]))
        return ca.mtimes(some, self._y[taken.tolist()]) + ca.DM(m)

    def add_equations(self, M: np.ndarray, m: np.ndarray) -> None:
        """Ask that rows are 0; those that follow from others are left out."""
        self._equations.append((M, m))

    def add_least(self, M: np.ndarray, m: np.ndarray) -> None:
        """Ask that rows are at least 0."""
        self.add_expressions(self.at(M, m), np.zeros(len(m), dtype=bool))

    def add_expressions(self, values: Any, is_equal: np.ndarray) -> None:
        """Ask that expressions ``(k, 1)`` are 0 where ``is_equal``, and at least 0 elsewhere."""
        self._others.append(values)
        self._most.append(np.where(is_equal, 0.0, np.inf))

    def add_cone(self, cone: Cone, M: np.ndarray, m: np.ndarray) -> None:
        """Ask that rows are in a second-order or exponential cone."""
        ca, w = self._ca, self.at(M, m)
        if cone is Cone.SECOND_ORDER:
            values = ca.vertcat(w[0] ** 2 - ca.sumsqr(w[1:]), w[0])
        else:
            assert cone is Cone.EXPONENTIAL, cone
            values = ca.vertcat(w[2] - w[1] * ca.exp(w[0] / w[1]), w[1])
        self.add_expressions(values, np.zeros(2, dtype=bool))

    def add_cost(self, kind: str, M: np.ndarray, m: np.ndarray, unit: float, size: float) -> None:
        """Add a function of a kind of rows, or ``"sum"``, in units; a norm is at most ``size``."""
        ca, w = self._ca, self.at(M, m)
        if kind == "norm":
            cost = ca.sqrt(ca.sumsqr(w) + (self._smoothed * size) ** 2)
        elif kind == "norm_inf":
            cost = ca.SX.sym(f"largest{len(self._largest)}")
            self._largest.append((cost, M, m))
            self.add_expressions(ca.vertcat(cost - w, cost + w), np.zeros(2 * len(m), dtype=bool))
        elif kind == "quotient":
            cost = ca.sumsqr(w[1:]) / w[0]
            self.add_expressions(w[0], np.zeros(1, dtype=bool))
        elif kind == "exponential":
            cost = ca.exp(w[0])
        else:
            cost = {"squares": ca.sumsqr, "sum": ca.sum1}[kind](w)
        self._costs.append(cost / unit)

    def solve(self, start: np.ndarray, *, is_near: bool = False) -> tuple[np.ndarray, bool]:
        """Return a point ``(n,)`` and whether it is a local optimum: its conditions hold.

        ``is_near`` asks for one near the start, by a weak barrier.
        """
        if not len(start):
            return start, True
        if not self._solvers:
            self._solvers = self._made()
        largest = [np.abs(M @ start + m).max(initial=0.0) for _, M, m in self._largest]
        most = np.concatenate(self._most)
        y = np.append(start, largest)
        told: dict[str, Any] = {}
        far, near, again = self._solvers
        for smoothed, solver in zip(_SMOOTHED, (near if is_near else far, again), strict=True):
            found = solver(x0=y, p=smoothed, lbg=0.0, ubg=most, **told)
            y = found["x"].full().ravel()
            if not np.isfinite(y).all():
                return start, False
            if self._stop is not None:
                self._stop.raise_error()
            told = {"lam_x0": found["lam_x"], "lam_g0": found["lam_g"]}
        is_solved = solver.stats()["return_status"] == "Solve_Succeeded"
        return y[: len(start)], is_solved

    def _made(self) -> list[Any]:
        """Return solvers for rough norms, far and near, and for sharp ones."""
        ca = self._ca
        M, m = (np.concatenate(some) for some in zip(*self._equations, strict=True))
        kept = _independent(M)
        self._most.insert(0, np.zeros(len(kept)))
        program = {
            "x": ca.vertcat(self._y, *(symbol for symbol, _, _ in self._largest)),
            "p": self._smoothed,
            "f": sum(self._costs, ca.SX(0)),
            "g": ca.vertcat(self.at(M[kept], m[kept]), *self._others),
        }
        told = dict(_OPTIONS)
        if self._is_over is not None:
            is_over = self._is_over
            sizes = {"x": program["x"].numel(), "g": program["g"].numel(), "p": 1}
            self._stop = iteration_callback(lambda *_: is_over(), **sizes)
            told["iteration_callback"] = self._stop
        first = ca.nlpsol("first", "ipopt", program, told)
        same = {name: first.get_function(own) for name, own in _DERIVATIVES.items()}
        others: dict[str, dict[str, Any]] = {"near": _NEAR, "again": _AGAIN}
        return [
            first,
            *(
                ca.nlpsol(name, "ipopt", program, told | own | same)
                for name, own in others.items()
            ),
        ]


def _independent(M: np.ndarray) -> np.ndarray:
    """Return the numbers of rows ``(r,)`` of ``(k, n)`` that none of the others depend on.

    By a QR decomposition with pivots. Where right sides contradict each other, points keep the
    rows that are returned and break the others: who asks looks at these, too.
    """
    from scipy.linalg import qr

    if not M.any():
        return np.zeros(0, dtype=np.intp)
    triangle, order = qr(M.T, mode="r", pivoting=True)
    diagonal = np.abs(np.diagonal(triangle))
    rank = int(np.count_nonzero(diagonal > _DEPENDENT * diagonal[0]))
    return np.sort(order[:rank])
