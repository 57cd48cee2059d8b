"""The deepest point of a convex polytope: the centre of the largest ball inside.

It is the linear programme "maximize t with n_f . x + t <= b_f for every face f", solved along the
central path (Boyd and Vandenberghe 2004, section 11.3): the maximum of ``t + mu sum log s_f`` with
the slacks ``s_f = b_f - n_f . x - t``, for mu falling to 0. Where many points are equally deep, as
in a prism, the path ends in the middle of them. With f faces, t is then within ``f mu`` of the
largest.
"""

import math

import numpy as np

from scene_graph_ros.geometry.compiled.kernel import kernel

__all__ = ["deepest_point"]

_STEPS = 200
"""Newton steps; a few tens are needed."""

_SHRINK = 0.3
"""What mu is multiplied by after a step that stayed well inside."""

_TO_BORDER = 0.9
"""A step goes at most this part of the way to where a slack is zero."""


@kernel
def _solve(H, g):
    """Solve H x = g in place for a positive definite (4, 4) matrix (Cholesky); False if not."""
    for i in range(4):
        for j in range(i + 1):
            total = H[i, j]
            for k in range(j):
                total -= H[i, k] * H[j, k]
            if i == j:
                if not total > 0.0:
                    return False
                H[i, i] = math.sqrt(total)
            else:
                H[i, j] = total / H[j, j]
    for i in range(4):
        for k in range(i):
            g[i] -= H[i, k] * g[k]
        g[i] /= H[i, i]
    for i in range(3, -1, -1):
        for k in range(i + 1, 4):
            g[i] -= H[k, i] * g[k]
        g[i] /= H[i, i]
    return True


@kernel
def _newton(normals, slacks, mu, H, g):
    """Write the Newton direction of (x, t) to ``g``; return False where there is none."""
    H[:, :] = 0.0
    g[:3] = 0.0
    g[3] = 1.0
    row = np.ones(4)
    for f in range(len(normals)):
        for k in range(3):
            row[k] = normals[f, k]
        weight = mu / slacks[f]
        for i in range(4):
            g[i] -= weight * row[i]
            for j in range(i + 1):
                H[i, j] += weight / slacks[f] * row[i] * row[j]
    return _solve(H, g)


@kernel
def _along(normals, x):
    """Return ``normals @ x``, (f,), in one order of sums: a library has one for each processor."""
    result = np.empty(len(normals))
    for f in range(len(normals)):
        result[f] = normals[f, 0] * x[0] + normals[f, 1] * x[1] + normals[f, 2] * x[2]
    return result


@kernel
def deepest_point(normals, offsets, start, tolerance):
    """Find the deepest point of a polytope.

    Args:
        normals: (f, 3) unit, outward, of a bounded polytope.
        offsets: (f,) metres: inside is where ``normals @ x <= offsets``.
        start: (3,) a point inside.
        tolerance: relative: how much less deep than the deepest the result may be.

    Returns:
        (3,) the point, and its exact depth: the least distance to the plane of a face. The depth
        is that of ``start`` where nothing deeper is found.

    """
    x = start.copy()
    slacks = offsets - _along(normals, x)
    t = 0.5 * slacks.min()
    best, depth = x.copy(), slacks.min()
    slacks -= t
    mu = depth
    H, g = np.empty((4, 4)), np.empty(4)
    for _ in range(_STEPS):
        if len(normals) * mu <= tolerance * depth or not _newton(normals, slacks, mu, H, g):
            break
        change = _along(normals, g) + g[3]
        length = 1.0
        for f in range(len(normals)):
            if change[f] * length > _TO_BORDER * slacks[f]:
                length = _TO_BORDER * slacks[f] / change[f]
        x += length * g[:3]
        t += length * g[3]
        slacks = offsets - _along(normals, x) - t
        if not slacks.min() > 0.0:
            break
        if slacks.min() + t > depth:
            best, depth = x.copy(), slacks.min() + t
        if length == 1.0:
            mu *= _SHRINK
    return best, depth
