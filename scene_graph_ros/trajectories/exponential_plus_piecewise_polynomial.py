"""Curves that are exponentials and a polynomial between breaks: motions of linear systems."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.geometry.real_arrays import complex_array
from scene_graph_ros.trajectories.arguments import (
    as_finite,
    as_numbers,
    as_order,
    as_positive,
    as_times,
)
from scene_graph_ros.trajectories.errors import TrajectoryError
from scene_graph_ros.trajectories.piecewise_polynomial import PiecewisePolynomial
from scene_graph_ros.trajectories.segment_lookup import segments_at

__all__ = ["ExponentialPlusPiecewisePolynomial"]

_MAX_CONDITION = 1e10
"""Of eigenvectors: beyond, a matrix counts as one without a basis of them."""


@one_line()
@dataclass(frozen=True, eq=False)
class ExponentialPlusPiecewisePolynomial:
    """A curve in n dimensions: on each of p segments k exponentials and a polynomial.

    On segment j it is ``Re(sum_k coefficients[j, k] exp(rates[k] (t - t_k)))`` and the polynomial.
    ``t_k`` is the segment's start for modes that fade (``Re(rates[k]) <= 0``), and its end for
    modes that grow, so no exponential is above 1 however long a segment is. ``rates`` ``(k,)`` and
    ``coefficients`` ``(p, k, n)`` may be complex; ``polynomial`` has the breaks.

    Raises TrajectoryError for other shapes, and for infinities.
    """

    rates: NDArray[Any]
    coefficients: NDArray[Any]
    polynomial: PiecewisePolynomial

    def __post_init__(self) -> None:
        """Check and freeze the arrays."""
        rates = _as_complex("rates", self.rates)
        coefficients = _as_complex("coefficients", self.coefficients)
        shape = (self.polynomial.num_segments, rates.size, self.polynomial.rows)
        if rates.ndim != 1 or coefficients.shape != shape:
            raise TrajectoryError(
                "rates and coefficients must have shapes (k,) and (p, k, n), here"
                f" {(rates.size,)} and {shape}, not {rates.shape} and {coefficients.shape}"
            )
        for name, array in (("rates", rates), ("coefficients", coefficients)):
            array.setflags(write=False)
            object.__setattr__(self, name, array)

    @classmethod
    def of_matrices(
        cls, K: ArrayLike, A: ArrayLike, alpha: ArrayLike, polynomial: PiecewisePolynomial
    ) -> ExponentialPlusPiecewisePolynomial:
        """Return ``K exp(A (t - t_j)) alpha[:, j]`` and the polynomial; t_j is segment j's start.

        ``K`` ``(n, k)``, ``A`` ``(k, k)``, ``alpha`` ``(k, p)``. Raises TrajectoryError for other
        shapes, and where A has no basis of eigenvectors.
        """
        left, matrix, right = as_numbers("K", K), as_numbers("A", A), as_numbers("alpha", alpha)
        k, p = len(matrix), polynomial.num_segments
        for name, array, shape in (
            ("K", left, (polynomial.rows, k)),
            ("A", matrix, (k, k)),
            ("alpha", right, (k, p)),
        ):
            if array.shape != shape:
                raise TrajectoryError(f"{name} must have shape {shape}, not {array.shape}")
        rates, vectors = np.linalg.eig(matrix)
        if k and np.linalg.cond(vectors) > _MAX_CONDITION:
            raise TrajectoryError("A must have a basis of eigenvectors: give it by its modes")
        modes = np.linalg.solve(vectors, right) if k else right
        coefficients = np.einsum("nk,kp->pkn", left @ vectors, modes)
        # Modes that grow are told by their value at the end.
        growth = np.where(rates.real > 0.0, rates, 0.0)
        widths = np.diff(polynomial.breaks)
        coefficients = coefficients * np.exp(widths[:, None] * growth)[:, :, None]
        return cls(rates, coefficients, polynomial)

    # What it is.

    @property
    def start_time(self) -> float:
        """The first break, s."""
        return self.polynomial.start_time

    @property
    def end_time(self) -> float:
        """The last break, s."""
        return self.polynomial.end_time

    @property
    def duration(self) -> float:
        """From the first break to the last, s."""
        return self.polynomial.duration

    @property
    def rows(self) -> int:
        """The dimension n."""
        return self.polynomial.rows

    def value(self, t: ArrayLike) -> NDArray[np.float64]:
        """Return the values ``(m, n)`` at times ``(m,)``, or ``(n,)`` at one time.

        At a break it is that of the later segment; before the start and after the end it is that
        at the start and at the end. Raises TrajectoryError for times that are no numbers.
        """
        times = as_times(t)
        breaks = self.polynomial.breaks
        flat = np.atleast_1d(times).clip(breaks[0], breaks[-1])
        segments = segments_at(breaks, flat)
        since, until = flat - breaks[segments], flat - breaks[segments + 1]
        elapsed = np.where(self._grows, until[:, None], since[:, None])
        modes = np.exp(self.rates * elapsed)
        result = self.polynomial.value(flat)
        result += np.einsum("mk,mkn->mn", modes, self.coefficients[segments]).real
        return result if times.ndim else result[0]

    @property
    def _grows(self) -> NDArray[np.bool_]:
        return self.rates.real > 0.0

    def derivative(self, order: int = 1) -> ExponentialPlusPiecewisePolynomial:
        """Return its derivative of an order from 0 on, segment by segment."""
        times = as_order("order", order)
        return ExponentialPlusPiecewisePolynomial(
            self.rates,
            self.coefficients * self.rates[:, None] ** times,
            self.polynomial.derivative(times),
        )

    # Others made of it.

    def reverse_time(self) -> ExponentialPlusPiecewisePolynomial:
        """Return the reversed curve r with ``r(start_time + end_time - t) = q(t)``."""
        coefficients = self.coefficients[::-1]
        # What neither fades nor grows is told by its value at a segment's start, then as before.
        turns = self.rates.real == 0.0
        widths = np.diff(self.polynomial.breaks)[::-1]
        at_ends = np.exp(widths[:, None] * np.where(turns, self.rates, 0.0))
        return ExponentialPlusPiecewisePolynomial(
            -self.rates, coefficients * at_ends[:, :, None], self.polynomial.reverse_time()
        )

    def scale_time(self, factor: float) -> ExponentialPlusPiecewisePolynomial:
        """Return the slower curve r with ``r(factor * t) = q(t)``; the factor is positive."""
        return ExponentialPlusPiecewisePolynomial(
            self.rates / as_positive("factor", factor),
            self.coefficients,
            self.polynomial.scale_time(factor),
        )

    def shift_right(self, offset: float) -> ExponentialPlusPiecewisePolynomial:
        """Return the curve later by ``offset``."""
        later = self.polynomial.shift_right(as_finite("offset", offset))
        return ExponentialPlusPiecewisePolynomial(self.rates, self.coefficients, later)


def _as_complex(name: str, values: ArrayLike) -> NDArray[np.complex128]:
    """Return an array of finite complex numbers. Raises TrajectoryError."""
    array = complex_array(values, f"{name} must be numbers", TrajectoryError)
    if not np.isfinite(array).all():
        where = tuple(map(int, np.argwhere(~np.isfinite(array))[0]))
        raise TrajectoryError(f"{name}{list(where)} must be finite, not {array[where]}")
    return array
