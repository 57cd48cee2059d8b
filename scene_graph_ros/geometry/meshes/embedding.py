"""Points in a volume mesh: the tetrahedron that holds each, and barycentric coordinates."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.compiled.kernel import kernel, lean_kernel
from scene_graph_ros.geometry.meshes.bvh import build_bvh, traversal_stack
from scene_graph_ros.geometry.spatial.vectors import axpy, cross, dot, load_vector, norm, subtract
from scene_graph_ros.geometry.tolerances import COINCIDENCE

__all__ = ["barycentric_coordinates", "embed_points"]


@lean_kernel
def _solve(x, e1, e2, e3, determinant):
    """Return the coordinates of x in the basis e1, e2, e3 (Cramer's rule)."""
    return (
        dot(x, cross(e2, e3)) / determinant,
        dot(x, cross(e3, e1)) / determinant,
        dot(x, cross(e1, e2)) / determinant,
    )


@lean_kernel
def barycentric_coordinates(x, a, b, c, d):
    """Return the four weights w, of sum 1, with ``w0 a + w1 b + w2 c + w3 d = x``.

    One step of iterative refinement makes up for the rounding of Cramer's rule, so that the
    weights give x back to rounding also where the tetrahedron is a sliver; it must not be flat.
    """
    e1, e2, e3 = subtract(b, a), subtract(c, a), subtract(d, a)
    determinant = dot(cross(e1, e2), e3)
    offset = subtract(x, a)
    w = _solve(offset, e1, e2, e3, determinant)
    for _ in range(2):
        left = axpy(-w[0], e1, axpy(-w[1], e2, axpy(-w[2], e3, offset)))
        correction = _solve(left, e1, e2, e3, determinant)
        w = (w[0] + correction[0], w[1] + correction[1], w[2] + correction[2])
    return (1.0 - w[0] - w[1] - w[2], w[0], w[1], w[2])


@lean_kernel
def _depth(x, vertices, tetrahedra, t):
    """Return (depth, weights): how far x is inside the nearest face plane, negative outside."""
    a, b = load_vector(vertices, tetrahedra[t, 0]), load_vector(vertices, tetrahedra[t, 1])
    c, d = load_vector(vertices, tetrahedra[t, 2]), load_vector(vertices, tetrahedra[t, 3])
    w = barycentric_coordinates(x, a, b, c, d)
    e, f = subtract(c, b), subtract(d, b)
    volume = abs(dot(cross(e, f), subtract(a, b)))
    depth = w[0] * volume / norm(cross(e, f))
    depth = min(depth, w[1] * volume / norm(cross(subtract(c, a), subtract(d, a))))
    depth = min(depth, w[2] * volume / norm(cross(subtract(b, a), subtract(d, a))))
    depth = min(depth, w[3] * volume / norm(cross(subtract(b, a), subtract(c, a))))
    return depth, w


@lean_kernel
def _deepest_near(x, mesh, tree, slack):
    """Return (tetrahedron, depth) of the deepest one whose node's box holds x, or (-1, -inf)."""
    (vertices, tetrahedra), (lower, upper, left, right, order) = mesh, tree
    stack = traversal_stack()
    stack[0], depth = 0, 1
    found, deepest = -1, -np.inf
    while depth > 0:
        depth -= 1
        node = stack[depth]
        is_inside = True
        for axis in range(3):
            if x[axis] < lower[node, axis] - slack or x[axis] > upper[node, axis] + slack:
                is_inside = False
        if not is_inside:
            continue
        if left[node] >= 0:
            stack[depth], stack[depth + 1] = right[node], left[node]
            depth += 2
            continue
        for slot in range(-1 - left[node], -1 - left[node] + right[node]):
            t = order[slot]
            reached, _ = _depth(x, vertices, tetrahedra, t)
            if reached > deepest or (reached == deepest and t < found):
                found, deepest = t, reached
    return found, deepest


@kernel
def _embed(points, mesh, tree, slack):
    """Return (t (n,), weights (n, 4)); see ``embed_points``. The tree is one of ``build_bvh``."""
    vertices, tetrahedra = mesh
    holder = np.empty(len(points), np.int64)
    weights = np.empty((len(points), 4))
    for i in range(len(points)):
        x = load_vector(points, i)
        best, deepest = _deepest_near(x, mesh, tree, slack)
        if deepest < -slack:
            for t in range(len(tetrahedra)):
                reached, _ = _depth(x, vertices, tetrahedra, t)
                if reached > deepest:
                    best, deepest = t, reached
        _, w = _depth(x, vertices, tetrahedra, best)
        holder[i] = best
        for k in range(4):
            weights[i, k] = w[k]
    return holder, weights


def embed_points(
    vertices: NDArray[np.float64], tetrahedra: NDArray[np.int64], points: NDArray[np.float64]
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Find the tetrahedron that holds each point.

    A point outside the mesh goes with the tetrahedron that it is least outside of, measured as the
    largest distance from its face planes; some of its weights are then negative. A point on a
    face belongs to either side, to rounding, and to the same one always.

    Args:
        vertices: (v, 3) metres.
        tetrahedra: (t, 4) positively oriented.
        points: (n, 3) metres.

    Returns:
        the rows of the tetrahedra (n,), and the weights (n, 4) of their corners.

    """
    corners = vertices[tetrahedra]
    lower, upper = corners.min(axis=1), corners.max(axis=1)
    tree: tuple[Any, ...] = build_bvh(lower, upper)
    slack = COINCIDENCE * float(np.abs(vertices).max())
    # Read-only arrays are another type to the compiler.
    at, *mesh = (np.array(a, order="C") for a in (points, vertices, tetrahedra))
    holder, weights = _embed(at, tuple(mesh), tree, slack)
    return holder, weights
