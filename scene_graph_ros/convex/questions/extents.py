"""How far a set reaches along the axes."""

from __future__ import annotations

from typing import Any

import numpy as np

from scene_graph_ros.convex.questions.quick_answers import extents_of_rows

__all__ = ["bounds_of"]


def bounds_of(convex_set: Any) -> tuple[np.ndarray, np.ndarray] | None:
    """Return the least and greatest coordinates ``(n,)`` of a `ConvexSet`.

    Each is outward by the gap of its support, so that the set is inside. None for a set that is
    unbounded or empty.
    """
    box: tuple[np.ndarray, np.ndarray] | None = convex_set.own_box
    if box is not None:
        return box if (box[0] <= box[1]).all() else None
    rows = convex_set._linear_rows()
    quick = None if rows is None else extents_of_rows(*rows)
    if quick is not None:
        return quick
    if convex_set.is_empty() or not convex_set.is_bounded():
        return None
    bounds = []
    for sign in (-1.0, 1.0):
        reached = [convex_set.support(sign * e) for e in np.eye(convex_set.ambient_dimension)]
        bounds.append(np.array([sign * (r.value + r.gap) for r in reached]))
    return bounds[0], bounds[1]
