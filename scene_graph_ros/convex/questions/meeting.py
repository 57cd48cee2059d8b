"""Whether two sets meet by how far they reach, where one has many points or members."""

from __future__ import annotations

from typing import Any

from scene_graph_ros.convex.questions.decisions import is_empty
from scene_graph_ros.convex.questions.quick_answers import reached
from scene_graph_ros.convex.questions.surrounding import surround

__all__ = ["meets_by_reach"]


def meets_by_reach(one: Any, other: Any) -> bool | None:
    """Tell whether the sets meet by how far they reach, None where that is left open.

    It is asked where one has many points or members, and the other one reaches quickly. A plane
    between them, or differences about 0, tell it in floats; where sets touch to rounding, the
    hulls of the points that were found are asked exactly.
    """
    sets = one, other
    if not any(each._HAS_QUICK_SUPPORT for each in sets):
        return None
    if any(each.is_empty() for each in sets):
        return False
    if not all(each.is_bounded() for each in sets) or other._has_matrices():
        return None
    apart, points = reached(*sets)
    if apart:
        return False
    if surround(*sets):
        return True
    fewer = [
        each if kind is None else kind(reached_there)
        for each, kind, reached_there in zip(
            sets, (s._hull_of_points() for s in sets), points, strict=True
        )
    ]
    if fewer[0] is one and fewer[1] is other:
        return None
    return True if not is_empty(tuple(fewer), "intersects_with").value else None
