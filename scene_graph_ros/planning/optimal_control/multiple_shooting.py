"""Trajectories as samples of states and inputs, joined by a system's dynamics."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.planning.optimal_control.arguments import as_bounds
from scene_graph_ros.planning.optimal_control.dynamics import Dynamics
from scene_graph_ros.planning.optimal_control.errors import TrajectoryOptimizationError
from scene_graph_ros.planning.optimal_control.guesses import as_guess, check_continuous
from scene_graph_ros.planning.optimal_control.nonlinear_program import NonlinearProgram
from scene_graph_ros.planning.optimal_control.program_parts import Constraint
from scene_graph_ros.planning.optimal_control.program_result import ProgramResult
from scene_graph_ros.planning.optimal_control.shooting_result import TrajectoryOptimizationResult
from scene_graph_ros.planning.optimal_control.shooting_variables import ShootingVariables
from scene_graph_ros.planning.optimal_control.solver_options import SolverOptions
from scene_graph_ros.trajectories.piecewise_polynomial import PiecewisePolynomial

__all__ = ["MultipleShooting"]

_BETWEEN = np.arange(1, 8) / 8.0
"""Places between knots where dynamics are measured."""


@one_line("num_time_samples")
class MultipleShooting(ShootingVariables, ABC):
    """A trajectory by N samples of time, state x ``(n,)`` and input u ``(m,)``.

    Costs and constraints of placeholders, such as `time` and `state` return, are for all knots.
    Expressions are of CasADi; formulas compare them.
    """

    def __init__(
        self,
        dynamics: Dynamics,
        num_time_samples: int,
        steps: tuple[float, float],
        prog: NonlinearProgram | None = None,
    ) -> None:
        super().__init__(dynamics, num_time_samples, steps, prog)
        if self._has_variable_steps:
            self.add_time_interval_bounds(*steps)

    # Costs and constraints.

    def add_running_cost(self, g: Any) -> None:
        """Add the integral over time of an expression of placeholders."""
        self._add_running_cost(self._one("running cost", g))

    @abstractmethod
    def _add_running_cost(self, g: Any) -> None:
        """Add the integral in the way that is as exact as the dynamics are."""

    def add_final_cost(self, e: Any) -> None:
        """Add an expression of placeholders, at the last knot."""
        last = self.num_time_samples - 1
        self._prog.add_cost(self._at_knot(self._one("final cost", e), last))

    def _one(self, label: str, expression: Any) -> Any:
        found = self._ca.MX(expression)
        if found.shape != (1, 1):
            raise TrajectoryOptimizationError(
                f"a {label} must be one expression, not of shape {found.shape}"
            )
        return found

    def add_constraint_to_all_knot_points(
        self,
        f: Any,
        lb: ArrayLike | None = None,
        ub: ArrayLike | None = None,
        *,
        label: str = "constraint",
    ) -> list[Constraint]:
        """Add a formula of placeholders, some of them, or ``lb <= f <= ub``, at each knot."""
        formulas = list(f) if isinstance(f, (list, tuple)) else [f]
        given: Any = formulas if lb is None and ub is None else self._ca.vertcat(*formulas)
        column, lower, upper = self._prog.rows_of(given, lb, ub)
        everywhere = self._at_knots(column, self._t, self._x, self._u, self._others())
        return self._prog.add_constraint_for_each(
            self._ca.horzsplit(everywhere),
            lower,
            upper,
            label=label,
            knots=[[k] for k in range(self.num_time_samples)],
        )

    def add_time_interval_bounds(self, lower_bound: float, upper_bound: float) -> list[Constraint]:
        """Bound each step, s. Raises where steps are fixed."""
        self._require_variable_steps("add_time_interval_bounds()")
        low, high = as_bounds(lower_bound, upper_bound, 1)
        knots = [[k, k + 1] for k in range(len(self._h))]
        return self._prog.add_constraint_for_each(
            self._h, low, high, label="time step", knots=knots
        )

    def add_equal_time_intervals_constraints(self) -> list[Constraint]:
        """Have all steps be equal. Raises where steps are fixed."""
        self._require_variable_steps("add_equal_time_intervals_constraints()")
        steps = self._ca.vertcat(*self._h)
        same = self._ca.vertsplit(steps[1:] - steps[:-1]) if len(self._h) > 1 else []
        return self._prog.add_constraint_for_each(
            same, 0.0, 0.0, label="equal time steps", knots=[[k + 1] for k in range(len(same))]
        )

    def add_duration_bounds(self, lower_bound: float, upper_bound: float) -> Constraint:
        """Bound the time that all takes, s. Raises where steps are fixed."""
        self._require_variable_steps("add_duration_bounds()")
        low, high = as_bounds(lower_bound, upper_bound, 1)
        last = [self.num_time_samples - 1]
        return self._prog.add_constraint(self._t[-1], low, high, label="duration", knots=last)

    # Callbacks.

    def add_state_trajectory_callback(self, callback: Callable[[Any, Any], None]) -> None:
        """Call ``callback(sample_times, states)`` at each iteration; states ``(N, n)``."""
        self._add_callback(lambda times, x, u, others: callback(times, x), [])

    def add_input_trajectory_callback(self, callback: Callable[[Any, Any], None]) -> None:
        """Call ``callback(sample_times, inputs)`` at each iteration; inputs ``(N, m)``."""
        self._add_callback(lambda times, x, u, others: callback(times, u), [])

    def add_complete_trajectory_callback(
        self, callback: Callable[[Any, Any, Any, Any], None], names: Sequence[str] = ()
    ) -> None:
        """Call ``callback(sample_times, states, inputs, values)`` at each iteration.

        ``values`` are those of the sequential variables called ``names``, ``(N, rows)`` each.
        """
        self._add_callback(callback, list(names))

    def _add_callback(self, callback: Callable[..., None], names: list[str]) -> None:
        rows = [self._columns(self._named(name)[1]) for name in names]
        own = [self._times_column(), self._columns(self._x), self._columns(self._u)]
        read = self._reader([*own, *rows])

        def called(point: NDArray[np.float64]) -> None:
            times, x, u, *values = read(point)
            callback(times.ravel(), x, u, values)

        self._prog.callbacks.append(called)

    # Guesses and results.

    def set_initial_trajectory(self, traj_init_u: Any = None, traj_init_x: Any = None) -> None:
        """Begin the search with an input's and a state's trajectory; None leaves a guess.

        Steps are then equal, as long as the trajectories take; IPOPT moves them into their bounds.
        Raises TrajectoryOptimizationError for other rows, for states that jump, and for two
        trajectories of different times.
        """
        u = as_guess("traj_init_u", traj_init_u, self.dynamics.num_inputs)
        x = as_guess("traj_init_x", traj_init_x, self.dynamics.num_states)
        check_continuous("traj_init_x", x)
        given = [each for each in (x, u) if each is not None]
        if not given:
            return
        start, end = given[0].start_time, given[0].end_time
        if any(abs(e.start_time - start) + abs(e.end_time - end) > 1e-9 * end for e in given):
            raise TrajectoryOptimizationError(
                f"traj_init_x is from {start} to {end} s, traj_init_u from {given[1].start_time}"
                f" to {given[1].end_time} s: scale or shift one"
            )
        step = (end - start) / (self.num_time_samples - 1)
        if not self._has_variable_steps:
            step = self._steps[0]
        times = start + step * np.arange(self.num_time_samples)
        for curve, variables in ((x, self._x), (u, self._u)):
            if curve is not None:
                for variable, value in zip(variables, curve.value(times), strict=True):
                    self._prog.set_initial_guess(variable, value)
        if self._has_variable_steps:
            for h in self._h:
                self._prog.set_initial_guess(h, [step])

    def solve(
        self,
        options: SolverOptions | None = None,
        *,
        warm_start: TrajectoryOptimizationResult | None = None,
        timeout: float | None = None,
        watch: Callable[[], object] | None = None,
    ) -> TrajectoryOptimizationResult:
        """Return the best trajectory that is found from the guess, or from an earlier result.

        ``timeout`` (s) and ``watch`` are as of `NonlinearProgram.solve`. Raises
        TrajectoryOptimizationError where something is no number at the guess.
        """
        before = None if warm_start is None else warm_start.program_result
        found = self._prog.solve(options, warm_start=before, timeout=timeout, watch=watch)
        return self.result_of(found)

    def result_of(self, found: ProgramResult) -> TrajectoryOptimizationResult:
        """Return the trajectory's result from a solution of the program."""
        times, x = self.get_sample_times(found), self.get_state_samples(found)
        u = self.get_input_samples(found)
        violations = tuple(
            replace(each, time=float(times[each.knots[0]]))
            if each.knots and self._prog.is_owned(self, each.expression)
            else each
            for each in found.violations
        )
        reason = found.reason
        if violations:
            reason = f"{found.status.value}; {violations[0]}"
        states = self.reconstruct_state_trajectory(found)
        inputs = self.reconstruct_input_trajectory(found) if self.dynamics.num_inputs else None
        worst, at = self._residual(times, states, inputs)
        return TrajectoryOptimizationResult(
            found, violations, reason, times, x, u, states, inputs, worst, at
        )

    def _residual(
        self, times: Any, states: PiecewisePolynomial, inputs: PiecewisePolynomial | None
    ) -> tuple[float, float]:
        """Return the largest residual of the dynamics between knots, and its time."""
        if self.dynamics.is_discrete:
            return 0.0, float(times[0])
        at = (times[:-1, None] + np.diff(times)[:, None] * _BETWEEN).ravel()
        x, rate = states.value(at), states.derivative().value(at)
        u = np.zeros((len(at), 0)) if inputs is None else inputs.value(at)
        p = self.dynamics.parameters
        mapped = self.dynamics.function.map(len(at))
        f = np.array(mapped(x.T, u.T, at[None], np.tile(p[:, None], len(at)))).T
        errors = abs(rate - f.reshape(rate.shape)).max(axis=1)
        errors = np.where(np.isnan(errors), np.inf, errors)
        worst = int(np.argmax(errors))
        return float(errors[worst]), float(at[worst])

    def get_sample_times(self, result: Any) -> NDArray[np.float64]:
        """Return the times ``(N,)`` of the knots, s."""
        return _of(result).value(self._times_column()).ravel()

    def get_state_samples(self, result: Any) -> NDArray[np.float64]:
        """Return the states ``(N, n)`` at the knots."""
        return _of(result).value(self._columns(self._x))

    def get_input_samples(self, result: Any) -> NDArray[np.float64]:
        """Return the inputs ``(N, m)`` at the knots."""
        if not self.dynamics.num_inputs:
            return np.zeros((self.num_time_samples, 0))
        return _of(result).value(self._columns(self._u))

    def get_sequential_variable_samples(self, result: Any, name: str) -> NDArray[np.float64]:
        """Return the values ``(N, rows)`` of a sequential variable at the knots."""
        return _of(result).value(self._columns(self._named(name)[1]))

    @abstractmethod
    def reconstruct_state_trajectory(self, result: Any) -> PiecewisePolynomial:
        """Return the state over time, as the dynamics' discretization has it."""

    @abstractmethod
    def reconstruct_input_trajectory(self, result: Any) -> PiecewisePolynomial:
        """Return the input over time, as the dynamics' discretization has it."""


def _of(result: Any) -> ProgramResult:
    """Return the program's result of either kind."""
    return result.program_result if isinstance(result, TrajectoryOptimizationResult) else result
