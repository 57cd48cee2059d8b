"""The variables of trajectories that are sampled at knots, and the placeholders for them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.planning.optimal_control.arguments import as_count, as_index
from scene_graph_ros.planning.optimal_control.at_places import at_place, at_places
from scene_graph_ros.planning.optimal_control.casadi_backend import get_casadi
from scene_graph_ros.planning.optimal_control.dynamics import Dynamics
from scene_graph_ros.planning.optimal_control.errors import TrajectoryOptimizationError
from scene_graph_ros.planning.optimal_control.nonlinear_program import NonlinearProgram

__all__ = ["ShootingVariables"]


class ShootingVariables:
    """N samples of time, state x ``(n,)``, input u ``(m,)`` and further sequential variables.

    `time`, `state`, `input` and those of `new_sequential_variable` are placeholders: costs and
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

    # Expressions of them.

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
