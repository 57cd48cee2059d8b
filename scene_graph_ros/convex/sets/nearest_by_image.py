"""The point of a set with flat faces that is nearest by a form, found where the form is round."""

from __future__ import annotations

import numpy as np

from scene_graph_ros.convex.errors import SolverError
from scene_graph_ros.convex.questions.row_geometry import nearest_with_multipliers
from scene_graph_ros.convex.sets.convex_set import ConvexSet
from scene_graph_ros.convex.sets.v_polytope import VPolytope
from scene_graph_ros.convex.solve.exact.rows import Rows
from scene_graph_ros.convex.solve.nearest.nearest_in_hull import nearest_in_hull
from scene_graph_ros.geometry.tolerances import EPSILON

__all__ = ["nearest_by_image"]

_GAP = 1e-9
"""Relative: what the value may be larger than the least one."""


def nearest_by_image(
    other: ConvexSet, A: np.ndarray, p: np.ndarray, to_ball: np.ndarray
) -> tuple[float, np.ndarray] | None:
    """Return the least ``|A (x - p)|`` over a set, and x ``(n,)``.

    ``|A to_ball y| = |y|`` for all y ``(n,)``. None for sets without rows or vertices of their
    own, and where a plane does not show that nothing is nearer, to 1e-9.
    """
    if isinstance(other, VPolytope):
        found = _of_vertices(other.vertices, A, p, to_ball)
    else:
        found = _of_rows(other, p, to_ball)
    if found is None:
        return None
    x, least = found
    value = float(np.linalg.norm(A @ (x - p)))
    return (value, x) if value - least <= _GAP * value else None


def _of_vertices(
    vertices: np.ndarray, A: np.ndarray, p: np.ndarray, to_ball: np.ndarray
) -> tuple[np.ndarray, float] | None:
    """Return the nearest point of a hull, and a lower bound of all its points."""
    if not len(vertices):
        return None
    image = np.linalg.solve(to_ball, (vertices - p).T).T
    _, weights, failed = nearest_in_hull(image, np.zeros((1, len(p))))
    if failed >= 0:
        return None
    x = weights[0] @ vertices
    w = A @ (x - p)
    # For every y: w . A (y - p) <= |w| |A (y - p)|.
    length = float(np.linalg.norm(w))
    return x, float(((vertices - p) @ (A.T @ w)).min()) / length if length else 0.0


def _of_rows(
    other: ConvexSet, p: np.ndarray, to_ball: np.ndarray
) -> tuple[np.ndarray, float] | None:
    alone = other._linear_rows()
    if alone is None or other.is_empty():
        return None
    rows, sides = alone
    image, moved = rows @ to_ball, sides - rows @ p
    found = nearest_with_multipliers(Rows(image, moved, 0), np.zeros((1, len(p))))
    if found is None:
        return None
    z, weights = found[0][0], found[1][0]
    # What the image's rows are rounded by, at points as far as z.
    off = np.abs(sides) + np.abs(rows) @ (np.abs(p) + np.abs(to_ball) @ np.abs(z))
    off *= 4.0 * (len(p) + 2) * EPSILON
    # For every y of the image: -weights . sides <= -weights . rows y <= |weights . rows| |y|.
    length = float(np.linalg.norm(weights @ image))
    least = -float(weights @ moved + weights @ off) / length if length else 0.0
    try:
        return other._project((p + to_ball @ z)[None]).points[0], least
    except SolverError:
        return None
