"""Trajectories of cubics that obey the dynamics at knots and in the middle between them."""

from __future__ import annotations

from typing import Any

import numpy as np

from scene_graph_ros.planning.optimal_control.arguments import as_positive
from scene_graph_ros.planning.optimal_control.dynamics import Dynamics
from scene_graph_ros.planning.optimal_control.errors import (
    DynamicsError,
    TrajectoryOptimizationError,
)
from scene_graph_ros.planning.optimal_control.multiple_shooting import MultipleShooting
from scene_graph_ros.planning.trajectories.piecewise_polynomial import PiecewisePolynomial

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
    ) -> None:
        """Make the variables, and add the dynamics; steps are in s. Raises for discrete ones."""
        low = as_positive("minimum_time_step", minimum_time_step)
        high = as_positive("maximum_time_step", maximum_time_step)
        if low > high:
            raise TrajectoryOptimizationError(
                f"minimum_time_step = {low} must not be above maximum_time_step = {high}"
            )
        super().__init__(dynamics, num_time_samples, (low, high))
        if dynamics.is_discrete:
            raise DynamicsError(
                "collocation is for continuous dynamics, these have a discrete_step: take"
                " DirectTranscription"
            )
        count = self.num_time_samples - 1
        steps = _step_function(dynamics).map(count)
        ca = self._ca
        x, u, t = ca.horzcat(*self._x), ca.horzcat(*self._u), ca.horzcat(*self._t)
        defects, middles = steps(
            ca.horzcat(*self._h), t[:-1], x[:, :-1], u[:, :-1], x[:, 1:], u[:, 1:]
        )
        self._middles = ca.horzsplit(middles)
        first = np.repeat(np.arange(count), dynamics.num_states)
        knots = np.column_stack([first, first + 1])
        self._prog.add_constraint(defects, 0.0, 0.0, label="dynamics", knots=knots)

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
        self._prog.add_cost(ca.dot(h, at_knots[:, :-1] + 4.0 * middle + at_knots[:, 1:]))

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


def _step_function(dynamics: Dynamics) -> Any:
    """Return a function of a step to what its dynamics lack, and to the state in the middle."""
    from scene_graph_ros.planning.optimal_control.casadi_backend import get_casadi

    ca = get_casadi()
    kind = ca.SX if dynamics.has_second_derivatives else ca.MX
    n, m, f = dynamics.num_states, dynamics.num_inputs, dynamics.function
    h, t = kind.sym("h"), kind.sym("t")
    x0, x1, u0, u1 = kind.sym("x0", n), kind.sym("x1", n), kind.sym("u0", m), kind.sym("u1", m)
    p = kind(dynamics.parameters)
    f0, f1 = f(x0, u0, t, p), f(x1, u1, t + h, p)
    middle = 0.5 * (x0 + x1) + h / 8.0 * (f0 - f1)
    between = f(middle, 0.5 * (u0 + u1), t + 0.5 * h, p)
    # Simpson's rule; the cubic's slope in the middle is the dynamics' exactly where this is zero.
    defect = x1 - x0 - h / 6.0 * (f0 + 4.0 * between + f1)
    return ca.Function("collocation", [h, t, x0, u0, x1, u1], [defect, middle])
