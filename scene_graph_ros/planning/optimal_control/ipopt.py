"""One run of IPOPT, with the best point on its way and the names of failed constraints."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
import time
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.convex.solve.iteration_callback import iteration_callback, IterationCallback
from scene_graph_ros.planning.optimal_control.casadi_backend import get_casadi
from scene_graph_ros.planning.optimal_control.errors import TrajectoryOptimizationError
from scene_graph_ros.planning.optimal_control.program_for_ipopt import ProgramForIpopt
from scene_graph_ros.planning.optimal_control.program_parts import ProgramParts
from scene_graph_ros.planning.optimal_control.program_result import (
    ConstraintViolation,
    ProgramResult,
    SolveStatus,
)
from scene_graph_ros.planning.optimal_control.solver_options import SolverOptions
from scene_graph_ros.planning.parallel.deadline import Deadline, ENDLESS

__all__ = ["IpoptRun"]

_STATUS = {
    "Solve_Succeeded": SolveStatus.SOLVED,
    "Solved_To_Acceptable_Level": SolveStatus.NEARLY_SOLVED,
    "Feasible_Point_Found": SolveStatus.NEARLY_SOLVED,
    "Search_Direction_Becomes_Too_Small": SolveStatus.NEARLY_SOLVED,
    "Infeasible_Problem_Detected": SolveStatus.INFEASIBLE,
    "Invalid_Problem_Definition": SolveStatus.INFEASIBLE,
    "Not_Enough_Degrees_Of_Freedom": SolveStatus.INFEASIBLE,
    "Maximum_Iterations_Exceeded": SolveStatus.ITERATION_LIMIT,
    "Maximum_CpuTime_Exceeded": SolveStatus.TIME_LIMIT,
    "Maximum_WallTime_Exceeded": SolveStatus.TIME_LIMIT,
    "User_Requested_Stop": SolveStatus.STOPPED,
    "Invalid_Number_Detected": SolveStatus.INVALID_NUMBER,
}

_WORTH_ANOTHER = {
    SolveStatus.INFEASIBLE,
    SolveStatus.NEARLY_SOLVED,
    SolveStatus.INVALID_NUMBER,
    SolveStatus.FAILED,
}
"""Ends after which another start may do better."""

_NOISE = 0.2
"""Of a variable's guess, or of 1, by which the second start is off; later ones by more."""

_SHOWN = 20
"""Violations in a result."""

_WARM = {
    "warm_start_init_point": "yes",
    "mu_init": 1e-6,
    "warm_start_bound_push": 1e-9,
    "warm_start_bound_frac": 1e-9,
    "warm_start_slack_bound_push": 1e-9,
    "warm_start_slack_bound_frac": 1e-9,
    "warm_start_mult_bound_push": 1e-9,
}

_FREE = {
    "mu_strategy": "adaptive",
    "adaptive_mu_globalization": "never-monotone-mode",
    "alpha_for_y": "min-dual-infeas",
    "constr_mult_init_max": 0.0,
}
"""Barrier and multipliers follow each step (Nocedal, Waechter and Waltz, 2009), from zero on.

Of 36 swing-ups with 15 to 31 samples from lines of 3 to 5 s all are solved so by the first start,
22 as IPOPT is set by default."""

_NEAREST = {"least_square_init_primal": "yes", "mu_init": 1e-2, "constr_mult_init_max": 0.0}
"""The search begins at the point nearest to the guess that the linearized constraints allow."""


