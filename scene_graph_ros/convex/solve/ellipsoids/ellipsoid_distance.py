"""The nearest point of an ellipsoid along its axes, of any radii, also 0 and infinite."""

from __future__ import annotations

import numpy as np

from scene_graph_ros.geometry.compiled.kernel import kernel

__all__ = ["nearest_on_axes"]

_MOST_STEPS = 200
"""Halvings that take any interval of floats below rounding."""


def nearest_on_axes(radii: np.ndarray, p: np.ndarray) -> np.ndarray:
    """Return the point ``(n,)`` nearest to p of ``sum (y / radii)^2 <= 1``.

    It is ``p r^2 / (r^2 + s)`` for the root s > 0 of ``sum (p r / (r^2 + s))^2 = 1``, found by
    bisection (Eberly, "Distance from a point to an ellipse", 2013).
    """
    flat, free = radii == 0.0, np.isinf(radii)
    inner = ~(flat | free)
    y = np.where(free, p, 0.0)
    q, r = p[inner], radii[inner]
    if not len(q):
        return y
    if np.linalg.norm(q / r) <= 1.0:
        y[inner] = q
        return y
    s = _root(q, r, float(np.linalg.norm(q * r)))
    y[inner] = q * (r * r / (r * r + s))
    return y


@kernel
def _root(q, r, high):
    """Return the root s of ``sum (q r / (r^2 + s))^2 = 1``, from above: it is less at ``high``."""
    low = 0.0
    for _ in range(_MOST_STEPS):
        s = 0.5 * (low + high)
        if s in (low, high):
            break
        total = 0.0
        for k in range(len(q)):
            total += (q[k] * r[k] / (r[k] * r[k] + s)) ** 2
        if total > 1.0:
            low = s
        else:
            high = s
    return high
