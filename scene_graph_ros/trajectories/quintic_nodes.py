"""Quintics between nodes, by their values and two derivatives there."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["MIDDLES", "NODES_LEFT", "NODES_RIGHT", "jerk_excess"]

MIDDLES = np.array(
    [
        [15.0 / 8.0, -7.0 / 16.0, -7.0 / 16.0, -1.0 / 32.0, 1.0 / 32.0],
        [0.0, -1.5, 1.5, -0.25, -0.25],
        [-30.0, 15.0, 15.0, 1.5, -1.5],
    ]
)
"""Three derivatives in the middle of a quintic on [0, 1]: by the difference of its ends' values,
by the derivatives at both ends, and by the second derivatives."""

NODES_RIGHT = np.array([60.0, -36.0, -24.0, -9.0, 3.0])
"""The third derivative at its start, as above."""

NODES_LEFT = np.array([60.0, -24.0, -36.0, -3.0, 9.0])
"""The third derivative at its end."""


def jerk_excess(
    times: NDArray[np.float64],
    values: NDArray[np.float64],
    rates: NDArray[np.float64],
    accelerations: NDArray[np.float64],
    limits: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Return the largest jerk ``(n,)`` on each quintic between n + 1 nodes, by its limit ``(j,)``.

    ``values`` and their derivatives by time are ``(n + 1, j)``. Jerk is a polynomial of degree 2.
    """
    h = np.diff(times)[:, np.newaxis]
    data = np.stack(
        [
            np.diff(values, axis=0),
            h * rates[:-1],
            h * rates[1:],
            h**2 * accelerations[:-1],
            h**2 * accelerations[1:],
        ]
    )
    begin, middle, end = np.tensordot(np.stack([NODES_RIGHT, MIDDLES[2], NODES_LEFT]), data, 1)
    curved = 2.0 * (begin + end - 2.0 * middle)
    slope = 4.0 * middle - 3.0 * begin - end
    with np.errstate(divide="ignore", invalid="ignore"):
        at = -0.5 * slope / curved
    at = np.where((at > 0.0) & (at < 1.0), at, 0.0)
    between = begin + at * (slope + at * curved)
    largest = np.maximum(np.maximum(np.abs(begin), np.abs(end)), np.abs(between))
    result: NDArray[np.float64] = (largest / (h**3 * limits)).max(axis=1)
    return result
