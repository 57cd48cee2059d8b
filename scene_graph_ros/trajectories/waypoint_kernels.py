"""Polylines with fewer points, compiled."""

import numpy as np

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, kernel

__all__ = ["keep_far_points"]


@inlined_kernel
def _distance(points, scale, i, first, last):
    """Return the largest scaled entry from a point to the nearest one of the edge between two."""
    along, length = 0.0, 0.0
    for j in range(points.shape[1]):
        way = (points[last, j] - points[first, j]) * scale[j]
        along += way * (points[i, j] - points[first, j]) * scale[j]
        length += way * way
    part = min(max(along / length, 0.0), 1.0) if length > 0.0 else 0.0
    most = 0.0
    for j in range(points.shape[1]):
        on = points[first, j] + part * (points[last, j] - points[first, j])
        most = max(most, abs(points[i, j] - on) * scale[j])
    return most


@kernel
def keep_far_points(points, scale, kept):
    """Mark points ``(n, k)`` until others are within 1, scaled, of the edges between marked ones.

    Between two neighbours that are marked the farthest point is marked, and so on.
    """
    n = len(points)
    stack = np.empty((n + 1, 2), dtype=np.int64)
    first = 0
    for last in range(1, n):
        if not kept[last]:
            continue
        stack[0, 0], stack[0, 1] = first, last
        first = last
        size = 1
        while size > 0:
            size -= 1
            low, high = stack[size, 0], stack[size, 1]
            far, at = 1.0, -1
            for i in range(low + 1, high):
                distance = _distance(points, scale, i, low, high)
                if distance > far:
                    far, at = distance, i
            if at >= 0:
                kept[at] = True
                stack[size, 0], stack[size, 1] = low, at
                stack[size + 1, 0], stack[size + 1, 1] = at, high
                size += 2
