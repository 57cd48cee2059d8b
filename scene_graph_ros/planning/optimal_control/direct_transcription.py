"""Trajectories by one step of a simple integrator from sample to sample."""

from __future__ import annotations

from typing import Any

import numpy as np

from scene_graph_ros.planning.optimal_control.arguments import as_positive
from scene_graph_ros.planning.optimal_control.dynamics import Dynamics
from scene_graph_ros.planning.optimal_control.errors import TrajectoryOptimizationError
from scene_graph_ros.planning.optimal_control.multiple_shooting import MultipleShooting
from scene_graph_ros.planning.optimal_control.nonlinear_program import NonlinearProgram
from scene_graph_ros.trajectories.piecewise_polynomial import PiecewisePolynomial

__all__ = ["DirectTranscription"]


class DirectTranscription(MultipleShooting):
    """Direct transcription: ``x[k + 1] = x[k] + h f(x[k], u[k])``, or f itself where discrete.

    Steps are fixed: for continuous dynamics to ``fixed_time_step``, in s (forward Euler, exact to
    first order), for discrete ones to their own. Running costs are sums over steps. The last input
    has no step to act in, and is held equal to the one before.
    """

    def __init__(
        self,
        dynamics: Dynamics,
        num_time_samples: int,
        fixed_time_step: float | None = None,
        *,
        prog: NonlinearProgram | None = None,
    ) -> None:
        """Make the variables, and add the dynamics, to another's ``prog`` where one is given.

        Raises TrajectoryOptimizationError for continuous dynamics without a step, and for discrete
        ones with one.
        """
        step = _step_of(dynamics, fixed_time_step)
        super().__init__(dynamics, num_time_samples, (step, step), prog)
        ca, N = self._ca, self.num_time_samples
        x, u, t = ca.horzcat(*self._x), ca.horzcat(*self._u), ca.horzcat(*self._t)
        p = ca.repmat(ca.MX(dynamics.parameters), 1, N - 1)
        moved = dynamics.function.map(N - 1)(x[:, :-1], u[:, :-1], t[:-1], p)
        reached = moved if dynamics.is_discrete else x[:, :-1] + step * moved
        first = np.repeat(np.arange(N - 1), dynamics.num_states)
        knots = np.column_stack([first, first + 1])
        self._prog.add_constraint(x[:, 1:] - reached, 0.0, 0.0, label="dynamics", knots=knots)
        if dynamics.num_inputs:
            self._prog.add_constraint(
                self._u[-1] - self._u[-2], 0.0, 0.0, label="last input", knots=[N - 1]
            )

    def _add_running_cost(self, g: Any) -> None:
        others = [each[:-1] for each in self._others()]
        rates = self._at_knots(g, self._t[:-1], self._x[:-1], self._u[:-1], others)
        self._prog.add_cost(self._steps[0] * self._ca.sum2(rates))

    def reconstruct_state_trajectory(self, result: Any) -> PiecewisePolynomial:
        """Return straight lines between the states, as forward Euler has them."""
        times = self.get_sample_times(result)
        return PiecewisePolynomial.first_order_hold(times, self.get_state_samples(result))

    def reconstruct_input_trajectory(self, result: Any) -> PiecewisePolynomial:
        """Return inputs that are constant over each step."""
        times, u = self.get_sample_times(result), self.get_input_samples(result)
        return PiecewisePolynomial(times, u[:-1, np.newaxis])


def _step_of(dynamics: Any, fixed_time_step: float | None) -> float:
    own = getattr(dynamics, "discrete_step", None)
    if own is not None:
        if fixed_time_step is not None:
            raise TrajectoryOptimizationError(
                f"fixed_time_step = {fixed_time_step} is for continuous dynamics, these have a"
                f" discrete_step of {own} s"
            )
        return float(own)
    if fixed_time_step is None:
        raise TrajectoryOptimizationError(
            "fixed_time_step must be given for continuous dynamics; discrete ones have their own"
        )
    return as_positive("fixed_time_step", fixed_time_step)
