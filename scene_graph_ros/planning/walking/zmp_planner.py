"""The best motion of a walking robot's centre of mass after a zero-moment point."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
import itertools
from typing import Any, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scene_graph_ros.geometry.errors import SceneGraphError
from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.planning.walking.pendulum_optimum import PendulumOptimum
from scene_graph_ros.trajectories.arguments import as_finite, as_numbers, as_positive
from scene_graph_ros.trajectories.exponential_plus_piecewise_polynomial import (
    ExponentialPlusPiecewisePolynomial,
)
from scene_graph_ros.trajectories.piecewise_polynomial import PiecewisePolynomial

__all__ = ["ZmpPlanner", "ZmpPlannerError"]

Curve = ExponentialPlusPiecewisePolynomial

_MOST_STIFF = 1e6
"""Of sqrt(Qy / R) times height / gravity, and its inverse: beyond, a mode loses six digits."""

_SYMMETRIC = 1e-12
"""Relative: entries of a weight that are so near are equal."""

_NODES = 16
"""Of Gauss-Legendre quadrature, in panels of the modes' time constant: 1e-16 of the integral."""


class ZmpPlannerError(SceneGraphError, ValueError):
    """Weights, states and curves that make no sense, and questions before there is a plan."""


@dataclass(frozen=True, eq=False)
class _Plan:
    """All that was planned, in the plane's axes; feedback and value function when asked for.

    ``axes`` are T, which makes the weights diagonal, and its inverse; ``beta`` and ``s2`` are the
    modes and polynomials ``(2, p, degree + 1, 2)`` of the value function's gradient along them.
    """

    zmp: PiecewisePolynomial
    d: float
    Qy: NDArray[np.float64]
    R: NDArray[np.float64]
    com: Curve
    best: PendulumOptimum
    axes: NDArray[np.float64]
    beta: NDArray[np.complex128]
    s2: NDArray[np.float64]

    def is_weighted_by(self, Qy: NDArray[np.float64], R: NDArray[np.float64]) -> bool:
        """Tell whether these are the weights."""
        return self.Qy.tobytes() == Qy.tobytes() and self.R.tobytes() == R.tobytes()

    @property
    def inverse(self) -> NDArray[np.float64]:
        """That of T, ``(2, 2)``."""
        return self.axes[1]

    @cached_property
    def K(self) -> NDArray[np.float64]:
        """The feedback's gain ``(2, 4)``."""
        gains = (self.axes[0] @ (gain[:, None] * self.inverse) for gain in self.best.gains)
        return np.concatenate(list(gains), axis=1)

    @cached_property
    def Vxx(self) -> NDArray[np.float64]:
        """The value function's second-order term ``(4, 4)``."""
        S, inverse = self.best.S, self.inverse
        blocks = [[inverse.T @ (S[i, j][:, None] * inverse) for j in range(2)] for i in range(2)]
        return np.block(blocks)

    @cached_property
    def Vx(self) -> Curve:
        """Its first-order term: s2 belongs to gradients, which the inverse of T turns."""
        p, inverse = self.best.rates, self.inverse
        slopes = np.concatenate(
            [(2.0 * w * self.beta)[:, :, None] * inverse for w in (self.best.gains[0], p)], 2
        )
        polynomials = np.concatenate(self.s2 @ inverse, axis=2)
        return Curve(p, slopes, PiecewisePolynomial(self.zmp.breaks, polynomials))


