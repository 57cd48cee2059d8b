"""Programs of functions that CasADi writes out and differentiates, solved nearby by IPOPT.

Where they are linear rows, norms, squares and products of two rows, `interior_point` comes first.

Waechter and Biegler, "On the implementation of an interior-point filter line-search algorithm for
large-scale nonlinear programming", Mathematical Programming 106(1), 2006.
"""

from __future__ import annotations

from collections.abc import Callable
import functools
import importlib
import importlib.util
from typing import Any

import numpy as np

from scene_graph_ros.convex.solve.cones.cone_program import Cone
from scene_graph_ros.convex.solve.interior_point import (
    Costs,
    FAR,
    independent,
    InteriorPoint,
    KEPT,
    LinearRows,
    NEAR,
    Rows,
    Search,
)
from scene_graph_ros.convex.solve.iteration_callback import iteration_callback, IterationCallback
from scene_graph_ros.convex.solve.products import Product, with_larger_bases

__all__ = ["SmoothProgram", "has_ipopt"]

_Kept = tuple[Callable[[Any], Any], np.ndarray]
"""Values of all rows that are at least 0, and at most these."""

_SHARP, _ROUGH = 1e-6, 1e-3
"""Norms are ``sqrt(|w|^2 + s^2)``, s being these parts of their sizes. Rough ones come first only
where a search does not end at the sharp ones."""

_SHARPER = (1e-4, 1e-5, _SHARP)
"""Then they become sharper in turn, each search from the end of the one before. A point of norms
as sharp as the first of these is a local optimum, of costs that are that near: where a norm
vanishes, a search for the sharpest ones may take tiny steps without an end."""

_SAME_ROW = 1e-12
"""Of a row's length: rows whose entries differ by less have one direction."""

_OPTIONS = {
    "ipopt.print_level": 0,
    "ipopt.sb": "yes",
    "print_time": False,
    "show_eval_warnings": False,
    "ipopt.tol": 1e-9,
    "ipopt.constr_viol_tol": 1e-10,
    "ipopt.max_iter": 150,
    # Bounds hold as they are, not relaxed by 1e-8.
    "ipopt.bound_relax_factor": 0.0,
    # A point is a solution if its optimality conditions hold, and not for lack of progress.
    "ipopt.acceptable_iter": 0,
    # No derivatives by parameters are asked for.
    "no_nlp_grad": True,
    "calc_lam_p": False,
}

_DERIVATIVES = {"grad_f": "nlp_grad_f", "jac_g": "nlp_jac_g", "hess_lag": "nlp_hess_l"}
"""CasADi's options for derivatives, and the names of those that a solver has written out."""

_PUSHED = (
    "ipopt.bound_push",
    "ipopt.bound_frac",
    "ipopt.slack_bound_push",
    "ipopt.slack_bound_frac",
)

_QUICK = {"ipopt.max_iter": 60}

