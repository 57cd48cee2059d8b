"""Answers of ellipsoids from their axes and radii."""

from __future__ import annotations

import math

import numpy as np

from scene_graph_ros.convex.questions.answers import gaps_of, Projection, Support
from scene_graph_ros.convex.questions.pieces import Ellipsoids, Piece
from scene_graph_ros.convex.questions.surrounding import ROUNDING
from scene_graph_ros.convex.solve.ellipsoids.ellipsoid_distance import nearest_on_axes
from scene_graph_ros.geometry.tolerances import EPSILON

__all__ = [
    "distances_to_axes",
    "inner_of_axes",
    "pieces_of_axes",
    "project_on_axes",
    "support_of_axes",
    "unit_ball_volume",
]


def unit_ball_volume(n: int) -> float:
    """Return the volume of the ball of radius 1 in n dimensions."""
    return math.pi ** (0.5 * n) / math.gamma(0.5 * n + 1.0)


def support_of_axes(
    axes: np.ndarray, radii: np.ndarray, center: np.ndarray, d: np.ndarray
) -> Support:
    """Return the support of an ellipsoid; axes are columns, radii may be 0 or infinite."""
    along = axes.T @ d
    free = np.isinf(radii)
    if (np.abs(along[free]) > len(d) * EPSILON * np.linalg.norm(d)).any():
        return Support(np.inf, axes[:, free] @ along[free], 0.0)
    stretched = np.where(free, 0.0, np.where(free, 0.0, radii) * along)
    length = float(np.linalg.norm(stretched))
    way = stretched / length if length > 0.0 else stretched
    point = center + axes @ (np.where(free, 0.0, radii) * way)
    return Support(float(d @ center) + length, point, 0.0)


def inner_of_axes(
    axes: np.ndarray, radii: np.ndarray, center: np.ndarray, d: np.ndarray, drawn: float | None
) -> tuple[np.ndarray, float] | None:
    """Return the point ``(n,)`` furthest along d, drawn to the centre by a share; None without.

    Behind it is a bound of the rounding in each coordinate.
    """
    if drawn is None:
        return None
    found = support_of_axes(axes, radii, center, d).point
    size = float(np.abs(center).max(initial=0.0) + radii.max(initial=0.0))
    return center + (1.0 - drawn) * (found - center), ROUNDING * len(d) * size


def pieces_of_axes(
    axes: np.ndarray, radii: np.ndarray, center: np.ndarray, drawn: float | None, d: np.ndarray
) -> list[Piece] | None:
    """Return an ellipsoid as a piece along a unit vector; None if it is unbounded or too thin."""
    if drawn is None or np.isinf(radii).any():
        return None
    maps = axes * radii
    size = float(np.abs(center).max(initial=0.0) + np.abs(maps).max(initial=0.0))
    of = Ellipsoids(maps[None], center[None], np.array([drawn]), np.array([size]))
    found = of.along(d)
    return None if found is None else [found.piece(0)]


def _nearest(
    axes: np.ndarray, radii: np.ndarray, center: np.ndarray, points: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the nearest points ``(m, n)`` of an ellipsoid, and the same along its axes."""
    local = (points - center) @ axes
    found = np.array([nearest_on_axes(radii, p) for p in local]).reshape(local.shape)
    is_inside = (found == local).all(axis=1)
    return np.where(is_inside[:, None], points, center + found @ axes.T), found


def distances_to_axes(
    axes: np.ndarray, radii: np.ndarray, center: np.ndarray, points: np.ndarray
) -> np.ndarray:
    """Return the distances ``(m,)`` of `project_on_axes` alone, a third of the work."""
    return np.linalg.norm(points - _nearest(axes, radii, center, points)[0], axis=1)


def project_on_axes(
    axes: np.ndarray, radii: np.ndarray, center: np.ndarray, points: np.ndarray
) -> Projection:
    """Return the nearest points of an ellipsoid."""
    nearest, found = _nearest(axes, radii, center, points)
    here = np.zeros(len(radii))

    def reach(direction: np.ndarray, k: int) -> float:
        return support_of_axes(np.eye(len(radii)), radii, here, axes.T @ direction).value - float(
            found[k] @ (axes.T @ direction)
        )

    distances, gaps = gaps_of(points, nearest, reach)
    return Projection(distances, nearest, gaps)