@one_line()
class ZmpPlanner:
    """Plans how the centre of mass moves so that the zero-moment point follows a given one.

    The robot is a linear inverted pendulum of constant height z: the zero-moment point, which is
    the centre of pressure on flat ground, is ``y = c - z / g * c''`` in the plane. The state is
    ``x = [c; c']`` ``(4,)`` in m and m/s, the control ``u = c''`` ``(2,)``. The cost is the
    integral of ``(y - y_d)' Qy (y - y_d) + u' R u`` until the end of ``y_d`` and, from there on,
    the optimal cost to go: ``xbar' Vxx xbar`` with ``xbar = [c - y_d(t_f); c']``.

    The value function is ``xbar' Vxx xbar + xbar' Vx(t) + V0(t)``. All of it is in closed form
    (Tedrake, Kuindersma, Deits and Miura, Humanoids 2015), so planning takes as long for a long
    segment as for a short one. Questions before `plan` raise ZmpPlannerError.
    """

    def __init__(self) -> None:
        self._planned: _Plan | None = None

    def plan(
        self,
        zmp_d: Any,
        x0: ArrayLike,
        height: float,
        gravity: float = 9.81,
        Qy: ArrayLike | None = None,
        R: ArrayLike | None = None,
    ) -> None:
        """Plan from the state ``x0`` ``(4,)`` after the desired zero-moment point ``zmp_d``.

        ``zmp_d`` is a `PiecewisePolynomial` of two rows, m over s, or a curve that can become one;
        it may jump. ``height`` is that of the centre of mass above the ground, m, ``gravity`` in
        m/s^2. ``Qy`` and ``R`` ``(2, 2)`` are symmetric and positive definite; the defaults are
        the identity and a tenth of it. Raises ZmpPlannerError, or TrajectoryError for numbers that
        are none.
        """
        zmp = _as_zmp(zmp_d)
        d = as_positive("height", height) / as_positive("gravity", gravity)
        start = _as_vector("x0", x0, 4)
        weights = (
            _as_weight("Qy", np.eye(2) if Qy is None else Qy),
            _as_weight("R", 0.1 * np.eye(2) if R is None else R),
        )
        self._planned = _planned(zmp, start, d, *weights, self._planned)

    def has_planned(self) -> bool:
        """Tell whether `plan` has been called, and did not raise."""
        return self._planned is not None

    def _plan_or_error(self) -> _Plan:
        if self._planned is None:
            raise ZmpPlannerError("nothing is planned yet: call plan() first")
        return self._planned

    # The pendulum.

    def get_A(self) -> NDArray[np.float64]:
        """Return A ``(4, 4)`` of ``x' = A x + B u``."""
        self._plan_or_error()
        return np.eye(4, k=2)

    def get_B(self) -> NDArray[np.float64]:
        """Return B ``(4, 2)`` of ``x' = A x + B u``."""
        self._plan_or_error()
        return np.eye(4, 2, k=-2)

    def get_C(self) -> NDArray[np.float64]:
        """Return C ``(2, 4)`` of ``y = C x + D u``."""
        self._plan_or_error()
        return np.eye(2, 4)

    def get_D(self) -> NDArray[np.float64]:
        """Return D ``(2, 2)`` of ``y = C x + D u``: minus height by gravity, s^2."""
        return -self._plan_or_error().d * np.eye(2)

    def get_Qy(self) -> NDArray[np.float64]:
        """Return the weight ``(2, 2)`` of the zero-moment point."""
        return self._plan_or_error().Qy.copy()

    def get_R(self) -> NDArray[np.float64]:
        """Return the weight ``(2, 2)`` of the control."""
        return self._plan_or_error().R.copy()

    def comdd_to_cop(self, x: ArrayLike, u: ArrayLike) -> NDArray[np.float64]:
        """Return the centre of pressure ``(2,)`` of a state ``(4,)`` and acceleration ``(2,)``."""
        d = self._plan_or_error().d
        return _as_vector("x", x, 4)[:2] - d * _as_vector("u", u, 2)

    # What was asked.

    @overload
    def get_desired_zmp(self) -> PiecewisePolynomial: ...
    @overload
    def get_desired_zmp(self, time: float) -> NDArray[np.float64]: ...
    def get_desired_zmp(
        self, time: float | None = None
    ) -> PiecewisePolynomial | NDArray[np.float64]:
        """Return the desired zero-moment point, as a curve or ``(2,)`` at a time."""
        return _at(self._plan_or_error().zmp, time)

    def get_final_desired_zmp(self) -> NDArray[np.float64]:
        """Return the end of the desired zero-moment point, ``(2,)``."""
        return self._plan_or_error().zmp.control_points[-1, -1].copy()

    # What is best.

    def compute_optimal_comdd(self, time: float, x: ArrayLike) -> NDArray[np.float64]:
        """Return the best acceleration ``(2,)`` at a time and in any state ``(4,)``.

        ``-K xbar + u0(t)``: after the end it is a regulator about the last zero-moment point.
        """
        plan = self._plan_or_error()
        t = as_finite("time", time)
        xbar = self._xbar(x)
        zmp = plan.zmp.value(t) - self.get_final_desired_zmp()
        pull = 0.5 * plan.Vx.value(t)[2:] + plan.d * (plan.Qy @ zmp)
        weight = plan.R + plan.d**2 * plan.Qy
        return -plan.K @ xbar - np.linalg.solve(weight, pull)

    compute_optimal_co_mdd = compute_optimal_comdd

    def compute_optimal_cost(self, time: float, x: ArrayLike) -> float:
        """Return the value function: the cost to go at a time and in a state ``(4,)``."""
        plan, xbar = self._plan_or_error(), self._xbar(x)
        t = as_finite("time", time)
        quadratic = xbar @ plan.Vxx @ xbar + xbar @ plan.Vx.value(t)
        return float(quadratic) + _cost_at_rest(plan, self.get_final_desired_zmp(), t)

    def _xbar(self, x: ArrayLike) -> NDArray[np.float64]:
        xbar = _as_vector("x", x, 4).copy()
        xbar[:2] -= self.get_final_desired_zmp()
        return xbar

    @overload
    def get_nominal_com(self) -> Curve: ...
    @overload
    def get_nominal_com(self, time: float) -> NDArray[np.float64]: ...
    def get_nominal_com(self, time: float | None = None) -> Curve | NDArray[np.float64]:
        """Return the best motion from ``x0`` on, m, as a curve or ``(2,)`` at a time.

        The curve is until the end of the desired zero-moment point. After it the regulator about
        its last point goes on, at times that are asked about: position, velocity and acceleration.
        """
        return self._nominal(0, time)

    @overload
    def get_nominal_comd(self) -> Curve: ...
    @overload
    def get_nominal_comd(self, time: float) -> NDArray[np.float64]: ...
    def get_nominal_comd(self, time: float | None = None) -> Curve | NDArray[np.float64]:
        """Return its velocity, m/s, as a curve or ``(2,)`` at a time."""
        return self._nominal(1, time)

    @overload
    def get_nominal_comdd(self) -> Curve: ...
    @overload
    def get_nominal_comdd(self, time: float) -> NDArray[np.float64]: ...
    def get_nominal_comdd(self, time: float | None = None) -> Curve | NDArray[np.float64]:
        """Return its acceleration, m/s^2, as a curve or ``(2,)`` at a time."""
        return self._nominal(2, time)

    def _nominal(self, order: int, time: float | None) -> Any:
        plan = self._plan_or_error()
        curve, end = plan.com.derivative(order), plan.zmp.end_time
        if time is None or as_finite("time", time) <= end:
            return _at(curve, time)
        ends = [plan.com.derivative(k).value(end) for k in (0, 1)]
        final = self.get_final_desired_zmp()
        state = np.array([ends[0] - final, ends[1]]) @ plan.inverse.T
        along: NDArray[np.float64] = plan.axes[0] @ plan.best.regulated(state, time - end)[order]
        return along + final if order == 0 else along

    def get_Vxx(self) -> NDArray[np.float64]:
        """Return the second-order term ``(4, 4)`` of the value function, the same at all times."""
        return self._plan_or_error().Vxx.copy()

    @overload
    def get_Vx(self) -> Curve: ...
    @overload
    def get_Vx(self, time: float) -> NDArray[np.float64]: ...
    def get_Vx(self, time: float | None = None) -> Curve | NDArray[np.float64]:
        """Return the first-order term of the value function, as a curve or ``(4,)`` at a time."""
        return _at(self._plan_or_error().Vx, time)


