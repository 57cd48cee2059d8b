"""How the force and the moment of a contact surface change as one body moves.

While M moves, points of the surface move along the normal n at a rate ``k . w``, with the velocity
w of M's points, or the pressure there changes at that rate. By the divergence theorem on the strip
that the surface sweeps (Flanders, "Differentiation under the integral sign", 1973, for moving
surfaces),

    d/dt integral of p n dA = integral of (k . w) g dA + the rim's part

where g is the gradient of N's pressure and k is n where M is rigid, and ``grad_M / ((grad_M -
grad_N) . n)`` where it is not; where N is rigid, g is n and k is ``-grad_M``. Gradients are
constant on each face, so the integrals are exact sums. The rim's part is that of ``rims``.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

__all__ = ["force_derivatives", "normal_rates", "with_moment"]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
Gradients = tuple[FloatArray | None, FloatArray | None]


def normal_rates(normals: FloatArray, gradients: Gradients) -> FloatArray:
    """Return ``k`` of the faces ``(f, 3)``: they move along their normals at a rate ``k . w``.

    ``normals`` ``(f, 3)`` lead into M; ``gradients`` are those of M's and N's pressures
    ``(f, 3)``, None of a rigid body.
    """
    grad_M, grad_N = gradients
    if grad_N is None:
        return np.zeros_like(normals)
    if grad_M is None:
        return normals
    result: FloatArray = grad_M / np.einsum("fi,fi->f", grad_M - grad_N, normals)[:, None]
    return result


def force_derivatives(
    polygons: Sequence[tuple[FloatArray, FloatArray]],
    normals: FloatArray,
    gradients: Gradients,
    rates: FloatArray,
    p_WP: FloatArray,
) -> FloatArray:
    """Return the faces' part ``(6, 6)`` in the derivatives of [moment about P; force] on M.

    They are by M's twist at P. ``polygons`` are corners ``(k, 3)`` and pressures ``(k,)`` of each
    face, ``p_WP`` is ``(3,)``; the others are as in ``normal_rates``, with its answer ``rates``.
    """
    grad_M, grad_N = gradients
    if grad_N is None:
        assert grad_M is not None  # as one of both is compliant
        g, k = normals, -grad_M
    else:
        g, k = grad_N, rates
    triangles, face = _pressed_triangles(polygons)
    r = triangles - p_WP
    areas = 0.5 * np.linalg.norm(np.cross(r[:, 1] - r[:, 0], r[:, 2] - r[:, 0]), axis=1)
    out, by = with_moment(r, g[face][:, None]), with_moment(r, k[face][:, None])
    # Of a triangle the integral of a product of linear functions is its area by 12 times (the sum
    # of products at the corners and the product of the sums).
    result = np.einsum("t,tci,tcj->ij", areas, out, by)
    result += np.einsum("t,ti,tj->ij", areas, out.sum(axis=1), by.sum(axis=1))
    return result / 12.0


def with_moment(r: FloatArray, v: FloatArray) -> FloatArray:
    """Return [r x v; v] ``(..., 6)``; as a row it takes a twist to ``v . (velocity at r)``."""
    moments = np.cross(r, v)
    return np.concatenate([moments, np.broadcast_to(v, moments.shape)], axis=-1)


def _pressed_triangles(
    polygons: Sequence[tuple[FloatArray, FloatArray]],
) -> tuple[FloatArray, IntArray]:
    """Return triangles ``(t, 3, 3)`` of the parts under pressure, and their faces ``(t,)``."""
    parts = [
        corners if pressures.min() >= 0.0 else _where_positive(corners, pressures)
        for corners, pressures in polygons
    ]
    corners, lengths = np.concatenate(parts), np.array([len(part) for part in parts])
    face, ends = np.repeat(np.arange(len(parts)), lengths), np.cumsum(lengths)
    first, row = (ends - lengths)[face], np.arange(len(corners))
    row = row[(row > first) & (row + 1 < ends[face])]
    return np.stack([corners[first[row]], corners[row], corners[row + 1]], axis=1), face[row]


def _where_positive(corners: FloatArray, pressures: FloatArray) -> FloatArray:
    """Return the corners of the part of a polygon where the pressure, linear, is positive."""
    kept = []
    for a, b, p, q in zip(
        corners, np.roll(corners, -1, axis=0), pressures, np.roll(pressures, -1), strict=True
    ):
        if p >= 0.0:
            kept.append(a)
        if (p < 0.0) != (q < 0.0):
            kept.append(a + p / (p - q) * (b - a))
    return np.array(kept).reshape(-1, 3)
