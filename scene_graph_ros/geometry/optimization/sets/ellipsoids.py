"""The largest ellipsoid in a polyhedron and the smallest around points, with their bounds."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from scene_graph_ros.geometry.optimization.errors import ConvexSetError, SolverError
from scene_graph_ros.geometry.optimization.solve.circumscribed import smallest_around
from scene_graph_ros.geometry.optimization.solve.doubled import exact_residual
from scene_graph_ros.geometry.optimization.solve.feasibility import find_deepest
from scene_graph_ros.geometry.optimization.solve.inscribed import largest_inscribed
from scene_graph_ros.geometry.optimization.solve.rows import Rows
from scene_graph_ros.geometry.tolerances import EPSILON

__all__ = ["Extremal", "circumscribed", "inscribed"]

_PROMISED = {"inscribed": 1e-9, "circumscribed": 1e-7}
"""Of the logarithm of the volume: a larger gap is an error."""

_MOST_PASSES = 3
"""Passes of the program, each in the coordinates in which the answer before was a ball."""


_THIN = 1e-3
"""Of the least to the largest spread of a set's furthest points within its box."""


class Extremal(NamedTuple):
    """An ellipsoid ``{B u + center}``; no better one has a log volume better by more than gap."""

    B: np.ndarray
    center: np.ndarray
    gap: float


def inscribed(polyhedron: Any, enough: float = 0.0) -> Extremal:
    """Return the largest ellipsoid in a bounded polyhedron, inside without tolerance.

    A log volume known to ``enough`` will do: many rows that nearly touch the ellipsoid cost
    digits. The program is solved in coordinates in which the box around the set is a cube, and
    where the gap is not small yet once more in those in which the answer is a ball.
    """
    label = "HPolyhedron.maximum_volume_inscribed_ellipsoid"
    if polyhedron.is_empty() or not polyhedron.is_bounded():
        raise ConvexSetError(f"{label}: the set must be bounded and have a point")
    n = polyhedron.ambient_dimension
    if n == 0:
        return Extremal(np.zeros((0, 0)), np.zeros(0), 0.0)
    named = np.linalg.norm(polyhedron.A, axis=1) > 0.0
    A, b = polyhedron.A[named], polyhedron.b[named]
    middle, B, widths = _frame(polyhedron, A, b)
    # The deepest point in coordinates in which the set is as wide along all axes.
    cube = find_deepest(Rows(A @ B, b - A @ middle))
    center, best = middle + B @ cube.x, None
    for _ in range(_MOST_PASSES):
        slack = b - A @ center
        if not ((slack > 0.0).all() and (widths > 0.0).all()):
            raise ConvexSetError(
                f"{label}: the set is flat; work in the coordinates of its AffineSubspace"
            )
        try:
            x, E, weights = largest_inscribed((A @ B) / slack[:, None])
            center, B = center + B @ x, B @ E
            found = _put_inside(A, b, center, B, weights / slack)
        except np.linalg.LinAlgError as error:
            raise SolverError(
                f"{label}: the set is too thin for its size to tell how wide it is ({error}); work"
                " in the coordinates of its AffineSubspace"
            ) from error
        best = found if best is None or found.gap < best.gap else best
        if best.gap <= max(enough, 0.01 * _PROMISED["inscribed"]):
            break
    assert best is not None
    if not best.gap <= max(enough, _PROMISED["inscribed"] * (1.0 + n)):
        raise SolverError(
            f"{label}: the log volume is known to {best.gap:.1e} only; reduce_inequalities() first"
        )
    return best


def _frame(polyhedron: Any, A: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, ...]:
    """Return a middle ``(n,)``, a map ``(n, n)`` from a cube about a set, the cube's half widths.

    The box along the axes, or where the set is thin across it, a box along the axes in which the
    furthest points of that one, made a cube, are spread.
    """
    n = A.shape[1]
    reached = [polyhedron.support(sign * e) for e in np.eye(n) for sign in (-1.0, 1.0)]
    values = np.array([each.value for each in reached]).reshape(n, 2)
    middle, widths = 0.5 * (values[:, 1] - values[:, 0]), 0.5 * values.sum(axis=1)
    if not (widths > 0.0).all():
        return middle, np.diag(widths), widths
    spread = (np.array([each.point for each in reached]) - middle) / widths
    _, lengths, axes = np.linalg.svd(spread)
    if lengths[-1] > _THIN * lengths[0]:
        return middle, np.diag(widths), widths
    cube = type(polyhedron)(A * widths, b - A @ middle)
    ends = np.array([[sign * cube.support(sign * v).value for sign in (-1, 1)] for v in axes])
    half = 0.5 * (ends[:, 1] - ends[:, 0])
    turned = widths[:, None] * axes.T
    return middle + turned @ ends.mean(axis=1), turned * half, half