def _planned(
    zmp: PiecewisePolynomial,
    x0: NDArray[np.float64],
    d: float,
    Qy: NDArray[np.float64],
    R: NDArray[np.float64],
    before: _Plan | None,
) -> _Plan:
    """Return the plan: weights made diagonal, each axis by itself, and back.

    The part that depends on weights and height alone is that of the plan ``before``, if these are
    the same.
    """
    if before is not None and before.d == d and before.is_weighted_by(Qy, R):
        axes, best = before.axes, before.best
    else:
        axes, best = _axes(d, Qy, R)
    found = best.motion(axes, zmp.control_points, np.diff(zmp.breaks), x0)
    com = Curve(best.both_rates, found.modes, PiecewisePolynomial(zmp.breaks, found.com))
    return _Plan(zmp, d, Qy, R, com, best, axes, found.beta, found.s2)


def _axes(
    d: float, Qy: NDArray[np.float64], R: NDArray[np.float64]
) -> tuple[NDArray[np.float64], PendulumOptimum]:
    """Return T and its inverse, and the optimum along each axis. Raises ZmpPlannerError."""
    # T' R T = 1 and T' Qy T = mu: then the axes of T^-1 c have nothing to do with each other.
    half = np.linalg.inv(np.linalg.cholesky(R))
    mu, turn = np.linalg.eigh(half @ Qy @ half.T)
    T = half.T @ turn
    stiffness = np.sqrt(mu) * d
    if not (stiffness < _MOST_STIFF).all() or not (stiffness * _MOST_STIFF > 1.0).all():
        raise ZmpPlannerError(
            "Qy and R differ too much for height / gravity: sqrt(Qy / R) * height / gravity must"
            f" be between {1.0 / _MOST_STIFF:g} and {_MOST_STIFF:g}, not {stiffness}"
        )
    return np.array([T, np.linalg.inv(T)]), PendulumOptimum(mu, d)


