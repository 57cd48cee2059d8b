"""The optimal motion of a linear inverted pendulum after a zero-moment point, in closed form.

Per axis the state is (c, c'), the control u = c'', and the zero-moment point y = c - d u, with
d = height / gravity. The cost is the integral of ``mu (y - eta(t))**2 + u**2`` and, in the end,
the optimal cost from there on for ever. R. Tedrake, S. Kuindersma, R. Deits and K. Miura, "A
closed-form solution for real-time ZMP gait generation and feedback stabilization", Humanoids 2015,
solve this with matrix exponentials. Here each axis is one complex mode: the closed loop's poles
are -p and its conjugate, where ``(1 + mu d**2) p**4 - 2 mu d p**2 + mu = 0``.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.planning.walking.pendulum_kernels import plan_motion

__all__ = ["Motion", "PendulumOptimum"]


class Motion(NamedTuple):
    """The best motion of both axes, and the value function's gradient.

    s2 is ``2 Re((K1, p) beta exp(p (t - end)))`` and the polynomial ``s2``; it is zero in the end,
    and has no jumps. The state of an axis is ``2 Re((1, -p) alpha exp(-p (t - start)))``, ``2
    Re(carried beta exp(p (t - end)))`` and a polynomial; it starts where it is said, and has no
    jumps either. Back in the plane that is ``Re(sum of modes times exponentials)`` and ``com``.
    """

    s2: NDArray[np.float64]
    """``(2, p, degree + 1, 2)``: Bézier points by row of s2, along the axes."""
    beta: NDArray[np.complex128]
    """``(p, 2)``: of s2's mode at each segment's end."""
    modes: NDArray[np.complex128]
    """``(p, 4, 2)``: what fades along both axes, then what grows, in the plane."""
    com: NDArray[np.float64]
    """``(p, degree + 1, 2)``: Bézier points in the plane."""


@dataclass(frozen=True, eq=False)
class PendulumOptimum:
    """The optimum per axis, for weights ``mu`` ``(m,)`` of the zero-moment point; ``d`` in s^2.

    The value function is ``x' S x + x' s2(t) + s3(t)`` and the control ``-K x + u0(t)``.
    """

    mu: NDArray[np.float64]
    d: float

    @cached_property
    def control_weight(self) -> NDArray[np.float64]:
        """The cost of a squared control, ``(m,)``."""
        return 1.0 + self.mu * self.d**2

    @cached_property
    def rates(self) -> NDArray[np.complex128]:
        """The modes p ``(m,)``, 1/s: the state fades by exp(-p t), s2 grows by exp(p t)."""
        root = np.sqrt(self.mu)
        size = np.sqrt(root / np.sqrt(self.control_weight))
        half = 0.5 * np.arctan2(1.0, root * self.d)
        return size * np.exp(1j * half)

    @cached_property
    def both_rates(self) -> NDArray[np.complex128]:
        """-p and p ``(2 m,)``, of the decaying and the growing part."""
        return np.concatenate([-self.rates, self.rates])

    @cached_property
    def gains(self) -> NDArray[np.float64]:
        """K ``(2, m)``: of the position and of the velocity, from the poles."""
        p = self.rates
        return np.array([(p * p.conj()).real, 2.0 * p.real])

    def regulated(self, state: NDArray[np.float64], elapsed: float) -> NDArray[np.float64]:
        """Return position, velocity and acceleration ``(3, m)`` of the closed loop after a time.

        It begins in a state ``(2, m)`` about the origin. With the poles ``-a +- i b`` the position
        is ``exp(-a t) (c cos(b t) + (c' + a c) sin(b t) / b)``.
        """
        a, b = self.rates.real, self.rates.imag
        (c, rate), (first, second) = state, self.gains
        fades = np.exp(-a * elapsed)
        cos, sin = fades * np.cos(b * elapsed), fades * np.sin(b * elapsed) / b
        position = c * cos + (rate + a * c) * sin
        velocity = rate * cos - (first * c + a * rate) * sin
        return np.array([position, velocity, -first * position - second * velocity])

    @property
    def S(self) -> NDArray[np.float64]:
        """The solution ``(2, 2, m)`` of the algebraic Riccati equation, entry by entry."""
        first, second = self.gains
        weight = self.control_weight
        cross = first * weight + self.d * self.mu
        return np.array([[first * second * weight, cross], [cross, second * weight]])

    def series(self, count: int) -> NDArray[np.float64]:
        """Return coefficients ``(4, count, m)``: by orders of the derivative D of eta.

        Of the polynomial parts of both rows of s2, of the position and of the velocity, which are
        series in D; they end as polynomials do.
        """
        if count not in self._series:
            self._series[count] = self._new_series(count)
        return self._series[count]

    @cached_property
    def _series(self) -> dict[int, NDArray[np.float64]]:
        return {}

    def _new_series(self, count: int) -> NDArray[np.float64]:
        mu, d = self.mu, self.d
        first, second = self.gains
        zero = np.zeros_like(mu)
        along, across = 2.0 * mu * (1.0 + first * d), 2.0 * mu * second * d
        gradient = [first, -second, zero + 1.0]
        motion = [mu, zero, -2.0 * mu * d, zero, self.control_weight]
        quotients = (
            # s2a = (K2 - D) s2b + B2b eta, with the denominator of s2b.
            ([across * first - along * second, along], gradient),
            ([-along, across], gradient),
            ([mu, zero, -mu * d], motion),
            ([zero, mu, zero, -mu * d], motion),
        )
        return np.array([_power_series(above, below, count) for above, below in quotients])

    def motion(
        self,
        axes: NDArray[np.float64],
        points: NDArray[np.float64],
        widths: NDArray[np.float64],
        x0: NDArray[np.float64],
    ) -> Motion:
        """Return the best motion after Bézier points ``(p, degree + 1, 2)`` of the plane.

        ``axes`` ``(2, 2, 2)`` are T and its inverse; ``x0`` ``(4,)`` is where it starts.
        """
        segments, count, _ = points.shape
        s2, x = np.empty((2, 2, segments, count, 2))
        beta, alpha = np.empty((2, segments, 2), dtype=np.complex128)
        modes = np.empty((segments, 4, 2), dtype=np.complex128)
        com, derivatives = np.empty((segments, count, 2)), np.empty((count, count))
        optimum = self.rates, self.gains[0], self.carried[0], self.series(count)
        fades, eta = np.empty(segments, dtype=np.complex128), np.empty(count)
        final = points[-1, -1]
        plan_motion(
            axes,
            optimum,
            (points, widths, final, x0),
            (eta, derivatives, fades),
            (s2, x, beta, alpha, modes, com),
        )
        return Motion(s2, beta, modes, com)

    @cached_property
    def carried(self) -> NDArray[np.complex128]:
        """How the state ``(2, m)`` follows the mode of s2 of coefficient 1."""
        p = self.rates
        position = -1.0 / (8.0 * p.real * self.control_weight) + 0j
        return np.array([position, p * position])


def _power_series(above: list[Any], below: list[Any], count: int) -> NDArray[np.float64]:
    """Return the first coefficients ``(count, m)`` of the quotient of two power series."""
    result: list[Any] = []
    for k in range(count):
        term = above[k] if k < len(above) else 0.0
        for j in range(1, min(k, len(below) - 1) + 1):
            term = term - below[j] * result[k - j]
        result.append(term / below[0])
    return np.array(result)
