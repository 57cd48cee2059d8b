"""The optimal motion of a linear inverted pendulum after a zero-moment point, in closed form.

Per axis the state is (c, c'), the control u = c'', and the zero-moment point y = c - d u, with
d = height / gravity. The cost is the integral of ``mu (y - eta(t))**2 + u**2`` and, in the end,
what is best from there on for ever. R. Tedrake, S. Kuindersma, R. Deits and K. Miura, "A
closed-form solution for real-time ZMP gait generation and feedback stabilization", Humanoids 2015,
solve this with matrix exponentials. Here each axis is one complex mode: the closed loop's poles
are -p and its conjugate, where ``(1 + mu d**2) p**4 - 2 mu d p**2 + mu = 0``.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
import itertools
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["PendulumOptimum"]


@dataclass(frozen=True, eq=False)
class PendulumOptimum:
    """What is best per axis, for weights ``mu`` ``(m,)`` of the zero-moment point; ``d`` in s^2.

    The value function is ``x' S x + x' s2(t) + s3(t)`` and the control ``-K x + u0(t)``.
    """

    mu: NDArray[np.float64]
    d: float

    @cached_property
    def control_weight(self) -> NDArray[np.float64]:
        """What a squared control costs at once, ``(m,)``."""
        return 1.0 + self.mu * self.d**2

    @cached_property
    def rates(self) -> NDArray[np.complex128]:
        """The modes p ``(m,)``, 1/s: the state fades by exp(-p t), s2 grows by exp(p t)."""
        root = np.sqrt(self.mu)
        size = np.sqrt(root / np.sqrt(self.control_weight))
        half = 0.5 * np.arctan2(1.0, root * self.d)
        return size * np.exp(1j * half)

    @cached_property
    def gains(self) -> NDArray[np.float64]:
        """K ``(2, m)``: of the position and of the velocity, from the poles."""
        p = self.rates
        return np.array([(p * p.conj()).real, 2.0 * p.real])

    @property
    def S(self) -> NDArray[np.float64]:
        """The solution ``(2, 2, m)`` of the algebraic Riccati equation, entry by entry."""
        first, second = self.gains
        weight = self.control_weight
        cross = first * weight + self.d * self.mu
        return np.array([[first * second * weight, cross], [cross, second * weight]])

    def polynomials(
        self, eta: NDArray[np.float64], widths: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the polynomial parts of s2 and of the state, ``(2, p, degree + 1, m)`` each.

        ``eta`` ``(p, degree + 1, m)`` are Bézier points. Both are series in the derivative D,
        which end as polynomials do.
        """
        count, mu, d = eta.shape[1], self.mu, self.d
        first, second = self.gains
        zero = np.zeros_like(mu)
        along, across = 2.0 * mu * (1.0 + first * d), 2.0 * mu * second * d
        derivatives = [eta]
        for _ in range(count - 1):
            derivatives.append(_differentiated(derivatives[-1]) / widths[:, None, None])
        stacked = np.array(derivatives)

        def series(above: list[Any], below: list[Any]) -> NDArray[np.float64]:
            """Return the quotient of two polynomials of D, applied to eta."""
            return np.einsum("kpdm,km->pdm", stacked, _power_series(above, below, count))

        below = [first, -second, zero + 1.0]
        s2b = series([-along, across], below)
        # s2a = (K2 - D) s2b + B2b eta, with the denominator of s2b.
        s2a = series([across * first - along * second, along], below)
        motion = [mu, zero, -2.0 * mu * d, zero, self.control_weight]
        position = series([mu, zero, -mu * d], motion)
        velocity = series([zero, mu, zero, -mu * d], motion)
        return np.array([s2a, s2b]), np.array([position, velocity])

    def growing_modes(
        self, s2: NDArray[np.float64], widths: NDArray[np.float64]
    ) -> NDArray[np.complex128]:
        """Return the coefficient ``(p, m)`` of s2's mode at each segment's end.

        s2 is ``2 Re((K1, p) beta exp(p (t - end)))`` and the polynomial ``s2``; it is zero in the
        end, and has no jumps.
        """
        p, first = self.rates, self.gains[0]
        ends = s2[:, :, -1]
        after = np.concatenate([s2[:, 1:, 0], np.zeros_like(s2[:, :1, 0])], axis=1)
        jump = after - ends
        # The left eigenvector of s2's equation is (1, -p), the right one (K1, p).
        steps = (jump[0] - p * jump[1]) / (first - p * p)
        fades = np.exp(-p * widths[:, None])
        return _recursion(steps[::-1], np.roll(fades[::-1], 1, axis=0))[::-1]

    @property
    def carried(self) -> NDArray[np.complex128]:
        """How the state ``(2, m)`` follows the mode of s2 of coefficient 1."""
        p = self.rates
        position = -1.0 / (8.0 * p.real * self.control_weight) + 0j
        return np.array([position, p * position])

    def fading_modes(
        self,
        x0: NDArray[np.float64],
        x: NDArray[np.float64],
        beta: NDArray[np.complex128],
        widths: NDArray[np.float64],
    ) -> NDArray[np.complex128]:
        """Return the coefficient ``(p, m)`` of the state's own mode at each segment's start.

        The state is ``2 Re((1, -p) alpha exp(-p (t - start)))``, ``2 Re(carried beta exp(p (t -
        end)))`` and the polynomial ``x``; it starts at ``x0`` ``(2, m)`` and has no jumps.
        """
        p = self.rates
        fades = np.exp(-p * widths[:, None])
        carried = self.carried[:, None]
        starts = x[:, :, 0] + 2.0 * (carried * (beta * fades)).real
        ends = x[:, :, -1] + 2.0 * (carried * beta).real
        before = np.concatenate([x0[:, None], ends[:, :-1]], axis=1)
        jump = before - starts
        # The left eigenvector of the closed loop is (K2 - p, 1), the right one (1, -p).
        steps = ((p.conj()) * jump[0] + jump[1]) / (-2j * p.imag)
        return _recursion(steps, np.roll(fades, 1, axis=0))


def _recursion(
    steps: NDArray[np.complex128], fades: NDArray[np.complex128]
) -> NDArray[np.complex128]:
    """Return ``a[j] = steps[j] + fades[j] a[j - 1]``, column by column."""
    columns = []
    for step, fade in zip(steps.T.tolist(), fades.T.tolist(), strict=True):
        pairs = zip(step, fade, strict=True)
        columns.append(list(itertools.accumulate(pairs, lambda a, f: f[0] + f[1] * a, initial=0j)))
    return np.array(columns)[:, 1:].T


def _differentiated(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return a derivative's Bézier points, of the same degree and over intervals of width 1."""
    degree = points.shape[1] - 1
    steps = np.diff(points, axis=1)
    result = np.zeros_like(points)
    i = np.arange(degree)[:, None]
    result[:, :-1] = (degree - i) * steps
    result[:, 1:] += (i + 1) * steps
    return result


def _power_series(above: list[Any], below: list[Any], count: int) -> NDArray[np.float64]:
    """Return the first coefficients ``(count, m)`` of the quotient of two power series."""
    result: list[Any] = []
    for k in range(count):
        term = above[k] if k < len(above) else 0.0
        for j in range(1, min(k, len(below) - 1) + 1):
            term = term - below[j] * result[k - j]
        result.append(term / below[0])
    return np.array(result)