_HOW: dict[str, dict[str, Any]] = {
    "far": _QUICK,
    # A weak barrier leaves the search near its start; a strong one first centres it.
    "near": {**_QUICK, "ipopt.mu_init": 1e-5, **dict.fromkeys(_PUSHED, 1e-2)},
    "rough": {},
    "rough_near": {"ipopt.mu_init": 1e-4, **dict.fromkeys(_PUSHED, 1e-6)},
    # From the point and the multipliers of the run before.
    "again": {
        **_QUICK,
        "ipopt.mu_init": 1e-5,
        "ipopt.warm_start_init_point": "yes",
        **{name.replace("ipopt.", "ipopt.warm_start_"): 1e-8 for name in _PUSHED},
        "ipopt.warm_start_mult_bound_push": 1e-8,
    },
}
"""The options of each solver, beside those of all."""


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
        self._count = count
        self._equations = [(np.zeros((0, count)), np.zeros(0))]
        self._least = [(np.zeros((0, count)), np.zeros(0))]
        self._rows = [(np.zeros((0, count)), np.zeros(0))]
        self._num_rows = 0
        self._kept: list[_Kept] = []
        self._costs: list[Callable[[Any], Any]] = []
        self._largest: list[tuple[Any, np.ndarray, np.ndarray]] = []
        self._zero: list[tuple[Product, ...]] = []
        self._positive: list[tuple[Product, ...]] = []
        """Sums of products that are 0, and those that are at least 0."""
        self._simple = Costs(np.zeros(count), [], [])
        self._is_simple = True
        """Whether these and linear rows are all that is asked."""
        self._is_rough = False
        self._solvers: dict[str, Any] = {}

    @functools.cached_property
    def _ca(self) -> Any:
        return importlib.import_module("casadi")

    @functools.cached_property
    def _y(self) -> Any:
        return self._ca.SX.sym("y", self._count)

    @functools.cached_property
    def _smoothed(self) -> Any:
        return self._ca.SX.sym("s")

    def at(self, M: np.ndarray, m: np.ndarray) -> Any:
        """Return rows as an expression ``(k, 1)``."""
        ca = self._ca
        return ca.mtimes(ca.sparsify(ca.DM(M)), self._y) + ca.DM(m)

    def _later(self, M: np.ndarray, m: np.ndarray) -> slice:
        """Return which of all rows these will be; one product makes all of them."""
        self._rows.append((M, m))
        self._num_rows += len(m)
        return slice(self._num_rows - len(m), self._num_rows)

    def add_equations(self, M: np.ndarray, m: np.ndarray) -> None:
        """Ask that rows are 0; those that follow from others are left out."""
        self._equations.append((M, m))

    def add_least(self, M: np.ndarray, m: np.ndarray) -> None:
        """Ask that rows are at least 0; two that are opposite are an equation."""
        self._least.append((M, m))

    def add_expressions(self, values: Any, is_equal: np.ndarray) -> None:
        """Ask that expressions ``(k, 1)`` are 0 where ``is_equal``, and at least 0 elsewhere."""
        self._is_simple = False
        self._kept.append((lambda _: values, np.where(is_equal, 0.0, np.inf)))

    def add_products(
        self, products: tuple[Product, ...], is_equal: bool, written: Callable[[], Any]
    ) -> None:
        """Ask that a sum of products ``(k,)`` is 0, or at least 0.

        ``written`` returns expressions ``(k, 1)`` that are kept where it is.
        """
        (self._zero if is_equal else self._positive).append(products)
        most = np.full(len(products[0].l), 0.0 if is_equal else np.inf)
        self._kept.append((lambda _: written(), most))

    def add_cone(self, cone: Cone, M: np.ndarray, m: np.ndarray) -> None:
        """Ask that rows are in a second-order or exponential cone."""
        assert cone in (Cone.SECOND_ORDER, Cone.EXPONENTIAL), cone
        ca, at, self._is_simple = self._ca, self._later(M, m), False

        def values(rows: Any) -> Any:
            w = rows[at]
            if cone is Cone.SECOND_ORDER:
                return ca.vertcat(w[0] ** 2 - ca.sumsqr(w[1:]), w[0])
            return ca.vertcat(w[2] - w[1] * ca.exp(w[0] / w[1]), w[1])

        self._kept.append((values, np.full(2, np.inf)))

    def add_cost(self, kind: str, M: np.ndarray, m: np.ndarray, unit: float, size: float) -> None:
        """Add a function of a kind of rows, or ``"sum"``, in units; a norm is at most ``size``."""
        ca, at = self._ca, self._later(M, m)
        self._add_simple(kind, M, m, unit, size)
        functions = {
            "norm": lambda w: ca.sqrt(ca.sumsqr(w) + (self._smoothed * size) ** 2),
            "quotient": lambda w: ca.sumsqr(w[1:]) / w[0],
            "exponential": lambda w: ca.exp(w[0]),
            "squares": ca.sumsqr,
            "sum": ca.sum1,
        }
        if kind == "norm_inf":
            largest = ca.SX.sym(f"largest{len(self._largest)}")
            self._largest.append((largest, M, m))
            both = lambda w: ca.vertcat(largest - w[at], largest + w[at])  # noqa: E731
            self._kept.append((both, np.full(2 * len(m), np.inf)))
            self._costs.append(lambda _: largest / unit)
            return
        if kind == "quotient":
            self._kept.append((lambda w: w[at.start], np.full(1, np.inf)))
        self._costs.append(lambda w: functions[kind](w[at]) / unit)

    def _add_simple(
        self, kind: str, M: np.ndarray, m: np.ndarray, unit: float, size: float
    ) -> None:
        """Add a cost to those that `InteriorPoint` knows, if it does."""
        simple = self._simple
        if kind == "sum":
            self._simple = simple._replace(linear=simple.linear + M.sum(axis=0) / unit)
        elif kind == "norm":
            self._simple = simple._replace(norms=[*simple.norms, (M, m, 1.0 / unit, size)])
        elif kind == "squares":
            self._simple = simple._replace(squares=[*simple.squares, (M, m, 1.0 / unit)])
        else:
            self._is_simple = False

    def solve(
        self, start: np.ndarray, *, is_near: bool = False, is_patient: bool = True
    ) -> tuple[np.ndarray, bool]:
        """Return a point ``(n,)`` and whether it is a local optimum: its conditions hold.

        ``is_near`` asks for one near the start, by a weak barrier. Without ``is_patient`` it ends
        where few iterations lead to none.

        Where the first search ends at none, a second one begins with longer durations, or whatever
        the bases of powers are, so that the inequalities are kept.
        """
        if not len(start):
            return start, True
        if self._is_simple and (self._zero or self._positive):
            found, is_optimal = self._by_products(start, NEAR if is_near else FAR)
            if not is_optimal and is_patient:
                raised = with_larger_bases(self._positive, start)
                found, is_optimal = self._by_products(raised, KEPT)
            if is_optimal or not is_patient:
                return found, is_optimal
        largest = [np.abs(M @ start + m).max(initial=0.0) for _, M, m in self._largest]
        first = np.append(start, largest)
        y, is_solved = first, False
        if not (self._is_rough and is_patient):
            y, is_solved, _ = self._run("near" if is_near else "far", first, _SHARP, {})
        if not is_solved and is_patient:
            self._is_rough = True
            y, is_solved = self._ever_sharper("rough_near" if is_near else "rough", first)
        return (y[: len(start)], is_solved) if np.isfinite(y).all() else (start, False)

    def _by_products(self, start: np.ndarray, search: Search) -> tuple[np.ndarray, bool]:
        """Return the point that `InteriorPoint` ends at, and whether it is optimal."""
        products = self._zero, self._positive
        program = InteriorPoint(start, self._rows_of_points, products, self._simple)
        return program.solve(search, self._is_over)

    def _ever_sharper(self, how: str, first: np.ndarray) -> tuple[np.ndarray, bool]:
        """Return the point of the sharpest norms at which a search ends well, and whether any."""
        best, _, told = self._run(how, first, _ROUGH, {})
        is_solved = False
        for smoothed in _SHARPER:
            if not np.isfinite(best).all():
                break
            y, is_better, told = self._run("again", best, smoothed, told)
            if not is_better:
                return best if is_solved else y, is_solved
            best, is_solved = y, True
        return best, is_solved

    def _run(
        self, how: str, start: np.ndarray, smoothed: float, told: dict[str, Any]
    ) -> tuple[np.ndarray, bool, dict[str, Any]]:
        """Return the point that one solver ends at, whether it is optimal, and multipliers."""
        if how not in self._solvers:
            self._solvers[how] = self._solver(how)
        solver = self._solvers[how]
        found = solver(x0=start, p=smoothed, lbg=0.0, ubg=self._most, **told)
        if self._stop is not None:
            self._stop.raise_error()
        is_solved = solver.stats()["return_status"] == "Solve_Succeeded"
        told = {"lam_x0": found["lam_x"], "lam_g0": found["lam_g"]}
        return found["x"].full().ravel(), is_solved, told

    @functools.cached_property
    def _linear(self) -> tuple[Rows, Rows]:
        """The equations, and the rows that are at least 0 and none of these."""
        M, m = (np.concatenate(some) for some in zip(*self._least, strict=True))
        once, is_equal = _without_opposites(M, m)
        all_equations = [*self._equations, (M[is_equal], m[is_equal])]
        E, e = (np.concatenate(some) for some in zip(*all_equations, strict=True))
        return (E, e), (M[once], m[once])

    @functools.cached_property
    def _rows_of_points(self) -> LinearRows:
        return LinearRows(*self._linear)

    @functools.cached_property
    def _written(self) -> tuple[dict[str, Any], np.ndarray]:
        """The program as expressions, and how large each of its constraints may be."""
        ca = self._ca
        (E, e), least = self._linear
        kept = independent(E)
        M_rows, m_rows = (np.concatenate(some) for some in zip(*self._rows, strict=True))
        rows = self.at(M_rows, m_rows)
        values = [self.at(E[kept], e[kept]), self.at(*least)]
        values += [of(rows) for of, _ in self._kept]
        program = {
            "x": ca.vertcat(self._y, *(symbol for symbol, _, _ in self._largest)),
            "p": self._smoothed,
            "f": sum((cost(rows) for cost in self._costs), ca.SX(0)),
            "g": ca.vertcat(*values),
        }
        linear = np.zeros(len(kept)), np.full(len(least[1]), np.inf)
        return program, np.concatenate([*linear, *(most for _, most in self._kept)])

    @property
    def _most(self) -> np.ndarray:
        return self._written[1]

    def _solver(self, how: str) -> Any:
        """Return a solver; all have the same derivatives."""
        program, most = self._written
        told = _OPTIONS | _HOW[how]
        if self._is_over is not None:
            if self._stop is None:
                is_over = self._is_over
                sizes = {"x": program["x"].numel(), "g": len(most), "p": 1}
                self._stop = iteration_callback(lambda *_: is_over(), **sizes)
            told["iteration_callback"] = self._stop
        if self._solvers:
            first = next(iter(self._solvers.values()))
            told |= {name: first.get_function(own) for name, own in _DERIVATIVES.items()}
        return self._ca.nlpsol(how, "ipopt", program, told)


def _without_opposites(M: np.ndarray, m: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the numbers of rows ``M @ y + m`` to be at least 0, and of those that are to be 0.

    Those are one of two that are opposite, between which an interior-point method has no room. Of
    equal rows one is returned. All rows count by their direction.
    """
    rows = np.column_stack([M, m])
    sizes = np.linalg.norm(rows, axis=1)
    rows = rows / np.where(sizes > 0.0, sizes, 1.0)[:, None]
    first = np.argmax(np.abs(rows) > _SAME_ROW, axis=1)
    signs = np.where(rows[np.arange(len(rows)), first] < 0.0, -1.0, 1.0)
    keys = np.rint(signs[:, None] * rows / _SAME_ROW) + 0.0  # -0 is 0
    firsts: dict[tuple[bytes, float], int] = {}
    for k, (key, sign) in enumerate(zip(keys, signs.tolist(), strict=True)):
        firsts.setdefault((key.tobytes(), sign), k)
    is_both = {key: (key[0], -key[1]) in firsts for key in firsts}
    once = [k for key, k in firsts.items() if not is_both[key]]
    equal = [k for key, k in firsts.items() if is_both[key] and key[1] > 0.0]
    return np.array(once, dtype=np.intp), np.array(equal, dtype=np.intp)
