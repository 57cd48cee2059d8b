"""Trajectories as samples of states and inputs, joined by a system's dynamics."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.planning.optimal_control.arguments import as_bounds, as_count, as_index
from scene_graph_ros.planning.optimal_control.at_places import at_place, at_places
from scene_graph_ros.planning.optimal_control.casadi_backend import get_casadi
from scene_graph_ros.planning.optimal_control.dynamics import Dynamics
from scene_graph_ros.planning.optimal_control.errors import TrajectoryOptimizationError
from scene_graph_ros.planning.optimal_control.guesses import as_guess, check_continuous
from scene_graph_ros.planning.optimal_control.nonlinear_program import NonlinearProgram
from scene_graph_ros.planning.optimal_control.program_parts import Constraint
from scene_graph_ros.planning.optimal_control.program_result import ProgramResult
from scene_graph_ros.planning.optimal_control.shooting_result import TrajectoryOptimizationResult
from scene_graph_ros.planning.optimal_control.solver_options import SolverOptions
from scene_graph_ros.planning.trajectories.piecewise_polynomial import PiecewisePolynomial

__all__ = ["MultipleShooting"]

_BETWEEN = np.arange(1, 8) / 8.0
"""Places between knots where dynamics are measured."""


class MultipleShooting(ABC):
    """N samples of time, state x ``(n,)``, input u ``(m,)`` and what else goes with them.

    `time`, `state`, `input` and what `new_sequential_variable` returns are placeholders: costs and
    constraints of them are for all knots. With an index `state` and `input` are the variables of
    one knot, for `prog`. Expressions are of CasADi; formulas compare them.
    """

    def __init__(
        self,
        dynamics: Dynamics,
        num_time_samples: int,
        steps: tuple[float, float],
        prog: NonlinearProgram | None = None,
    ) -> None:
        if not isinstance(dynamics, Dynamics):
            raise TrajectoryOptimizationError(
                f"dynamics must be Dynamics, not {quoted(dynamics)}: make them of a function"
            )
        ca = self._ca = get_casadi()
        self.dynamics = dynamics
        self.num_time_samples = as_count("num_time_samples", num_time_samples, 2)
        n, m, N = dynamics.num_states, dynamics.num_inputs, self.num_time_samples
        if not isinstance(prog, NonlinearProgram | None):
            raise TrajectoryOptimizationError(f"prog must be another's prog(), not {quoted(prog)}")
        self._prog = NonlinearProgram() if prog is None else prog
        self._prog.has_rough_guess = True
        self._prog.has_second_derivatives &= dynamics.has_second_derivatives
        self._prog.raise_error.append(dynamics.raise_error)
        self._steps = steps
        self._has_variable_steps = steps[0] < steps[1]
        self._h = [
            self._prog.new_variables(1, f"h[{k}]") if self._has_variable_steps else steps[0]
            for k in range(N - 1)
        ]
        self._x = [self._prog.new_variables(n, f"x[{k}]") for k in range(N)]
        self._u = [self._prog.new_variables(m, f"u[{k}]") for k in range(N)]
        self._prog.own(self, [*self._x, *self._u, *(self._h if self._has_variable_steps else [])])
        self._t: list[Any] = [ca.MX(0.0)]
        for h in self._h:
            self._t.append(self._t[-1] + h)
        self._sequential: dict[str, tuple[Any, list[Any]]] = {}
        self._placeholders = ca.MX.sym("time"), ca.MX.sym("state", n), ca.MX.sym("input", m)
        names = "time()", "state()", "input()"
        for symbol, name in zip(self._placeholders, names, strict=True):
            self._prog.placeholders[symbol.__hash__()] = name
        if self._has_variable_steps:
            for h in self._h:
                self._prog.set_initial_guess(h, [0.5 * (steps[0] + steps[1])])
            self.add_time_interval_bounds(*steps)

    # What is to be asked of.

    def prog(self) -> NonlinearProgram:
        """Return the program: further variables, costs and constraints may be added to it."""
        return self._prog

    def time(self) -> Any:
        """Return the placeholder for the time of any knot."""
        return self._placeholders[0]

    def state(self, index: int | None = None) -> Any:
        """Return the placeholder for any knot's state, or the variables ``(n,)`` of one knot."""
        return self._placeholders[1] if index is None else self._x[self._knot(index)]

    def input(self, index: int | None = None) -> Any:
        """Return the placeholder for any knot's input, or the variables ``(m,)`` of one knot."""
        return self._placeholders[2] if index is None else self._u[self._knot(index)]

    def _knot(self, index: int) -> int:
        return as_index("index", index, self.num_time_samples)

    def initial_state(self) -> Any:
        """Return the variables of the first state."""
        return self._x[0]

    def final_state(self) -> Any:
        """Return the variables of the last state."""
        return self._x[-1]

    def time_step(self, index: int) -> Any:
        """Return the variable of a step, s. Raises where steps are fixed."""
        self._require_variable_steps("time_step()")
        return self._h[as_index("index", index, self.num_time_samples - 1)]

    def fixed_time_step(self) -> float:
        """Return the step, s. Raises where steps are variables."""
        if self._has_variable_steps:
            raise TrajectoryOptimizationError("steps are variables here: see time_step(index)")
        return self._steps[0]

    def _require_variable_steps(self, what: str) -> None:
        if not self._has_variable_steps:
            raise TrajectoryOptimizationError(
                f"{what} needs steps that are variables, here they are fixed to {self._steps[0]} s"
            )

    def new_sequential_variable(self, rows: int, name: str) -> Any:
        """Return a placeholder for ``rows`` new variables at each knot."""
        count = as_count("rows", rows, 1)
        if name in self._sequential:
            raise TrajectoryOptimizationError(f"there is a sequential variable {quoted(name)}")
        placeholder = self._ca.MX.sym(name, count)
        self._prog.placeholders[placeholder.__hash__()] = f"sequential variable {name!r}"
        knots = range(self.num_time_samples)
        variables = [self._prog.new_variables(count, f"{name}[{k}]") for k in knots]
        self._prog.own(self, variables)
        self._sequential[name] = placeholder, variables
        return placeholder

    def get_sequential_variable_at_index(self, name: str, index: int) -> Any:
        """Return the variables of a sequential variable at one knot."""
        return self._named(name)[1][self._knot(index)]

    def _named(self, name: str) -> tuple[Any, list[Any]]:
        if name not in self._sequential:
            raise TrajectoryOptimizationError(
                f"there is no sequential variable {quoted(name)}, only {sorted(self._sequential)}"
            )
        return self._sequential[name]

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

    def _at_knot(self, expression: Any, k: int) -> Any:
        """Return an expression with a knot's variables for placeholders."""
        own = [each[k] for each in (self._t, self._x, self._u, *self._others())]
        return at_place(expression, self._symbols(), own)

    def _at_knots(
        self, expression: Any, t: list[Any], x: list[Any], u: list[Any], others: list[list[Any]]
    ) -> Any:
        """Return a column of placeholders at each of some places, as columns side by side."""
        return at_places(expression, self._symbols(), [t, x, u, *others])

    def _symbols(self) -> list[Any]:
        return [*self._placeholders, *(symbol for symbol, _ in self._sequential.values())]

    def _others(self) -> list[list[Any]]:
        return [variables for _, variables in self._sequential.values()]

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

    def _columns(self, variables: list[Any]) -> Any:
        return self._ca.horzcat(*variables).T

    def _times_column(self) -> Any:
        return self._ca.vertcat(*self._t)

    def _reader(self, expressions: list[Any]) -> Callable[[Any], list[NDArray[np.float64]]]:
        """Return a function of all variables, which may become more, to arrays."""
        made: dict[int, Any] = {}

        def read(x: NDArray[np.float64]) -> list[NDArray[np.float64]]:
            count = len(x)
            if count not in made:
                stacked = self._ca.vertcat(*self._prog.variables)
                made[count] = self._ca.Function("read", [stacked], expressions)
            found = made[count].call([x])
            return [np.array(each) for each in found]

        return read

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
    ) -> TrajectoryOptimizationResult:
        """Return the best trajectory that is found from the guess, or from an earlier result.

        Raises TrajectoryOptimizationError where something is no number at the guess.
        """
        before = None if warm_start is None else warm_start.program_result
        return self.result_of(self._prog.solve(options, warm_start=before))

    def result_of(self, found: ProgramResult) -> TrajectoryOptimizationResult:
        """Return what a solution of the program says of the trajectory."""
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
        """Return how far the state's rate is from the dynamics between knots, and where."""
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
