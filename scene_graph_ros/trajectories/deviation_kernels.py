"""How far polynomials are from a path of straight edges, compiled.

What is near a straight edge, entry by entry, is convex: a polynomial whose control points are all
near one edge is near it everywhere. One whose are not is cut in halves.
"""

import numpy as np

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, kernel

__all__ = ["find_far_pieces"]

_CUTS, _PARTS = 50, 2000
"""Halves of halves, and parts of a piece: what is not known to be near then is far."""

_AHEAD = 8
"""Edges that are tried before all others."""


@inlined_kernel
def _is_near(points, d, path, e, allowed):
    """Tell whether d points are all near the edge from the e-th point of a path to the next."""
    for i in range(d):
        low, high = 0.0, 1.0
        for j in range(path.shape[1]):
            way, off = path[e + 1, j] - path[e, j], points[i, j] - path[e, j]
            if way == 0.0:
                if abs(off) > allowed[j]:
                    return False
                continue
            one, other = (off - allowed[j]) / way, (off + allowed[j]) / way
            low, high = max(low, min(one, other)), min(high, max(one, other))
        if low > high:
            return False
    return True


@inlined_kernel
def _near_edge(points, d, path, allowed, first):
    """Return an edge that d points are near to, looked for from the ``first`` on; -1 for none."""
    count = len(path) - 1
    for k in range(-1, _AHEAD):
        e = first + k
        if 0 <= e < count and _is_near(points, d, path, e, allowed):
            return e
    for e in range(count):
        if _is_near(points, d, path, e, allowed):
            return e
    return -1


@inlined_kernel
def _cut(points, d, right):
    """Write the halves of a polynomial: the left one in its place (de Casteljau)."""
    for j in range(points.shape[1]):
        right[d - 1, j] = points[d - 1, j]
        for step in range(1, d):
            for i in range(d - 1, step - 1, -1):
                points[i, j] = 0.5 * (points[i - 1, j] + points[i, j])
            right[d - 1 - step, j] = points[d - 1, j]


@kernel
def find_far_pieces(control, path, allowed, far):
    """Write which polynomials ``(p,)`` by their control points ``(p, d, k)`` leave a path.

    ``path`` ``(n, k)`` has at least two points; ``allowed`` ``(k,)`` is how far each entry may be
    from one of its edges.
    """
    count, d, k = control.shape
    stack, depths = np.empty((_CUTS + 2, d, k)), np.empty(_CUTS + 2, dtype=np.int64)
    edge = 0
    for piece in range(count):
        far[piece] = False
        stack[0], depths[0], size, parts = control[piece], 0, 1, 0
        while size > 0:
            size, parts = size - 1, parts + 1
            points, depth = stack[size], depths[size]
            found = _near_edge(points, d, path, allowed, edge)
            if found >= 0:
                edge = found
                continue
            begins = _near_edge(points, 1, path, allowed, edge)
            if depth == _CUTS or parts == _PARTS or begins < 0:
                far[piece] = True
                break
            # The second half is looked at last.
            _cut(points, d, stack[size + 1])
            for i in range(d):
                for j in range(k):
                    half = stack[size + 1, i, j]
                    stack[size + 1, i, j] = points[i, j]
                    points[i, j] = half
            depths[size], depths[size + 1] = depth + 1, depth + 1
            size += 2
