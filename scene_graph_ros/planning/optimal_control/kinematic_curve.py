"""The best curve in time under bounds of its derivatives, and clear of obstacles."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.real_arrays import real_array
from scene_graph_ros.planning.optimal_control.arguments import (
    as_bounds,
    as_count,
    as_nonnegative,
    as_positive,
)
from scene_graph_ros.planning.optimal_control.casadi_backend import get_casadi
from scene_graph_ros.planning.optimal_control.dynamics import Dynamics
from scene_graph_ros.planning.optimal_control.errors import TrajectoryOptimizationError
from scene_graph_ros.planning.optimal_control.kinematic_bounds import DerivativeBound
from scene_graph_ros.planning.optimal_control.nonlinear_program import NonlinearProgram
from scene_graph_ros.planning.optimal_control.program_parts import Constraint
from scene_graph_ros.trajectories.bspline_trajectory import BsplineTrajectory

__all__ = ["BsplineBasis", "KinematicCurve"]

_SAME_KNOT = 1e-12
"""Of a curve's duration: knots that are so near are the same."""

_LEAST_DURATION = 1e-6
"""Seconds: a duration is a divisor."""

_ROUNDED = 1e-6
"""While it is solved, a length |d| counts as sqrt(|d|^2 + this^2) - this, which has derivatives
where nothing moves. Results have the length itself."""


@one_line()
@dataclass(frozen=True, eq=False)
class BsplineBasis:
    """The basis of a path: its order, one more than its degree, and its knots over [0, 1]."""

    order: int
    knots: NDArray[np.float64]

    @property
    def num_basis_functions(self) -> int:
        """As many as there are control points."""
        return len(self.knots) - self.order

    def derivative_matrix(self, order: int) -> NDArray[np.float64]:
        """Return the matrix ``(k, N)`` from the path's control points to a derivative's."""
        unit = BsplineTrajectory(self.knots, np.eye(self.num_basis_functions))
        return unit.derivative(order).control_points

    def weights(self, s: float, order: int = 0) -> NDArray[np.float64]:
        """Return the weights ``(N,)`` of control points in a derivative at s."""
        unit = BsplineTrajectory(self.knots, np.eye(self.num_basis_functions))
        return unit.derivative(order).value(s)


