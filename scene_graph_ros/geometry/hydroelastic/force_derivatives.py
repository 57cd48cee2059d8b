"""How the force and the moment of a contact surface change as one body moves.

While M moves, points of the surface move along the normal n at a rate ``k . w``, with the velocity
w of M's points, or the pressure there changes at that rate. By the divergence theorem on the strip
that the surface sweeps (Flanders, "Differentiation under the integral sign", 1973, for moving
surfaces), with no pressure at its rim,

    d/dt integral of p n dA = integral of (k . w) g dA

where g is the gradient of N's pressure and k is n where M is rigid, and ``grad_M / ((grad_M -
grad_N) . n)`` where it is not; where N is rigid, g is n and k is ``-grad_M``. Gradients are
constant on each face, so the integrals are exact sums.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.spatial.sums import product

__all__ = ["force_derivatives"]

FloatArray = NDArray[np.float64]


def force_derivatives(
    polygons: Iterable[tuple[FloatArray, FloatArray]],
    normals: FloatArray,
    gradients: tuple[FloatArray | None, FloatArray | None],
    p_WP: FloatArray,
) -> FloatArray:
    """Return the derivatives ``(6, 6)`` of [moment about P; force] on M by M's twist at P.

    ``polygons`` are corners ``(k, 3)`` and pressures ``(k,)`` of each face, whose normals
    ``(f, 3)`` lead into M; ``gradients`` are those of M's and N's pressures ``(f, 3)``, None of a
    rigid body.
    """
    result = np.zeros((6, 6))
    grad_M, grad_N = gradients
    for i, (corners, pressures) in enumerate(polygons):
        n = normals[i]
        if grad_N is None:
            assert grad_M is not None  # as one of both is compliant
            g, k = n, -grad_M[i]
        else:
            g = grad_N[i]
            k = n if grad_M is None else grad_M[i] / float(product(grad_M[i] - g, n))
        pressed = _where_positive(corners - p_WP, pressures)
        if len(pressed) < 3:
            continue
        area, first, second = _moments(pressed)
        cross_g, cross_k = _cross(g), _cross(k)
        # r x g is -cross(g) r, and k . (omega x r) is omega . (r x k).
        result[:3, :3] += product(product(cross_g, second), cross_k.T)
        result[:3, 3:] += np.outer(np.cross(first, g), k)
        result[3:, :3] += np.outer(g, np.cross(first, k))
        result[3:, 3:] += area * np.outer(g, k)
    return result


def _where_positive(corners: FloatArray, pressures: FloatArray) -> FloatArray:
    """Return the corners of the part of a polygon where the pressure, linear, is positive."""
    if (pressures >= 0.0).all():
        return corners
    kept = []
    for a, b, p, q in zip(
        corners, np.roll(corners, -1, axis=0), pressures, np.roll(pressures, -1), strict=True
    ):
        if p >= 0.0:
            kept.append(a)
        if (p < 0.0) != (q < 0.0):
            kept.append(a + p / (p - q) * (b - a))
    return np.array(kept).reshape(-1, 3)


def _moments(corners: FloatArray) -> tuple[float, FloatArray, FloatArray]:
    """Return a convex polygon's area, and the integrals of r ``(3,)`` and r r' ``(3, 3)``."""
    a, b, c = corners[:1], corners[1:-1], corners[2:]
    areas = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
    total = a + b + c
    first = product(areas, total) / 3.0
    # Of a triangle the integral of r r' is its area by 12 times (sum of own squares and of all).
    second = np.einsum("m,mi,mj->ij", areas, total, total) + areas.sum() * np.outer(a[0], a[0])
    second += np.einsum("m,mi,mj->ij", areas, b, b) + np.einsum("m,mi,mj->ij", areas, c, c)
    return float(areas.sum()), first, second / 12.0


def _cross(v: FloatArray) -> FloatArray:
    x, y, z = v.tolist()
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
