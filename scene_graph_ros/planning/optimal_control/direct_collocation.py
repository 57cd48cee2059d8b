"""Trajectories of cubics that obey the dynamics at knots and in the middle between them."""

from __future__ import annotations

from typing import Any

import numpy as np

from scene_graph_ros.planning.optimal_control.arguments import as_positive
from scene_graph_ros.planning.optimal_control.collocation_constraint import (
    ends_of_step,
    require_continuous,
    step_function,
)
from scene_graph_ros.planning.optimal_control.dynamics import Dynamics
from scene_graph_ros.planning.optimal_control.errors import TrajectoryOptimizationError
from scene_graph_ros.planning.optimal_control.multiple_shooting import MultipleShooting
from scene_graph_ros.planning.optimal_control.nonlinear_program import NonlinearProgram
from scene_graph_ros.trajectories.piecewise_polynomial import PiecewisePolynomial

__all__ = ["DirectCollocation"]


class DirectCollocation(MultipleShooting):
    """Direct collocation with cubic states, inputs that are linear between knots, and free steps.

    C. R. Hargraves and S. W. Paris, "Direct trajectory optimization using nonlinear programming
    and collocation", 1987. The dynamics hold at knots and midpoints, and running costs are
    integrated by Simpson's rule over the same places, so both are exact to third order and more.
    """

    def __init__(
        self,
        dynamics: Dynamics,
        num_time_samples: int,
        minimum_time_step: float,
        maximum_time_step: float,
        *,
        prog: NonlinearProgram | None = None,
    ) -> None:
        """Make the variables, and add the dynamics; steps are in s. Raises for discrete ones.

        With ``prog``, another one's `prog`, both are one program, which costs and constraints may
        couple: `solve` of one finds both, and `result_of` the other, of its ``program_result``,
        returns the other's trajectory.
        """
        low = as_positive("minimum_time_step", minimum_time_step)
        high = as_positive("maximum_time_step", maximum_time_step)
        if low > high:
            raise TrajectoryOptimizationError(
                f"minimum_time_step = {low} must not be above maximum_time_step = {high}"
            )
        super().__init__(dynamics, num_time_samples, (low, high), prog)
        require_continuous(dynamics)
        count = self.num_time_samples - 1
        step = step_function(dynamics)
        steps = step.map(count)
        ca = self._ca
        x, u, t = ca.horzcat(*self._x), ca.horzcat(*self._u), ca.horzcat(*self._t)
        defects, middles = steps(
            ca.horzcat(*self._h), t[:-1], x[:, :-1], u[:, :-1], x[:, 1:], u[:, 1:]
        )
        self._middles = ca.horzsplit(middles)
        first = np.repeat(np.arange(count), dynamics.num_states)
        knots = np.column_stack([first, first + 1])
        added = self._prog.add_constraint(defects, 0.0, 0.0, label="dynamics", knots=knots)
        self._is_separable = (
            dynamics.has_second_derivatives and not dynamics.function.jac_sparsity(0, 2).nnz()
        )
        if self._is_separable:
            self._prog.add_block_constraint(added, self._block(step, 0), self._block_variables())

    def _block_variables(self) -> list[list[Any]]:
        """Return the variables of each step: its length, where it is one, and both ends'."""
        ends = [[x, u] if u.shape[0] else [x] for x, u in zip(self._x, self._u, strict=True)]
        return [
            [*([h] if self._has_variable_steps else []), *ends[k], *ends[k + 1]]
            for k, h in enumerate(self._h)
        ]

    def _block(self, step: Any, which: int) -> Any:
        """Return an output of a function of h, t, x0, u0, x1 and u1 as one of a step's variables.

        It does not depend on t.
        """
        ca, n, m = self._ca, self.dynamics.num_states, self.dynamics.num_inputs
        sizes = [1 if self._has_variable_steps else 0, n, m, n, m]
        z = ca.SX.sym("z", sum(sizes))
        h, x0, u0, x1, u1 = ca.vertsplit(z, np.concatenate([[0], np.cumsum(sizes)]).tolist())
        value = step(h if self._has_variable_steps else self._steps[0], 0.0, x0, u0, x1, u1)
        return ca.Function("block", [z], [ca.densify(value[which])])

    def _add_running_cost(self, g: Any) -> None:
        ca = self._ca

        def between(knots: list[Any]) -> list[Any]:
            stacked = ca.horzcat(*knots)
            return ca.horzsplit(0.5 * (stacked[:, :-1] + stacked[:, 1:]))

        others = self._others()
        at_knots = self._at_knots(g, self._t, self._x, self._u, others)
        middle = self._at_knots(
            g, between(self._t), self._middles, between(self._u), [between(v) for v in others]
        )
        h = ca.horzcat(*self._h) / 6.0
        cost = ca.dot(h, at_knots[:, :-1] + 4.0 * middle + at_knots[:, 1:])
        rate = self._rate_of_cost(g)
        if rate is None:
            self._prog.add_cost(cost)
        else:
            block = self._block(_cost_function(self.dynamics, rate), 0)
            self._prog.add_block_cost(cost, block, self._block_variables())

    def _rate_of_cost(self, g: Any) -> Any:
        """Return a running cost as a function of t, x and u; None where a step has others."""
        ca = self._ca
        known = {symbol.__hash__() for symbol in self._placeholders[1:]}
        if not self._is_separable or any(s.__hash__() not in known for s in ca.symvar(g)):
            return None
        try:
            return ca.Function("rate", list(self._placeholders), [ca.densify(g)]).expand()
        except RuntimeError:  # no scalar operations: the cost is differentiated as a whole then
            return None

    def reconstruct_state_trajectory(self, result: Any) -> PiecewisePolynomial:
        """Return cubics with the states and the dynamics' rates at the knots."""
        times, x = self.get_sample_times(result), self.get_state_samples(result)
        u, p = self.get_input_samples(result), self.dynamics.parameters
        mapped = self.dynamics.function.map(len(times))
        rates = np.array(mapped(x.T, u.T, times[None], np.tile(p[:, None], len(times)))).T
        return PiecewisePolynomial.cubic_hermite(times, x, rates.reshape(x.shape))

    def reconstruct_input_trajectory(self, result: Any) -> PiecewisePolynomial:
        """Return straight lines between the inputs at the knots."""
        times = self.get_sample_times(result)
        return PiecewisePolynomial.first_order_hold(times, self.get_input_samples(result))


def _cost_function(dynamics: Dynamics, rate: Any) -> Any:
    """Return a function of a step to the integral of a running cost, by Simpson's rule."""
    from scene_graph_ros.planning.optimal_control.casadi_backend import get_casadi

    ca = get_casadi()
    names = ca.SX.sym("h"), ca.SX.sym("t"), *ends_of_step(ca.SX, dynamics)
    h, t, x0, u0, x1, u1 = names
    _, middle = step_function(dynamics)(*names)
    between = rate(t + 0.5 * h, middle, 0.5 * (u0 + u1))
    total = h / 6.0 * (rate(t, x0, u0) + 4.0 * between + rate(t + h, x1, u1))
    return ca.Function("cost", list(names), [total, middle])