class KinematicCurve:
    """Costs and bounds of q(t) = r(t / T), with a B-spline r over [0, 1] and a duration T.

    The variables are r's control points ``(N, n)`` and T, in s. A curve and its derivatives are in
    the hulls of their control points, so bounds that those keep are kept at all times. Positions
    and velocities are bounded linearly; accelerations by T^2 and jerks by T^3.
    """

    def __init__(
        self,
        num_positions: int | BsplineTrajectory,
        num_control_points: int | None = None,
        spline_order: int = 4,
        duration: float = 1.0,
    ) -> None:
        """Make the variables, with a guess of zero over ``duration``, or that of a trajectory.

        ``KinematicTrajectoryOptimization(trajectory)`` takes its order, knots and control points,
        scaled to [0, 1]. Raises TrajectoryOptimizationError for fewer control points than the
        order, and for values that are no numbers.
        """
        self._ca = get_casadi()
        guess = num_positions if isinstance(num_positions, BsplineTrajectory) else None
        if guess is not None:
            order = guess.degree + 1
            knots = (guess.knots - guess.start_time) / guess.duration
            points, length = guess.control_points, guess.duration
        else:
            rows = as_count("num_positions", num_positions, 1)
            order = as_count("spline_order", spline_order, 1)
            count = as_count("num_control_points", num_control_points, order)
            points = np.zeros((count, rows))
            knots = BsplineTrajectory.clamped_uniform(points, order - 1).knots
            length = as_positive("duration", duration)
        self._basis = BsplineBasis(order, knots)
        self._n = points.shape[1]
        self._prog = NonlinearProgram()
        self._points = [self._prog.new_variables(self._n, f"r[{k}]") for k in range(len(points))]
        self._T = self._prog.new_variables(1, "T")
        self._prog.add_constraint(self._T, _LEAST_DURATION, np.inf, label="duration")
        self._bounds: list[DerivativeBound] = []
        self._rounded_off: list[Any] = []
        """What costs are less than they would be with lengths as they are."""
        self._set_guess(points, length)

    # What it is made of.

    def num_positions(self) -> int:
        """Return n."""
        return self._n

    def num_control_points(self) -> int:
        """Return N."""
        return len(self._points)

    def basis(self) -> BsplineBasis:
        """Return the basis of the path over [0, 1]."""
        return self._basis

    def control_points(self) -> Any:
        """Return the variables ``(N, n)``, as an expression."""
        return self._ca.horzcat(*self._points).T

    def duration(self) -> Any:
        """Return the variable T, s."""
        return self._T

    def prog(self) -> NonlinearProgram:
        """Return the program."""
        return self._prog

    def get_mutable_prog(self) -> NonlinearProgram:
        """Return the program: further costs and constraints may be added to it."""
        return self._prog

    def set_initial_guess(self, trajectory: BsplineTrajectory) -> None:
        """Begin the search with a trajectory of as many positions; other bases are sampled.

        A trajectory of another basis is fitted by least squares. Raises
        TrajectoryOptimizationError for other rows.
        """
        given: Any = trajectory
        rows = given.rows if isinstance(given, BsplineTrajectory) else None
        if rows != self._n:
            raise TrajectoryOptimizationError(
                f"trajectory must be a BsplineTrajectory of {self._n} rows, not"
                f" {quoted(given) if rows is None else rows}"
            )
        knots = (trajectory.knots - trajectory.start_time) / trajectory.duration
        points = trajectory.control_points
        own = self._basis.knots
        if len(knots) != len(own) or not np.allclose(knots, own, rtol=0.0, atol=_SAME_KNOT):
            s = np.linspace(0.0, 1.0, 8 * self.num_control_points())
            weights = np.array([self._basis.weights(each) for each in s])
            times = trajectory.start_time + s * trajectory.duration
            points = np.linalg.lstsq(weights, trajectory.value(times), rcond=None)[0]
        self._set_guess(points, trajectory.duration)

    def _set_guess(self, points: NDArray[np.float64], duration: float) -> None:
        for variable, point in zip(self._points, points, strict=True):
            self._prog.set_initial_guess(variable, point)
        self._prog.set_initial_guess(self._T, [duration])

    # Costs.

    def add_duration_cost(self, weight: float = 1.0) -> None:
        """Add ``weight`` for each second."""
        self._prog.add_cost(as_nonnegative("weight", weight) * self._T)

    def add_path_length_cost(
        self, weight: float = 1.0, use_conic_constraint: bool = False
    ) -> None:
        """Add ``weight`` times the length of the control polygon: the path is no longer.

        With ``use_conic_constraint`` each piece's length is a variable that is no less than it.
        """
        factor = as_nonnegative("weight", weight)
        ca, pieces = self._ca, self._pieces()
        lengths = ca.sqrt(ca.sum1(pieces**2).T + _ROUNDED**2) - _ROUNDED
        if use_conic_constraint:
            bounds = self._prog.new_variables(lengths.shape[0], "length")
            self._prog.add_constraint(bounds - lengths, 0.0, np.inf, label="length")
            lengths = bounds
        self._prog.add_cost(factor * ca.sum1(lengths))
        exact = ca.sum1(ca.sqrt(ca.sum1(pieces**2).T))
        self._rounded_off.append(factor * (exact - ca.sum1(lengths)))

    def add_path_energy_cost(self, weight: float = 1.0) -> None:
        """Add ``weight`` times the squared distances from control point to control point."""
        factor = as_nonnegative("weight", weight)
        self._prog.add_cost(factor * self._ca.sumsqr(self._pieces()))

    def _pieces(self) -> Any:
        """Return the steps from control point to control point ``(n, N - 1)``."""
        points = self._ca.horzcat(*self._points)
        return points[:, 1:] - points[:, :-1]

    # Bounds at all times.

    def add_duration_constraint(self, lb: float | None, ub: float | None) -> Constraint:
        """Bound the duration, s; None doesn't."""
        return self._prog.add_constraint(
            self._T,
            -np.inf if lb is None else lb,
            np.inf if ub is None else ub,
            label="duration",
        )

    def add_position_bounds(self, lb: ArrayLike, ub: ArrayLike) -> list[Constraint]:
        """Bound q(t) ``(n,)`` at all times."""
        return self._add_bounds("position", 0, lb, ub)

    def add_velocity_bounds(self, lb: ArrayLike, ub: ArrayLike) -> list[Constraint]:
        """Bound q'(t) ``(n,)`` at all times: rows are linear in control points and T."""
        return self._add_bounds("velocity", 1, lb, ub)

    def add_acceleration_bounds(self, lb: ArrayLike, ub: ArrayLike) -> list[Constraint]:
        """Bound q''(t) ``(n,)`` at all times."""
        return self._add_bounds("acceleration", 2, lb, ub)

    def add_jerk_bounds(self, lb: ArrayLike, ub: ArrayLike) -> list[Constraint]:
        """Bound q'''(t) ``(n,)`` at all times."""
        return self._add_bounds("jerk", 3, lb, ub)

    def _add_bounds(self, label: str, order: int, lb: Any, ub: Any) -> list[Constraint]:
        low, high = as_bounds(lb, ub, self._n)
        self._bounds.append(DerivativeBound(label, order, low, high))
        ca, scale = self._ca, self._T**order
        matrix = ca.sparsify(ca.DM(self._basis.derivative_matrix(order)))
        points = (matrix @ self.control_points()).T
        made = []
        for bound, sides in ((low, (0.0, np.inf)), (high, (-np.inf, 0.0))):
            some = np.flatnonzero(np.isfinite(bound))
            if not len(some):
                continue
            rows, finite = points[some.tolist(), :], bound[some]
            ends: tuple[ArrayLike, ArrayLike] = sides
            if order == 0:
                ends = (finite, np.inf) if sides[1] else (-np.inf, finite)
            else:
                rows = rows - scale * ca.repmat(ca.DM(finite), 1, points.shape[1])
            made += self._prog.add_constraint_for_each(
                ca.horzsplit(rows), *ends, label=label, knots=np.arange(points.shape[1])[:, None]
            )
        return made

    # At one place.

    def add_path_position_constraint(
        self,
        lb: ArrayLike | Callable[[Any], Any],
        ub: ArrayLike | float,
        s: float | None = None,
    ) -> Constraint:
        """Have ``lb <= r(s) <= ub``, or ``f(r(s))`` by ``add_path_position_constraint(f, s)``.

        ``f`` takes an expression ``(n,)`` and returns a formula, such as ``sumsqr(q) <= 1``. s is
        from 0 to 1.
        """
        if callable(lb):
            place = _as_place(ub if s is None else s)
            return self._prog.add_constraint(
                lb(self._at(place, 0)), label=f"position, s = {place}"
            )
        return self._add_at(0, "position", lb, ub, s)

    def add_path_velocity_constraint(self, lb: ArrayLike, ub: ArrayLike, s: float) -> Constraint:
        """Have ``lb <= r'(s) <= ub``: of the path, not of q'(t)."""
        return self._add_at(1, "path velocity", lb, ub, s)

    def add_path_acceleration_constraint(
        self, lb: ArrayLike, ub: ArrayLike, s: float
    ) -> Constraint:
        """Have ``lb <= r''(s) <= ub``: of the path, not of q''(t)."""
        return self._add_at(2, "path acceleration", lb, ub, s)

    def add_velocity_constraint_at_normalized_time(
        self, constraint: Callable[[Any, Any], Any], s: float
    ) -> Constraint:
        """Have a formula of ``constraint(q, v)`` hold, with q(T s) and q'(T s) ``(n,)``."""
        if not callable(constraint):
            raise TrajectoryOptimizationError(
                f"constraint must be a function of q and v, not {quoted(constraint)}"
            )
        place = _as_place(s)
        formula = constraint(self._at(place, 0), self._at(place, 1) / self._T)
        return self._prog.add_constraint(formula, label=f"velocity, s = {place}")

    def add_effort_bounds_at_normalized_times(
        self,
        dynamics: Dynamics,
        s: ArrayLike,
        lb: ArrayLike | None = None,
        ub: ArrayLike | None = None,
    ) -> list[Constraint]:
        """Bound the forces ``(n,)`` of a robot's joints, in N m and N, at places s ``(k,)``.

        They are those of inverse dynamics at q, q' and q'' there, for ``Dynamics.of_robot`` with
        all joints actuated; between the places nothing is asked. Where only one of the bounds is
        given the other is infinite. Raises TrajectoryOptimizationError for another system, places
        outside of 0 to 1 and bounds that contradict each other.
        """
        given: Any = dynamics
        equations = given.equations if isinstance(given, Dynamics) else None
        if equations is None or (dynamics.num_states, dynamics.num_inputs) != (
            2 * self._n,
            self._n,
        ):
            raise TrajectoryOptimizationError(
                f"dynamics must be Dynamics.of_robot of {self._n} positions, all actuated, not"
                f" {quoted(dynamics)}"
            )
        infinite = np.full(self._n, np.inf)
        low, high = as_bounds(
            -infinite if lb is None else lb, infinite if ub is None else ub, self._n
        )
        made = []
        given_places = real_array(s, "s must be numbers", TrajectoryOptimizationError)
        for place in [_as_place(each) for each in given_places.ravel().tolist()]:
            q, v, a = (self._at(place, k) / self._T**k for k in range(3))
            forces = equations.inverse_dynamics(q, v, a)
            made.append(self._prog.add_constraint(forces, low, high, label=f"effort, s = {place}"))
        return made

    def _add_at(self, order: int, label: str, lb: Any, ub: Any, s: Any) -> Constraint:
        place = _as_place(s)
        low, high = as_bounds(lb, ub, self._n)
        return self._prog.add_constraint(
            self._at(place, order), low, high, label=f"{label}, s = {place}"
        )

    def _at(self, s: float, order: int) -> Any:
        return self.control_points().T @ self._ca.MX(self._basis.weights(s, order))


def _as_place(s: Any) -> float:
    place = as_nonnegative("s", s)
    if place > 1.0:
        raise TrajectoryOptimizationError(f"s must be from 0 to 1, not {place}")
    return place
