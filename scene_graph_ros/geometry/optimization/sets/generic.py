"""Optima and nearest points of sets that are lifts of rows and balls."""

from __future__ import annotations

from typing import Any

import numpy as np

from scene_graph_ros.geometry.optimization.errors import ConvexSetError, SolverError
from scene_graph_ros.geometry.optimization.lift import Ball, joined, Lift
from scene_graph_ros.geometry.optimization.sets.answers import Projection, Support
from scene_graph_ros.geometry.optimization.solve.cutting import (
    maximize_in_cones,
    Reached,
)
from scene_graph_ros.geometry.optimization.solve.nearest_by_support import nearest_by_support

__all__ = ["check_gaps", "inner_point", "nearest_in_form", "project_on_set", "support_of_lift"]

_PROMISED = 1e-9
"""Relative to the size of what is asked: a larger gap is an error."""

_AT_SURFACE = 1e-7
"""Relative to the coordinates: so near to a curved set, the way to it is too short to have a
direction that is known well; the gap is then at most the distance."""


def inner_point(asked: Any, question: str) -> tuple[np.ndarray, Any]:
    """Return a point of a set's lift, in floats, and the cuts that were made to find it.

    Raises ConvexSetError for an empty set.
    """
    found = asked.found
    if found.kind == "farkas":
        raise ConvexSetError(
            f"{type(asked).__name__}.{question}: the set is empty; ask is_empty() first"
        )
    return np.array([float(v) for v in found.vector]), found.cuts


def support_of_lift(asked: Any, d: np.ndarray) -> Support:
    """Return how far a set with balls in its lift reaches along d ``(n,)``."""
    lift, n = asked.lifted, asked.ambient_dimension
    inner, cuts = inner_point(asked, "support")
    c = np.zeros(lift.num_variables)
    c[:n] = d
    reached = maximize_in_cones(lift, c, inner, cuts)
    if reached.ray is not None:
        return Support(np.inf, reached.ray[:n], 0.0)
    gap = max(0.0, reached.upper - reached.value)
    size = max(reached.size, abs(reached.value))
    if gap > _PROMISED * size:
        raise SolverError(
            f"{type(asked).__name__}.support: the reach along {d.tolist()} was found to {gap:.1e}"
            f" only, beside a size of {size:.1e}"
        )
    return Support(reached.value, reached.x[:n], gap)


def nearest_in_form(asked: Any, A: np.ndarray, p: np.ndarray) -> tuple[float, np.ndarray, float]:
    """Return the least ``|A (x - p)|`` over a set, the point x ``(n,)``, and the gap.

    Further variables are ``z = p``, ``w = A x - A z`` and the length r of w, which is minimized.
    """
    lift, n, m = asked.lifted, asked.ambient_dimension, len(A)
    inner, cuts = inner_point(asked, "projection")
    e = lift.num_variables
    E = np.zeros((n + m, e + n + m + 1))
    E[:n, e : e + n] = np.eye(n)
    E[n:, :n], E[n:, e : e + n], E[n:, e + n : -1] = -A, A, np.eye(m)
    nearness = Lift(
        E,
        np.append(p, np.zeros(m)),
        np.zeros((0, E.shape[1])),
        np.zeros(0),
        (Ball(np.arange(e + n, e + n + m), e + n + m),),
    )
    whole = joined([lift.placed(np.arange(e), E.shape[1]), nearness])
    w = A @ (inner[:n] - p)
    start = np.concatenate([inner, p, w, [2.0 * np.linalg.norm(w) + 1e-300]])
    box = _box_cuts(whole)
    c = np.zeros(E.shape[1])
    c[-1] = -1.0
    size = float(np.linalg.norm(w))
    reached = maximize_in_cones(whole, c, start, [*cuts, *box])
    return _checked(reached, asked, A, p, size)


def _box_cuts(whole: Lift) -> list[Any]:
    from scene_graph_ros.geometry.optimization.solve.cutting import Cut

    last = len(whole.cones) - 1
    units = np.eye(len(whole.cones[last].columns))
    return [Cut(last, sign * u) for sign in (1.0, -1.0) for u in units]


def _checked(
    reached: Reached, asked: Any, A: np.ndarray, p: np.ndarray, size: float
) -> tuple[float, np.ndarray, float]:
    x = reached.x[: asked.ambient_dimension]
    distance = float(np.linalg.norm(A @ (x - p)))
    gap = max(0.0, distance + reached.upper)
    _check_gap(gap, size, asked, p)
    return distance, x, gap


def _check_gap(gap: float, size: float, asked: Any, p: np.ndarray) -> None:
    if gap > _PROMISED * max(size, 1e-300):
        raise SolverError(
            f"{type(asked).__name__}: the nearest point to {p.tolist()} was found to {gap:.1e}"
            f" only, beside a size of {size:.1e}"
        )


def check_gaps(asked: Any, points: Any, nearest: Any, distances: Any, gaps: Any) -> None:
    """Raise SolverError where a gap of a nearest point is larger than promised."""
    for p, x, distance, gap in zip(points, nearest, distances, gaps, strict=True):
        size = float(np.abs(np.append(p, x)).max(initial=0.0))
        if distance > _AT_SURFACE * size:
            _check_gap(gap, size, asked, p)


def project_on_set(asked: Any, points: np.ndarray) -> Projection:
    """Return the nearest points of a set: by its supports if these are finite, else by cuts."""
    n = asked.ambient_dimension
    if asked.is_bounded():
        found = [nearest_by_support(asked.support, p) for p in points] if n else []
        found = found or [(0.0, p, 0.0) for p in points]
        distances, nearest, gaps = zip(*found, strict=True) if found else ((), (), ())
        check_gaps(asked, points, nearest, distances, gaps)
    else:
        found = [nearest_in_form(asked, np.eye(n), p) for p in points]
    return Projection(
        np.array([f[0] for f in found]),
        np.array([f[1] for f in found]).reshape(len(points), n),
        np.array([f[2] for f in found]),
    )
