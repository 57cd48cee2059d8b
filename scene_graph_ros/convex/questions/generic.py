"""Optima and nearest points of sets that are lifts of rows and balls."""

from __future__ import annotations

from typing import Any

import numpy as np

from scene_graph_ros.convex.errors import ConvexSetError, SolverError
from scene_graph_ros.convex.questions.answers import Projection, Support
from scene_graph_ros.convex.solve.cones.lift import Ball, joined, Lift
from scene_graph_ros.convex.solve.cutting.cutting import (
    maximize_in_cones,
    Reached,
)
from scene_graph_ros.convex.solve.exact.maximize import maximize
from scene_graph_ros.convex.solve.nearest.nearest_by_support import nearest_by_support

__all__ = [
    "check_gaps",
    "inner_point",
    "is_near",
    "nearest_in_form",
    "project_on_set",
    "support_of_lift",
]

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
    """Return the support along d ``(n,)`` of a set with balls in its lift."""
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
    if not w.any():
        return 0.0, p.copy(), 0.0
    start = np.concatenate([inner, p, w, [2.0 * np.linalg.norm(w) + 1e-300]])
    box = _box_cuts(whole)
    c = np.zeros(E.shape[1])
    c[-1] = -1.0
    size = float(np.linalg.norm(w))
    reached = maximize_in_cones(whole, c, start, [*cuts, *box])
    return _checked(reached, asked, A, p, size)


def _box_cuts(whole: Lift) -> list[Any]:
    from scene_graph_ros.convex.solve.cutting.cutting import Cut

    last = len(whole.cones) - 1
    units = np.eye(len(whole.cones[last].columns))
    return [Cut(last, sign * u) for sign in (1.0, -1.0) for u in units]


def _checked(
    reached: Reached, asked: Any, A: np.ndarray, p: np.ndarray, size: float
) -> tuple[float, np.ndarray, float]:
    x = reached.x[: asked.ambient_dimension]
    distance = float(np.linalg.norm(A @ (x - p)))
    gap = min(max(0.0, distance + reached.upper), distance)
    if distance > _AT_SURFACE * float((np.abs(A) @ (np.abs(x) + np.abs(p))).max(initial=0.0)):
        _check_gap(gap, size, asked, p)
    return distance, x, gap


def _check_gap(gap: float, size: float, asked: Any, p: np.ndarray) -> None:
    if gap > _PROMISED * max(size, 1e-300):
        raise SolverError(
            f"{type(asked).__name__}: the nearest point to {p.tolist()} was found to {gap:.1e}"
            f" only, beside a size of {size:.1e}"
        )


def is_near(p: np.ndarray, found: tuple[float, np.ndarray, float]) -> bool:
    """Tell whether a nearest point is known as well as promised, or its distance can't be."""
    distance, x, gap = found
    size = float(np.abs(np.append(p, x)).max(initial=0.0))
    return distance <= _AT_SURFACE * size or gap <= _PROMISED * size


def check_gaps(asked: Any, points: Any, nearest: Any, distances: Any, gaps: Any) -> None:
    """Raise SolverError where a gap of a nearest point is larger than promised.

    Relative to coordinates or to the set's size, whichever is larger.
    """
    size: float | None = None
    for p, x, distance, gap in zip(points, nearest, distances, gaps, strict=True):
        if is_near(p, (distance, x, gap)):
            continue
        size = _size_of(asked) if size is None else size
        if distance > _AT_SURFACE * size:
            coordinates = float(np.abs(np.append(p, x)).max(initial=0.0))
            _check_gap(gap, max(size, coordinates), asked, p)


def _size_of(asked: Any) -> float:
    """Return a bounded set's largest width along an axis; 0 of others."""
    if not asked.is_bounded():
        return 0.0
    axes = np.eye(asked.ambient_dimension)
    return max(asked.support(d).value + asked.support(-d).value for d in axes)


def _nearest_of_unbounded(asked: Any, p: np.ndarray) -> tuple[float, np.ndarray, float]:
    """Return the nearest point by one method, and where that falls short by another one.

    Flat sets reach exactly as far as their rows say; how far cones reach takes as many planes in
    each direction as the distance alone. Near the surface, or inside, both are asked.
    """

    def by_distance(asked: Any, p: np.ndarray) -> tuple[float, np.ndarray, float]:
        return nearest_in_form(asked, np.eye(len(p)), p)

    methods = [_nearest_of_part, by_distance]
    if asked.lifted.cones:
        # Supports of matrices take a program each, in hundreds of directions.
        methods = [by_distance] if asked.lifted.matrices else [by_distance, _nearest_of_part]
    best, failure = None, None
    for method in methods:
        try:
            found = method(asked, p)
        except SolverError as error:
            failure = error
            continue
        if is_near(p, found) and found[0] > _AT_SURFACE * float(np.abs(p).max()):
            return found
        best = found if best is None or found[2] < best[2] else best
    if best is None:
        assert failure is not None
        raise failure
    return best


def _nearest_of_part(asked: Any, p: np.ndarray) -> tuple[float, np.ndarray, float]:
    """Return the answer of `nearest_by_support` for an unbounded set's part in a box about p.

    The box is wide enough to hold a point of the set, so also the nearest one.
    """
    inner, cuts = inner_point(asked, "projection")
    n, e = asked.ambient_dimension, asked.lifted.num_variables
    width = 2.0 * float(np.abs(inner[:n] - p).max())
    if width == 0.0:
        return 0.0, p.copy(), 0.0
    unit = np.eye(n, e)
    walls = np.concatenate([unit, -unit]), np.append(p + width, width - p)
    part = joined([asked.lifted, Lift(np.zeros((0, e)), np.zeros(0), *walls)])
    known = list(cuts)

    def reach(d: np.ndarray) -> tuple[float, np.ndarray, float]:
        c = np.append(d, np.zeros(e - n))
        if part.cones:
            found = maximize_in_cones(part, c, inner, known)
            # Directions are much the same at last, and so is where planes matter.
            known[:] = found.cuts
            return found.value, found.x[:n], max(0.0, found.upper - found.value)
        best = maximize(part.rows, c, inner)
        return best.value, best.x[:n], best.gap

    return nearest_by_support(reach, p)


def project_on_set(asked: Any, points: np.ndarray) -> Projection:
    """Return the nearest points of a set by its supports, or those of its part near the point."""
    n = asked.ambient_dimension
    if not n:
        found = [(0.0, p, 0.0) for p in points]
    elif asked.is_bounded():
        found = [nearest_by_support(asked.support, p) for p in points]
    else:
        found = [_nearest_of_unbounded(asked, p) for p in points]
    distances, nearest, gaps = zip(*found, strict=True) if found else ((), (), ())
    check_gaps(asked, points, nearest, distances, gaps)
    return Projection(
        np.array([f[0] for f in found]),
        np.array([f[1] for f in found]).reshape(len(points), n),
        np.array([f[2] for f in found]),
    )