def _put_inside(
    A: np.ndarray, b: np.ndarray, center: np.ndarray, B: np.ndarray, y: np.ndarray
) -> Extremal:
    """Shrink an ellipsoid to be inside, and bound the largest one.

    Multipliers y with ``sum y a = 0`` give ``sum y |B' a| <= sum y slack``. With unit vectors
    v along ``B' a`` and ``M = sum y (B' a) v'``, a map F after B has ``trace(F M)`` at most that,
    and ``det(F)^(1/n) <= trace(F M) / (n det(M)^(1/n))``.
    """
    n = len(center)
    slack = np.array([exact_residual(row, center, side) for row, side in zip(A, b, strict=True)])
    reach = np.linalg.norm(A @ B, axis=1)
    # Where columns are long beside the reach, their products cancel.
    cancelled = 0.501 * n * EPSILON * np.linalg.norm(np.abs(A) @ np.abs(B), axis=1)
    shrink = float((slack / (reach + cancelled)).min()) * (1.0 - 16.0 * (n + 1) * EPSILON)
    rows = A @ B
    for _ in range(2):
        # The least change of weights, relative to them, that balances the rows.
        tilt = np.linalg.solve(rows.T @ (y[:, None] * rows), rows.T @ y)
        y = y * np.maximum(0.0, 1.0 - rows @ tilt)
    M = rows.T @ ((y / reach)[:, None] * rows)
    # What is left of sum y a moves the bound by no more than this over the set, which is within n
    # times the ellipsoid (John 1948), here taken twice.
    left = float(np.linalg.norm(y @ rows)) * 2.0 * n
    bound = float(y @ np.abs(slack)) + left
    upper = n * np.log(bound / n) - np.linalg.slogdet(M)[1]
    gap = float(upper - n * np.log(shrink)) if shrink > 0.0 else np.inf
    return Extremal(shrink * B, center, max(gap, 0.0))


def circumscribed(points: np.ndarray, rank_tol: float, label: str) -> tuple[Extremal, int]:
    """Return the smallest ellipsoid around points ``(m, n)`` in their affine hull, and its rank.

    Directions with singular values below ``rank_tol`` times the largest don't count. All points
    that span what counts are inside without tolerance.
    """
    if not len(points):
        raise ConvexSetError(f"{label}: points must have at least one row")
    n = points.shape[1]
    origin = points[0]
    spread = points - origin
    middle = spread.mean(axis=0)
    _, values, axes = np.linalg.svd(spread - middle, full_matrices=False)
    kept = values > rank_tol * values.max(initial=0.0)
    k = int(kept.sum())
    if k == 0:
        return Extremal(np.zeros((n, n)), origin.copy(), 0.0), 0
    frame = axes[kept].T * (values[kept] / np.sqrt(len(points)))
    local = np.linalg.lstsq(frame, (spread - middle).T)[0].T
    center, square = smallest_around(local)
    root = np.linalg.cholesky(square)
    reached = float(np.linalg.norm(np.linalg.solve(root, (local - center).T), axis=0).max())
    gap = k * float(np.log(max(reached, 1.0)))
    if gap > _PROMISED["circumscribed"] * k:
        raise SolverError(f"{label}: the log volume is known to {gap:.1e} only")
    middle = origin + (middle + frame @ center)
    B = np.zeros((n, n))
    B[:, :k] = frame @ root
    # In the points' own numbers, which rounding moved: none may be left outside.
    far = np.linalg.lstsq(B[:, :k], (points - middle).T)[0]
    grow = float(np.linalg.norm(far, axis=0).max()) * (1.0 + 16.0 * n * EPSILON)
    return Extremal(B * grow, middle, gap + k * abs(np.log(grow / reached))), k
