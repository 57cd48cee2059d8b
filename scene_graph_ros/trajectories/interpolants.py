"""Polynomials between samples: their Bézier points, or the slopes at the samples."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.trajectories.errors import TrajectoryError

__all__ = ["lagrange_points", "monotone_slopes", "smooth_slopes"]

_MOST_SAMPLES = 20
"""Of one polynomial: with more of them rounding between equal distances passes 1e-9."""


def monotone_slopes(
    t: NDArray[np.float64], q: NDArray[np.float64], are_ends_zero: bool
) -> NDArray[np.float64]:
    """Return slopes ``(p + 1, n)`` with which cubics rise and fall as samples ``(p + 1, n)`` do.

    Inside they are harmonic means of both sides', weighted by their widths; at the ends those of
    the parabola through three samples, as far as these allow (Fritsch and Butland, "A method for
    constructing local monotone piecewise cubic interpolants", 1984). Raises TrajectoryError for
    fewer than three samples.
    """
    if len(t) < 3:
        raise TrajectoryError(f"samples must be three or more, not {len(t)}")
    h = np.diff(t)[:, np.newaxis]
    slopes = np.diff(q, axis=0) / h
    before, after, both = slopes[:-1], slopes[1:], h[:-1] + h[1:]
    result = np.zeros(q.shape)
    is_monotone = before * after > 0.0
    weights = (both + h[1:], both + h[:-1])
    with np.errstate(divide="ignore", invalid="ignore"):
        mean = 3.0 * both / (weights[0] / before + weights[1] / after)
    result[1:-1] = np.where(is_monotone, mean, 0.0)
    if not are_ends_zero:
        result[0] = _end_slope(h[0], h[1], slopes[0], slopes[1])
        result[-1] = _end_slope(h[-1], h[-2], slopes[-1], slopes[-2])
    return result


def _end_slope(
    h: NDArray[np.float64],
    beyond: NDArray[np.float64],
    slope: NDArray[np.float64],
    other: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Return the slope at an end, beside whose first piece there is another one."""
    found = ((2.0 * h + beyond) * slope - h * other) / (h + beyond)
    found = np.where(found * slope <= 0.0, 0.0, found)
    is_too_steep = (slope * other <= 0.0) & (np.abs(found) > 3.0 * np.abs(slope))
    return np.asarray(np.where(is_too_steep, 3.0 * slope, found))


def smooth_slopes(
    t: NDArray[np.float64],
    q: NDArray[np.float64],
    ends: tuple[NDArray[np.float64], NDArray[np.float64]] | None,
    is_periodic: bool,
) -> NDArray[np.float64]:
    """Return slopes ``(p + 1, n)`` with which second derivatives of cubics have no jumps.

    ``ends`` are those at both ends ``(n,)``; without, the curve repeats itself, or its first two
    pieces are one cubic, and its last two (de Boor, *A Practical Guide to Splines*, 1978, chapter
    IV). Raises TrajectoryError for too few samples, and for ends that differ where it repeats.
    """
    from scipy.interpolate import CubicSpline

    least = 2 if ends is not None else 3
    if len(t) < least:
        raise TrajectoryError(f"samples must be {least} or more, not {len(t)}")
    kind: object = "not-a-knot"
    if ends is not None:
        kind = ((1, ends[0]), (1, ends[1]))
    elif is_periodic:
        if (q[0] != q[-1]).any():
            raise TrajectoryError(
                f"samples must end as they begin, at {q[0].tolist()}, not at {q[-1].tolist()}"
            )
        kind = "periodic"
    return np.asarray(CubicSpline(t, q, axis=0, bc_type=kind)(t, 1), dtype=np.float64)


def lagrange_points(t: NDArray[np.float64], q: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the Bézier points ``(p + 1, n)`` of the one polynomial through all samples.

    Raises TrajectoryError for more samples than rounding allows.
    """
    if len(t) > _MOST_SAMPLES:
        raise TrajectoryError(
            f"samples must be {_MOST_SAMPLES} at most for one polynomial, not {len(t)}: take"
            " cubics"
        )
    degree = len(t) - 1
    u = (t - t[0]) / (t[-1] - t[0])
    matrix = np.ones((degree + 1, degree + 1))
    choose = 1.0
    for j in range(degree + 1):
        matrix[:, j] = choose * u**j * (1.0 - u) ** (degree - j)
        choose = choose * (degree - j) / (j + 1)
    return np.asarray(np.linalg.solve(matrix, q), dtype=np.float64)