def _cost_at_rest(plan: _Plan, final: NDArray[np.float64], time: float) -> float:
    """Return V0: the integral from a time on of the terms without the state."""
    breaks = plan.zmp.breaks
    start = min(max(time, breaks[0]), breaks[-1])
    ends = np.concatenate([[start], breaks[breaks > start]])
    nodes, weights = np.polynomial.legendre.leggauss(_NODES)
    fastest = float(abs(plan.Vx.rates).max())
    weight = np.linalg.inv(plan.R + plan.d**2 * plan.Qy)
    total = 0.0
    for low, high in itertools.pairwise(ends):
        panels = np.linspace(low, high, int(np.ceil((high - low) * fastest)) + 1)
        half = 0.5 * np.diff(panels)[:, None]
        t = (panels[:-1, None] + half * (1.0 + nodes)).ravel()
        zmp = plan.zmp.value(t) - final
        pull = 0.5 * plan.Vx.value(t)[:, 2:] + plan.d * zmp @ plan.Qy
        rate = np.einsum("mi,ij,mj->m", zmp, plan.Qy, zmp)
        rate -= np.einsum("mi,ij,mj->m", pull, weight, pull)
        total += float(np.sum(half * weights * rate.reshape(len(half), -1)))
    return total


def _at(curve: Any, time: float | None) -> Any:
    return curve if time is None else curve.value(as_finite("time", time))


def _as_zmp(zmp_d: Any) -> PiecewisePolynomial:
    if not isinstance(zmp_d, PiecewisePolynomial) and hasattr(zmp_d, "piecewise_polynomial"):
        zmp_d = zmp_d.piecewise_polynomial()
    if not isinstance(zmp_d, PiecewisePolynomial) or zmp_d.rows != 2:
        what = f"{zmp_d.rows} rows" if isinstance(zmp_d, PiecewisePolynomial) else quoted(zmp_d)
        raise ZmpPlannerError(
            f"zmp_d must be a PiecewisePolynomial of 2 rows, x and y, not {what}"
        )
    return zmp_d


def _as_vector(name: str, value: ArrayLike, size: int) -> NDArray[np.float64]:
    array = as_numbers(name, value)
    if array.shape != (size,):
        raise ZmpPlannerError(f"{name} must have shape ({size},), not {array.shape}")
    return array


def _as_weight(name: str, value: ArrayLike) -> NDArray[np.float64]:
    """Return a symmetric, positive definite matrix ``(2, 2)``. Raises ZmpPlannerError."""
    matrix = as_numbers(name, value)
    if matrix.shape != (2, 2):
        raise ZmpPlannerError(f"{name} must have shape (2, 2), not {matrix.shape}")
    (a, b), (c, d) = matrix.tolist()
    if abs(b - c) > _SYMMETRIC * max(abs(a), abs(b), abs(c), abs(d)):
        raise ZmpPlannerError(f"{name} must be symmetric, not {matrix.tolist()}")
    side = 0.5 * (b + c)
    # Scaled, so that no product is beyond all numbers, or below.
    size = max(abs(a), abs(d), abs(side)) or 1.0
    if not (a > 0.0 and d > 0.0 and (a / size) * (d / size) > (side / size) ** 2):
        raise ZmpPlannerError(f"{name} must be positive definite, not {matrix.tolist()}")
    matrix[0, 1] = matrix[1, 0] = side
    return matrix