class IpoptRun:
    """Solves a program once."""

    def __init__(
        self,
        program: ProgramParts,
        options: SolverOptions,
        evaluate: Callable[..., Any],
        deadline: Deadline = ENDLESS,
    ) -> None:
        self._deadline = deadline
        self.ca = get_casadi()
        self.program, self.options, self.evaluate = program, options, evaluate
        self.given = ProgramForIpopt(program)
        self.best: tuple[float, float] = np.inf, np.inf
        self.best_x: NDArray[np.float64] | None = None
        self._watch: IterationCallback | None = None

    def solved(self, warm_start: ProgramResult | None) -> ProgramResult:
        """Run, and return the solution."""
        x0 = self.program.initial_guess if warm_start is None else warm_start.x
        if x0.shape != (self.program.num_variables,):
            raise TrajectoryOptimizationError(
                f"warm_start has {x0.size} variables, the program {self.program.num_variables}:"
                " give a result of the same program"
            )
        self._check_guess(x0)
        arguments = self.given.arguments()
        if warm_start is not None:
            of_x, of_g = warm_start.multipliers
            rows = np.zeros(len(self.given.lower))
            rows[: min(len(of_g), len(rows))] = of_g[: len(rows)]
            arguments |= {"lam_x0": of_x, "lam_g0": rows[self.given.rows]}
        plans = self._plans(warm_start is not None)
        begin, iterations = time.process_time(), 0
        for start, (told, noise) in enumerate(plans):
            if start == 0 or told != plans[start - 1][0]:
                solver = self._solver(told)
            try:
                found = solver(x0=self._start(x0, noise), **arguments)
            except Exception:
                self._raise_lost()
                raise
            self._raise_lost()
            stats = solver.stats()
            iterations += int(stats["iter_count"])
            result = self._result(found, stats, iterations, start + 1)
            if result.is_success or result.status not in _WORTH_ANOTHER:
                break
            if self._deadline.is_over():
                break
        return replace(result, seconds=time.process_time() - begin)

    def _start(self, x0: NDArray[np.float64], noise: int) -> NDArray[np.float64]:
        """Return the initial point of a search: the guess, later farther and farther from it."""
        if noise == 0:
            return x0
        normal = np.random.default_rng(noise).standard_normal(len(x0))
        return np.asarray(x0 + _NOISE * noise * np.maximum(1.0, abs(x0)) * normal)

    def _plans(self, is_warm: bool) -> list[tuple[dict[str, Any], int]]:
        """Return IPOPT's options at each start, and the noise in the guess."""
        if is_warm:
            return [(_WARM, 0)]
        count = 1 + self.options.restarts
        if not self.program.has_rough_guess:
            return [({}, noise) for noise in range(count)]
        return [(_FREE, 0), (_NEAREST, 0), *((_FREE, k) for k in range(1, count))][:count]

    def _solver(self, more: dict[str, Any]) -> Any:
        ca, options = self.ca, self.options
        told: dict[str, Any] = {
            "tol": options.tolerance,
            "constr_viol_tol": options.feasibility_tolerance,
            "max_iter": options.max_iterations,
            "max_wall_time": options.timeout,
            "print_level": options.print_level,
            "sb": "yes",
            # Bounds hold as they are, not relaxed by 1e-8.
            "bound_relax_factor": 0.0,
            "honor_original_bounds": "yes",
        }
        told |= more
        if not self.program.has_second_derivatives:
            told["hessian_approximation"] = "limited-memory"
        told |= dict(options.ipopt)
        told = {f"ipopt.{key}": value for key, value in told.items()}
        sizes = {"x": len(self.given.least), "g": len(self.given.rows), "p": 0}
        self._watch = iteration_callback(self.watch, **sizes)
        told |= {
            "print_time": False,
            **self.given.options,
            "iteration_callback": self._watch,
            "show_eval_warnings": False,
        }
        return ca.nlpsol("ipopt", "ipopt", self.given.problem, told)

    def _check_guess(self, x0: NDArray[np.float64]) -> None:
        """Raise where something is no number at the guess, naming it."""
        try:
            f, g = self.given.values(x0)
        except Exception:
            self._raise_lost()
            raise
        rows = np.array(g).ravel()
        if not np.isfinite(rows).all():
            constraint, row = self._at(int(np.argmin(np.isfinite(rows))))
            about = constraint.knots[row]
            where = f" at knot {about[0]}" if about.size else ""
            raise TrajectoryOptimizationError(
                f"{constraint.label}, row {row}, is no finite number at the initial guess{where}:"
                " give a guess where the functions are defined"
            )
        if not np.isfinite(float(f)):
            raise TrajectoryOptimizationError(
                f"the cost is {float(f)} at the initial guess: give a guess where it is defined"
            )

    def _at(self, row: int) -> tuple[Any, int]:
        """Return the constraint that a row belongs to, and its row there."""
        for constraint in self.program.constraints:
            if row < len(constraint.lower):
                return constraint, row
            row -= len(constraint.lower)
        raise AssertionError(row)

    def watch(self, x: NDArray[np.float64], f: float, g: NDArray[np.float64]) -> bool:
        """Take note of a point on the way, of its cost and of the rows that IPOPT has.

        Return whether it is time to stop.
        """
        beyond = self.given.largest_beyond(x, g)
        merit = max(beyond - self.options.feasibility_tolerance, 0.0), f
        if merit < self.best:
            self.best, self.best_x = merit, x
        for callback in self.program.callbacks:
            callback(x)
        return self._deadline.is_over()

    def _raise_lost(self) -> None:
        """Raise the error that was raised inside CasADi."""
        if self._watch is not None:
            self._watch.raise_error()
        for check in self.program.raise_error:
            check()

    def _result(self, found: Any, stats: Any, iterations: int, starts: int) -> ProgramResult:
        word = str(stats["return_status"])
        status = _STATUS.get(word, SolveStatus.FAILED)
        if status is SolveStatus.STOPPED and self._deadline.is_over():
            status = SolveStatus.TIME_LIMIT
        x = np.array(found["x"]).ravel()
        if status is not SolveStatus.SOLVED and self.best_x is not None:
            x = self.best_x
        f, g = self.given.values(x)
        rows = np.array(g).ravel()
        beyond = self.given.beyond(rows)
        largest = float(beyond.max(initial=0.0))
        violations = self._violations(rows, beyond)
        is_success = status is SolveStatus.SOLVED and not violations
        reason = "" if is_success else status.value
        if violations:
            reason += f"; {violations[0]}"
        return ProgramResult(
            is_success,
            status,
            float(f),
            reason,
            violations,
            largest,
            iterations,
            starts,
            word,
            0.0,
            x,
            self.given.multipliers(found),
            self.evaluate,
        )

    def _violations(
        self, rows: NDArray[np.float64], beyond: NDArray[np.float64]
    ) -> tuple[ConstraintViolation, ...]:
        order = np.argsort(-beyond, kind="stable")[:_SHOWN]
        result = []
        for k in order[beyond[order] > self.options.feasibility_tolerance]:
            constraint, row = self._at(int(k))
            result.append(
                ConstraintViolation(
                    constraint.label,
                    row,
                    float(beyond[k]),
                    float(rows[k]),
                    float(self.given.lower[k]),
                    float(self.given.upper[k]),
                    tuple(int(knot) for knot in constraint.knots[row]),
                    expression=constraint.expression,
                )
            )
        return tuple(result)
