"""The largest ellipsoid in a polyhedron and the smallest around points, with their bounds."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from scene_graph_ros.convex.errors import ConvexSetError, SolverError
from scene_graph_ros.convex.questions.arguments import frozen
from scene_graph_ros.convex.solve.ellipsoids.bounded_ellipsoid import (
    inscribe,
    OUTSIDE,
    SINGULAR,
)
from scene_graph_ros.convex.solve.ellipsoids.circumscribed import smallest_around
from scene_graph_ros.convex.solve.ellipsoids.cube import cube_quickly
from scene_graph_ros.convex.solve.exact.feasibility import find_deepest
from scene_graph_ros.convex.solve.exact.rows import Rows
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
    flat = f"{label}: the set is flat; work in the coordinates of its AffineSubspace"
    A, b = polyhedron.A, polyhedron.b
    center, widths = np.empty(n), np.empty(n)
    if cube_quickly(A, b, _THIN, np.empty(n), widths, center):
        B = np.diag(widths)
    else:
        named = np.linalg.norm(A, axis=1) > 0.0
        A, b = frozen(A[named]), frozen(b[named])
        middle, B, widths = _frame(polyhedron, A, b)
        if not (widths > 0.0).all():
            raise ConvexSetError(flat)
        # The deepest point in coordinates in which the set is as wide along all axes.
        center = middle + B @ find_deepest(Rows(A @ B, b - A @ middle)).x
    best = None
    for _ in range(_MOST_PASSES):
        status, shrink, gap = inscribe(A, b, center, B, enough)
        if status == OUTSIDE:
            raise ConvexSetError(flat)
        if status == SINGULAR:
            raise SolverError(
                f"{label}: the set is too thin for its size to tell how wide it is; work in the"
                " coordinates of its AffineSubspace"
            )
        if best is None or gap < best.gap:
            best = Extremal(shrink * B, center.copy(), gap)
        if best.gap <= max(enough, 0.01 * _PROMISED["inscribed"]):
            break
    assert best is not None
    if not best.gap <= max(enough, _PROMISED["inscribed"] * (1.0 + n)):
        raise SolverError(
            f"{label}: the log volume is known to {best.gap:.1e} only; reduce_inequalities()"
            " first, or leave out directions in which the set is thin beside its coordinates"
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
    return middle + turned @ ends.mean(axis=1), np.ascontiguousarray(turned * half), half


def circumscribed(points: np.ndarray, rank_tol: float, label: str) -> tuple[Extremal, int]:
    """Return the smallest ellipsoid around points ``(m, n)`` in their affine hull, and its rank.

    Directions with singular values below ``rank_tol`` times the largest don't count. All points
    that span the counted ones are inside without tolerance.
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
