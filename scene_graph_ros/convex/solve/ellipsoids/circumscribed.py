"""The smallest ellipsoid around points: coordinate ascent with away steps.

Todd and Yildirim, "On Khachiyan's algorithm for the computation of minimum-volume enclosing
ellipsoids", Discrete Applied Mathematics 155, 2007.
"""

from __future__ import annotations

import numpy as np

from scene_graph_ros.geometry.compiled.kernel import kernel

__all__ = ["smallest_around"]

_GAP = 1e-9
"""Of the squared distances over n: where the ascent ends; the volume's logarithm is then within
half of n times it."""

_MOST_STEPS = 200000
"""Steps of the ascent; each costs as much as a product of all points with a vector."""

_AFRESH = 500
"""Steps after which the inverse and the distances are computed anew."""


@kernel
def _ends(u, distances):
    """Return the furthest point, and the nearest that has a weight."""
    far, near = 0, -1
    for i in range(len(u)):
        if distances[i] > distances[far]:
            far = i
        if u[i] > 0.0 and (near < 0 or distances[i] < distances[near]):
            near = i
    return far, near


@kernel
def _ascend(Q, u, inverse, distances, steps, goal):
    """Move weights u ``(m,)`` of lifted points ``Q (m, n + 1)``; return the gap that is left."""
    m, d = Q.shape
    gap = np.inf
    for _ in range(steps):
        far, near = _ends(u, distances)
        above = distances[far] / d - 1.0
        below = 1.0 - distances[near] / d
        gap = max(above, below)
        if gap <= goal:
            return gap
        j = far if above >= below else near
        k = distances[j]
        step = (k - d) / (d * (k - 1.0))
        if above < below:
            step = max(step, -u[j] / (1.0 - u[j])) if k > 1.0 else -u[j] / (1.0 - u[j])
        for i in range(m):
            u[i] *= 1.0 - step
        u[j] += step
        if u[j] < 1e-300:
            u[j] = 0.0
        v = inverse @ Q[j]
        factor = step / (1.0 - step + step * k)
        for a in range(d):
            for b in range(d):
                inverse[a, b] = (inverse[a, b] - factor * v[a] * v[b]) / (1.0 - step)
        for i in range(m):
            along = 0.0
            for a in range(d):
                along += Q[i, a] * v[a]
            distances[i] = (distances[i] - factor * along * along) / (1.0 - step)
    return gap


def smallest_around(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the centre ``(n,)`` and the covariance ``(n, n)`` times n of the optimal weights.

    Of points ``(m, n)`` that span space and are about as wide in all directions. The ellipsoid
    ``(x - c)' S^-1 (x - c) <= 1`` is no larger than the smallest that holds all points, for any
    weights.
    """
    m, n = points.shape
    Q = np.concatenate([points, np.ones((m, 1))], axis=1)
    u = np.full(m, 1.0 / m)
    for _ in range(_MOST_STEPS // _AFRESH):
        inverse = np.linalg.inv(Q.T @ (u[:, None] * Q))
        distances = np.einsum("ij,jk,ik->i", Q, inverse, Q)
        if _ascend(Q, u, inverse, distances, _AFRESH, _GAP) <= _GAP:
            break
    u /= u.sum()
    center = u @ points
    spread = points - center
    return center, n * (spread.T @ (u[:, None] * spread))
