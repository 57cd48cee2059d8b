"""Rows in cones: their distances outside, weights that are never negative.

Weights z of rows are in the dual of a cone where ``z . rows`` is at least 0 for all rows in it.
Those of a solver are so to its rounding; `into_dual` makes them so for sure, with the rounding of
floats counted in. Of a symmetric matrix the rows are its upper triangle, column after column.
"""

from __future__ import annotations

import math

import numpy as np

from scene_graph_ros.convex.questions.conic_program import matrix_of
from scene_graph_ros.convex.solve.cones.blocks import upper_triangle
from scene_graph_ros.convex.solve.cones.cone_program import Cone
from scene_graph_ros.geometry.tolerances import EPSILON

__all__ = ["into_dual", "kept_by", "outside"]

_LARGEST_POWER = 600.0
"""Of e, in weights: beyond it the other weight is moved."""


def outside(cone: Cone, rows: np.ndarray) -> float:
    """Return estimates of rows' distances to a cone, in their own units; 0 inside."""
    if cone is Cone.SECOND_ORDER:
        return max(0.0, float(np.linalg.norm(rows[1:])) - float(rows[0]))
    if cone is Cone.SEMIDEFINITE:
        return max(0.0, -float(np.linalg.eigvalsh(matrix_of(rows))[0]))
    u, v, w = rows.tolist()
    if v <= 0.0:
        return max(-v, u, -w, 0.0)
    above = v * math.exp(min(u / v, 700.0)) - w
    # Where it is steep, along u instead.
    along = u - v * math.log(w / v) if w > 0.0 else math.inf
    return max(0.0, min(above, along))


def kept_by(cone: Cone, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return values ``(k,)`` that are at least 0 in a cone and their slopes ``(k, m)`` by rows."""
    if cone is Cone.SECOND_ORDER:
        length = rows[0] * rows[0] - rows[1:] @ rows[1:]
        first = np.eye(len(rows))[0]
        slope = 2.0 * np.append(rows[0], -rows[1:])
        return np.array([length, rows[0]]), np.stack([slope, first])
    if cone is Cone.SEMIDEFINITE:
        values, axes = np.linalg.eigh(matrix_of(rows))
        i, j = upper_triangle(len(values))
        twice = np.where(i == j, 1.0, 2.0)[:, None]
        return values, (twice * axes[i] * axes[j]).T
    u, v, w = rows.tolist()
    power = min(u / v, _LARGEST_POWER) if v > 0.0 else 0.0
    e = math.exp(power) if v > 0.0 else 0.0
    return (
        np.array([w - v * e, v]),
        np.array([[-e, -e * (1.0 - power), 1.0], [0.0, 1.0, 0.0]]),
    )


def into_dual(cone: Cone, z: np.ndarray) -> np.ndarray:
    """Return weights near given ones ``(m,)`` that are in a cone's dual for sure."""
    if cone is Cone.SECOND_ORDER:
        length = float(np.linalg.norm(z[1:])) * (1.0 + 4.0 * len(z) * EPSILON)
        return np.append(max(float(z[0]), length), z[1:])
    if cone is Cone.SEMIDEFINITE:
        return _semidefinite(z)
    return _dual_exponential(*z.tolist())


def _semidefinite(z: np.ndarray) -> np.ndarray:
    """Return weights whose matrix, with half of those beside the diagonal, is semidefinite."""
    order = math.isqrt(2 * len(z))
    i, j = upper_triangle(order)
    is_diagonal = i == j
    matrix = matrix_of(np.where(is_diagonal, z, 0.5 * z))
    least = float(np.linalg.eigvalsh(matrix)[0])
    rounding = 16.0 * order * EPSILON * float(np.linalg.norm(matrix))
    return np.where(is_diagonal, z + max(0.0, rounding - least), z)


def _dual_exponential(u: float, v: float, w: float) -> np.ndarray:
    """Return (u, v, w) with ``w >= -u exp(v / u - 1)`` and u < 0, or u = 0 and v, w >= 0.

    These weigh (x, y, z) with ``y exp(x / y) <= z`` (Chandrasekaran and Shah, "Relative entropy
    optimization and its applications", 2017, section 2).
    """
    if u >= 0.0:
        return np.array([0.0, max(v, 0.0), max(w, 0.0)])
    if w > 0.0:
        # Either may make up for what is missing: the one that has to less.
        power = math.log(w) - math.log(-u) + 1.0
        size = 1.0 + abs(math.log(w)) + abs(math.log(-u))
        needed = u * power + 8.0 * EPSILON * size * -u
        if needed <= v or needed - v <= abs(v) + w or v / u - 1.0 > _LARGEST_POWER:
            return np.array([u, max(v, needed), w])
    power = v / u - 1.0
    if power > _LARGEST_POWER:
        v, power = u * (_LARGEST_POWER + 1.0), _LARGEST_POWER
    height = -u * math.exp(power) * (1.0 + 8.0 * EPSILON * (2.0 + abs(power)))
    return np.array([u, v, max(w, height)])
