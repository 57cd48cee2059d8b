"""Winding numbers of points, counted along rays: exact but for points that are on the surface.

Nothing here knows how a surface came about, so that it can judge others' work.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.compiled.kernel import kernel, lean_kernel
from scene_graph_ros.geometry.meshes.bvh import build_bvh, traversal_stack
from scene_graph_ros.geometry.meshes.kernel_arrays import for_kernels
from scene_graph_ros.geometry.meshes.triangle_boxes import triangle_boxes
from scene_graph_ros.geometry.spatial.vectors import cross, dot, load_vector, norm, subtract

__all__ = ["Tree", "winding_numbers"]

Tree = tuple[Any, ...]
"""As ``build_bvh`` returns it."""

_TRIES = 12
"""Rays that pass an edge too near to tell its sides apart are followed by others, as many."""

_NEAR_EDGE = 1e-14
"""Relative to the lengths of an edge and of the way there: a ray this near is no answer."""

_SLACK = 1e-12
"""Relative to the size: by as much boxes are larger than triangles."""


@lean_kernel
def _beside(d, a, b):
    """Return (u, slack): on which side of the edge from a to b the ray along d passes."""
    edge = subtract(b, a)
    return dot(d, cross(edge, a)), _NEAR_EDGE * norm(edge) * (norm(a) + norm(b))


@lean_kernel
def _crossing(p, d, a, b, c):
    """Return (sign, is_clear) of the ray p + t d, t > 0, and a triangle: +1 where it leaves."""
    a, b, c = subtract(a, p), subtract(b, p), subtract(c, p)
    u, slack_u = _beside(d, b, c)
    v, slack_v = _beside(d, c, a)
    w, slack_w = _beside(d, a, b)
    is_before = u < -slack_u or v < -slack_v or w < -slack_w
    is_behind = u > slack_u or v > slack_v or w > slack_w
    if is_before and is_behind:
        return 0, True
    if abs(u) <= slack_u or abs(v) <= slack_v or abs(w) <= slack_w:
        return 0, False
    total = u + v + w
    height = u * dot(d, a) + v * dot(d, b) + w * dot(d, c)
    if height * total <= 0.0:
        return 0, True
    return (-1 if total > 0.0 else 1), True


@lean_kernel
def _passes(p, inverse, lower, upper, node):
    """Return whether a ray from p meets a node's box."""
    near, far = 0.0, np.inf
    for axis in range(3):
        one = (lower[node, axis] - p[axis]) * inverse[axis]
        other = (upper[node, axis] - p[axis]) * inverse[axis]
        near, far = max(near, min(one, other)), min(far, max(one, other))
    return near <= far * (1.0 + 1e-12) + 1e-300


@kernel
def _number(p, d, vertices, triangles, times, tree, own):
    """Return (winding number, is_clear) by one ray; just above the triangle ``own``, if any."""
    lower, upper, left, right, order = tree
    inverse = (1.0 / d[0], 1.0 / d[1], 1.0 / d[2])
    stack = traversal_stack()
    stack[0], depth, total = 0, 1, 0
    while depth > 0:
        depth -= 1
        node = stack[depth]
        if not _passes(p, inverse, lower, upper, node):
            continue
        if left[node] >= 0:
            stack[depth], stack[depth + 1] = right[node], left[node]
            depth += 2
            continue
        for slot in range(-1 - left[node], -1 - left[node] + right[node]):
            t = order[slot]
            a = load_vector(vertices, triangles[t, 0])
            b = load_vector(vertices, triangles[t, 1])
            c = load_vector(vertices, triangles[t, 2])
            if t == own:
                # A ray that begins above it and goes down leaves the surface once less.
                if dot(d, cross(subtract(b, a), subtract(c, a))) < 0.0:
                    total -= times[t]
                continue
            sign, is_clear = _crossing(p, d, a, b, c)
            if not is_clear:
                return 0, False
            total += times[t] * sign
    return total, True


@kernel
def _numbers(points, own, rays, vertices, triangles, times, tree):
    """Return (n,) winding numbers; the last ray's where none is clear."""
    result = np.zeros(len(points), np.int64)
    for i in range(len(points)):
        p = load_vector(points, i)
        for k in range(len(rays)):
            ray = load_vector(rays, k)
            total, is_clear = _number(p, ray, vertices, triangles, times, tree, own[i])
            result[i] = total
            if is_clear:
                break
    return result


def winding_numbers(
    points: NDArray[np.float64],
    vertices: NDArray[np.float64],
    triangles: NDArray[np.int64],
    above: NDArray[np.int64] | None = None,
    times: NDArray[np.int64] | None = None,
    tree: Tree | None = None,
) -> NDArray[np.int64]:
    """Return (n,) how often closed triangles wind around each of (n, 3) points.

    It is 1 inside of one part whose triangles run counter-clockwise seen from outside. With
    ``above`` (n,) each point is in a triangle, and the number is that of its front side. ``times``
    (m,) says how many triangles each stands for, once by default. ``tree`` is of the triangles.
    """
    if tree is None:
        tree = build_bvh(*triangle_boxes(vertices, triangles))
    lower, upper, *rest = tree
    slack = _SLACK * float((upper[0] - lower[0]).max())
    tree = (lower - slack, upper + slack, *rest)
    rays = np.random.default_rng(1).normal(size=(_TRIES, 3))
    rays = np.sign(rays) * np.maximum(np.abs(rays), 0.1)
    rays /= np.linalg.norm(rays, axis=1)[:, None]
    own = np.full(len(points), -1) if above is None else above
    times = np.ones(len(triangles), dtype=np.int64) if times is None else times
    arrays = map(for_kernels, (points, own, rays, vertices, triangles, times))
    return np.asarray(_numbers(*arrays, tree))
