"""The point of a hull of points that is nearest to another: Wolfe's method (1976)."""

from __future__ import annotations

import numpy as np

from scene_graph_ros.geometry.compiled.kernel import kernel
from scene_graph_ros.geometry.tolerances import EPSILON

__all__ = ["nearest_in_hull"]

_ROUNDING = 8.0 * EPSILON
"""Relative to the product of lengths: a point counts as further along only beyond rounding."""

_DEPENDENT = 1e-13
"""Relative to its length: what is left of a corner's edge beside others, if it depends on them."""

_MOST_IDLE = 3
"""Turns in a row that came no nearer."""


@kernel
def _affine_weights(V, chosen, k, p, weights):
    """Fill the weights of the point nearest to p in the affine hull of k corners; False if flat.

    Least squares by orthogonalization of the edges from the first corner.
    """
    n = V.shape[1]
    Q, R = np.zeros((n, k)), np.zeros((k, k))
    goal = np.zeros(k)
    for j in range(1, k):
        rest, size = np.zeros(n), 0.0
        for i in range(n):
            rest[i] = V[chosen[j], i] - V[chosen[0], i]
            size += rest[i] * rest[i]
        for _ in range(2):
            for q in range(1, j):
                part = 0.0
                for i in range(n):
                    part += Q[i, q] * rest[i]
                R[q, j] += part
                for i in range(n):
                    rest[i] -= part * Q[i, q]
        length = 0.0
        for i in range(n):
            length += rest[i] * rest[i]
        if length <= _DEPENDENT**2 * size or j > n:
            return False
        R[j, j] = np.sqrt(length)
        for i in range(n):
            Q[i, j] = rest[i] / R[j, j]
            goal[j] += Q[i, j] * (p[i] - V[chosen[0], i])
    weights[0] = 1.0
    for j in range(k - 1, 0, -1):
        total = goal[j]
        for i in range(j + 1, k):
            total -= R[j, i] * weights[i]
        weights[j] = total / R[j, j]
        weights[0] -= weights[j]
    return True


@kernel
def _farthest(V, p, x):
    """Return the corner furthest from x towards p, and by how much beyond rounding."""
    m, n = V.shape
    length = 0.0
    for i in range(n):
        length += (p[i] - x[i]) ** 2
    length = np.sqrt(length)
    best, reach = -1, 0.0
    for j in range(m):
        along, size = 0.0, 0.0
        for i in range(n):
            along += (V[j, i] - x[i]) * (p[i] - x[i])
            size += (abs(V[j, i]) + abs(x[i]) + abs(p[i])) ** 2
        if along > _ROUNDING * np.sqrt(size) * length and along > reach:
            best, reach = j, along
    return best


@kernel
def _nearest_corner(V, p):
    """Return the corner nearest to p."""
    best, least = 0, np.inf
    for j in range(len(V)):
        square = 0.0
        for i in range(len(p)):
            square += (V[j, i] - p[i]) ** 2
        if square < least:
            best, least = j, square
    return best


@kernel
def _shrink(V, chosen, weights, k, p, goal):
    """Move to the point nearest to p in the corners' affine hull, and drop those it leaves out.

    Returns how many corners stay, and whether the newest added a direction that rounding leaves.
    """
    for _ in range(k):
        if not _affine_weights(V, chosen, k, p, goal):
            return k - 1, False
        share, left_out = 1.0, -1
        for j in range(k):
            if goal[j] < 0.0 and weights[j] < share * (weights[j] - goal[j]):
                share, left_out = weights[j] / (weights[j] - goal[j]), j
        for j in range(k):
            weights[j] += share * (goal[j] - weights[j])
        if left_out < 0:
            break
        for j in range(left_out, k - 1):
            chosen[j], weights[j] = chosen[j + 1], weights[j + 1]
        k -= 1
    return k, True


@kernel
def _nearest(V, p, x, out):
    """Move x ``(n,)`` to the nearest point; fill its weights ``out (m,)``; False if it fails."""
    m, n = V.shape
    chosen, weights = np.zeros(n + 2, np.int64), np.zeros(n + 2)
    goal = np.zeros(n + 2)
    chosen[0], weights[0], k = _nearest_corner(V, p), 1.0, 1
    done, least, idle = False, np.inf, 0
    for _ in range(20 * (m + n) + 20):
        for i in range(n):
            x[i] = 0.0
            for j in range(k):
                x[i] += weights[j] * V[chosen[j], i]
        square = 0.0
        for i in range(n):
            square += (p[i] - x[i]) ** 2
        # Each turn comes nearer, until rounding is all that is left.
        idle = 0 if square < least else idle + 1
        least = min(least, square)
        corner = _farthest(V, p, x)
        done = corner < 0 or k == n + 2 or idle > _MOST_IDLE
        for j in range(k):
            done = done or chosen[j] == corner
        if done:
            break
        chosen[k], weights[k] = corner, 0.0
        k, is_new = _shrink(V, chosen, weights, k + 1, p, goal)
        if not is_new:
            done = True
            break
    out[:] = 0.0
    for j in range(k):
        out[chosen[j]] += max(weights[j], 0.0)
    return done


@kernel
def _nearest_of_all(V, points, weights):
    for i in range(len(points)):
        if not _nearest(V, points[i].copy(), points[i], weights[i]):
            return i
    return -1


def nearest_in_hull(V: np.ndarray, points: np.ndarray) -> tuple[np.ndarray, np.ndarray, int]:
    """Return the points ``(p, n)`` of the hull of V ``(m, n)``, m > 0, nearest to ``points``.

    Also the weights ``(p, m)`` of the corners that make them, and the first point for which the
    method failed, -1 for none. Corners are taken about the first of them, so that a hull far from
    the origin loses nothing.
    """
    origin = V[0]
    nearest, weights = points - origin, np.zeros((len(points), len(V)))
    failed = _nearest_of_all(np.ascontiguousarray(V - origin), nearest, weights)
    return nearest + origin, weights, failed
