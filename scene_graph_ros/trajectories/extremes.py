"""The largest values of curves at all times: proven bounds, not samples."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.trajectories.bernstein import split
from scene_graph_ros.trajectories.piecewise_polynomial import PiecewisePolynomial

__all__ = ["Peak", "largest_ratios"]

_ENOUGH = 1e-12
"""Of a limit, or of the maximum: a bound that is so near to a value that is taken will do."""

_MOST_CUTS = 60
"""Halves of halves of a segment; then its two ends are one number."""


class Peak(NamedTuple):
    """The largest of a curve's entries, each in units of a limit of its own."""

    bounds: NDArray[np.float64]
    """``(n,)``: what each entry's ratio is nowhere above: proven."""
    times: NDArray[np.float64]
    """``(n,)``: where it is so large, to 1e-12 of it or of the limit."""


def largest_ratios(
    curve: PiecewisePolynomial, lower: NDArray[np.float64], upper: NDArray[np.float64]
) -> Peak:
    """Return how far a curve's entries reach between 0 and limits ``(n,)``, at all times.

    The ratio of a value is that to its upper limit, or to its lower one: above 1 it is beyond one
    of them. ``lower`` is negative and ``upper`` positive. A segment's values are in the hull of
    its control points; segments that may hold the largest are cut in halves until that is known.
    """
    points = curve.control_points
    count, n = len(points), curve.rows
    # The maximum of two polynomials is none: each side by itself.
    sides = [(points / limit).transpose(0, 2, 1) for limit in (upper, lower)]
    control = np.concatenate(sides).reshape(2 * count * n, -1)
    entry = np.tile(np.arange(n), 2 * count)
    low = np.tile(np.repeat(curve.breaks[:-1], n), 2)
    high = np.tile(np.repeat(curve.breaks[1:], n), 2)
    best, times, bounds = np.full(n, -np.inf), np.zeros(n), np.full(n, -np.inf)
    for cut in range(_MOST_CUTS + 1):
        for values, at in ((control[:, 0], low), (control[:, -1], high)):
            order = np.argsort(values, kind="stable")
            is_better = values[order] > best[entry[order]]
            chosen = order[is_better]
            best[entry[chosen]], times[entry[chosen]] = values[chosen], at[chosen]
        hulls = control.max(axis=1)
        is_open = hulls > best[entry] + _ENOUGH * np.maximum(best[entry], 1.0)
        if cut == _MOST_CUTS:
            is_open[:] = False
        np.maximum.at(bounds, entry[~is_open], hulls[~is_open])
        if not is_open.any():
            break
        left, right = split(control[is_open], 0.5)
        middle = 0.5 * (low[is_open] + high[is_open])
        low, high = np.concatenate([low[is_open], middle]), np.concatenate([middle, high[is_open]])
        control, entry = np.concatenate([left, right]), np.tile(entry[is_open], 2)
    return Peak(np.maximum(bounds, best), times)
