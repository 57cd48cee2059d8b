"""Signed distances of curved pairs in 50 digits, by a route the kernels never take.

The signed distance is the largest value over unit vectors n of the gap between both bodies along
n. It is maximized from support functions in mpmath and in spherical angles, with Newton's method
on the gap's gradient from the best point of a grid.
"""

from convex_bodies import separation
import mpmath as mp
import numpy as np
from scipy.optimize import minimize

from scene_graph_ros.geometry import Box, Capsule, Cylinder, Ellipsoid, Sphere

BODIES = {
    "ellipsoid": Ellipsoid(0.1, 0.08, 1 / 15),
    "flat ellipsoid": Ellipsoid(0.1, 0.09, 0.02),
    "cylinder": Cylinder(0.07, 0.2),
    "disc": Cylinder(0.1, 0.04),
    "sphere": Sphere(0.1),
    "capsule": Capsule(0.03, 0.14),
    "box": Box(0.2, 0.15, 0.1),
}


def support_mp(shape, d):
    """Return the largest ``d . x`` over the shape, in mpmath."""
    x, y, z = d
    if isinstance(shape, Sphere):
        return mp.mpf(shape.radius) * mp.sqrt(x * x + y * y + z * z)
    if isinstance(shape, Capsule):
        return mp.mpf(shape.radius) + mp.mpf(shape.length) / 2 * abs(z)
    if isinstance(shape, Cylinder):
        radial = mp.sqrt(x * x + y * y)
        return mp.mpf(shape.radius) * radial + mp.mpf(shape.length) / 2 * abs(z)
    if isinstance(shape, Ellipsoid):
        a, b, c = mp.mpf(shape.a), mp.mpf(shape.b), mp.mpf(shape.c)
        return mp.sqrt((a * x) ** 2 + (b * y) ** 2 + (c * z) ** 2)
    half = [mp.mpf(shape.width) / 2, mp.mpf(shape.depth) / 2, mp.mpf(shape.height) / 2]
    return half[0] * abs(x) + half[1] * abs(y) + half[2] * abs(z)


def gap_mp(shape_A, shape_B, X_AB, n):
    """Return the gap between A and B along n, in mpmath, from the very numbers of the pose."""
    R = [[mp.mpf(X_AB[i, j]) for j in range(3)] for i in range(3)]
    p = [mp.mpf(X_AB[i, 3]) for i in range(3)]
    n_B = [sum(R[i][j] * n[i] for i in range(3)) for j in range(3)]
    offset = -sum(n[i] * p[i] for i in range(3))
    return offset - support_mp(shape_A, [-x for x in n]) - support_mp(shape_B, n_B)


def reference(shape_A, shape_B, X_AB):
    """Return the signed distance to 20 digits, or None where the best normal is at a kink."""
    grid = np.random.default_rng(1).normal(size=(4000, 3))
    grid /= np.linalg.norm(grid, axis=1)[:, None]
    gaps = separation(shape_A, shape_B, X_AB, grid)
    start = grid[np.argmax(gaps)]

    def negated(x):
        return -separation(shape_A, shape_B, X_AB, x / np.linalg.norm(x))

    start = minimize(
        negated, start, method="Nelder-Mead", options={"xatol": 1e-10, "fatol": 1e-16}
    )
    return reference_near(shape_A, shape_B, X_AB, start.x / np.linalg.norm(start.x))


def reference_near(shape_A, shape_B, X_AB, n):
    """Return the gap's maximum near the unit vector n, or None where it is at a kink.

    ``X_AB`` may hold numbers of mpmath.
    """
    # Angles around the start: n(u, v) = (n + u s + v t) / |.|.
    s = np.cross(n, [1.0, 0.0, 0.0] if abs(n[0]) < 0.7 else [0.0, 1.0, 0.0])
    s /= np.linalg.norm(s)
    t = np.cross(n, s)

    def gap(u, v):
        m = [mp.mpf(n[i]) + u * mp.mpf(s[i]) + v * mp.mpf(t[i]) for i in range(3)]
        length = mp.sqrt(sum(x * x for x in m))
        return gap_mp(shape_A, shape_B, X_AB, [x / length for x in m])

    with mp.workdps(50):
        return newton_maximum(gap)


def newton_maximum(f):
    """Return the maximum of f(u, v) near 0 by Newton's method, or None where it isn't smooth.

    Derivatives are central differences with a step of 1e-12 in 50 digits: good to 1e-24.
    """
    h = mp.mpf(10) ** -12
    x = [mp.mpf(0), mp.mpf(0)]
    for _ in range(12):
        value = {(i, j): f(x[0] + i * h, x[1] + j * h) for i in (-1, 0, 1) for j in (-1, 0, 1)}
        g = [(value[1, 0] - value[-1, 0]) / (2 * h), (value[0, 1] - value[0, -1]) / (2 * h)]
        if max(abs(g[0]), abs(g[1])) < mp.mpf(10) ** -20:
            return value[0, 0]
        middle = 2 * value[0, 0]
        huu = (value[1, 0] + value[-1, 0] - middle) / h**2
        hvv = (value[0, 1] + value[0, -1] - middle) / h**2
        huv = (value[1, 1] + value[-1, -1] - value[1, -1] - value[-1, 1]) / (4 * h**2)
        det = huu * hvv - huv * huv
        if det <= 0 or huu >= 0:
            return None
        x[0] -= (hvv * g[0] - huv * g[1]) / det
        x[1] -= (huu * g[1] - huv * g[0]) / det
        if abs(x[0]) + abs(x[1]) > 1e-3:
            return None
    return None
