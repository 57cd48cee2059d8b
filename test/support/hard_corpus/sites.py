"""Contact sites: points of a surface with an outward normal there, known by construction.

Two convex bodies whose sites face each other at ``distance``, tangent planes parallel, are that
far apart: both planes hold their body back, and the points are that near. Pressed into each other
by ``depth`` they overlap by exactly that if no other direction needs less. Near the normal that
is so if ``bend_A + bend_B > depth`` in every tangent direction: the matrix ``bend`` holds the
radii of curvature (the second derivatives of the support function), 0 where the point stays the
farthest when the normal tilts, and STIFF where the farthest point leaps away, so that the overlap
grows at once.
"""

from typing import NamedTuple

import numpy as np

from hard_corpus.bodies import corners, faces_of, support
from scene_graph_ros.geometry import Box, Capsule, Cylinder, Ellipsoid, HalfSpace, Mesh, Sphere

__all__ = [
    "STIFF",
    "Site",
    "best_gap",
    "gaps",
    "is_shallowest",
    "place",
    "pose",
    "sites_of",
    "unit",
]

STIFF = 1e6
_Z = np.array([0.0, 0.0, 1.0])


class Site(NamedTuple):
    """A point of a surface; ``tangent`` runs along the edge, rim or axis where there is one."""

    feature: str
    point: np.ndarray
    normal: np.ndarray
    tangent: np.ndarray
    bend: np.ndarray


def unit(v):
    """Return v / |v|."""
    return np.asarray(v, float) / np.linalg.norm(v)


def pose(R, p):
    """Return the (4, 4) pose."""
    X = np.eye(4)
    X[:3, :3], X[:3, 3] = R, p
    return X


def _site(feature, point, normal, tangent, bend):
    tangent = unit(tangent - (tangent @ normal) * normal)
    return Site(feature, np.asarray(point, float), normal, tangent, bend)


def _some_tangent(n):
    return np.eye(3)[np.argmin(abs(n))]


def sites_of(shape, seed=0, reach=1.0):
    """Return one site of every kind of feature; a half space's within ``reach`` of its origin."""
    rng = np.random.default_rng(seed)
    if isinstance(shape, HalfSpace):
        point = [*rng.uniform(-reach, reach, 2), 0.0]
        return [_site("face", point, _Z, np.eye(3)[0], STIFF * np.eye(3))]
    if isinstance(shape, Sphere):
        n = unit(rng.normal(size=3))
        point = shape.radius * n
        return [_site("smooth", point, n, _some_tangent(n), shape.radius * np.eye(3))]
    if isinstance(shape, Ellipsoid):
        generic = unit(rng.normal(size=3))
        found = [("smooth", generic), ("tip", np.eye(3)[0]), ("flat", np.eye(3)[2])]
        return [_ellipsoid_site(shape, feature, n) for feature, n in found]
    if isinstance(shape, Capsule | Cylinder):
        angle = rng.uniform(0.0, 2.0 * np.pi)
        radial = unit([np.cos(angle), np.sin(angle), 0.0])
        along = _capsule_sites if isinstance(shape, Capsule) else _cylinder_sites
        return along(shape, radial, rng)
    return _polytope_sites(shape, rng)


def _ellipsoid_site(shape, feature, n):
    axes = np.array([shape.a, shape.b, shape.c])
    reach = np.linalg.norm(axes * n)
    u = axes * n / reach
    bend = np.diag(axes) @ (np.eye(3) - np.outer(u, u)) @ np.diag(axes) / reach
    return _site(feature, axes * u, n, _some_tangent(n), bend)


def _capsule_sites(shape, radial, rng):
    r, half = shape.radius, 0.5 * shape.length
    n = unit(radial + rng.uniform(0.3, 2.0) * _Z)
    round_ = r * np.eye(3)
    return [
        _site("side", r * radial - 0.4 * half * _Z, radial, _Z, round_ + STIFF * np.outer(_Z, _Z)),
        _site("cap", half * _Z + r * n, n, _some_tangent(n), round_),
        _site("seam", half * _Z + r * radial, radial, _Z, round_),
        _site("apex", (half + r) * _Z, _Z, np.eye(3)[0], round_),
    ]


def _cylinder_sites(shape, radial, rng):
    r, half = shape.radius, 0.5 * shape.length
    around = np.cross(_Z, radial)
    n = unit(radial + rng.uniform(0.3, 2.0) * _Z)
    turn = np.outer(around, around)
    rim = half * _Z + r * radial
    return [
        _site(
            "side", r * radial - 0.4 * half * _Z, radial, _Z, r * turn + STIFF * np.outer(_Z, _Z)
        ),
        _site("face", half * _Z + 0.4 * r * radial, _Z, radial, STIFF * np.eye(3)),
        _site("rim", rim, n, around, r / (n @ radial) * turn),
        _site("rim of face", rim, _Z, around, STIFF * turn),
        _site("rim of side", rim, radial, _Z, r * turn),
    ]


def _polytope_sites(shape, rng):
    """Return sites of a box, hull or convex mesh; of a dented one, on what is left of its hull."""
    points = corners(shape)
    triangles, normals, _, neighbors = faces_of(shape)
    kept = _kept_triangles(shape, points, triangles)
    face = next(f for f in range(len(triangles)) if kept[f])
    corner = triangles[face][0]
    n = normals[face]
    k, m = next(
        (k, normals[g])
        for k, g in enumerate(neighbors[face])
        if kept[g] and normals[g] @ n < 0.999
    )
    ends = points[np.delete(triangles[face], k)]
    edge = unit(ends[1] - ends[0])
    t = rng.uniform(0.3, 0.7)
    n_edge = unit(t * n + (1.0 - t) * m)
    n_edge = unit(n_edge - (n_edge @ edge) * edge)
    middle = t * ends[0] + (1.0 - t) * ends[1]
    around = normals[[f for f, row in enumerate(triangles) if corner in row]]
    n_corner = unit(np.unique(around.round(9), axis=0).mean(axis=0))
    along = STIFF * np.outer(edge, edge)
    inner = np.array([0.5, 0.3, 0.2]) @ points[triangles[face]]
    nothing = np.zeros((3, 3))
    return [
        _site("face", inner, n, edge, STIFF * np.eye(3)),
        _site("edge", middle, n_edge, edge, along),
        _site("vertex", points[corner], n_corner, _some_tangent(n_corner), nothing),
        _site("edge of face", middle, n, edge, along),
        _site("vertex of face", points[corner], n, edge, nothing),
    ]


def _kept_triangles(shape, points, triangles):
    """Tell which triangles of the hull are triangles of the mesh itself, too."""
    if not isinstance(shape, Mesh):
        return np.ones(len(triangles), bool)
    vertices = np.asarray(shape.vertices) * np.asarray(shape.scale)
    own = {frozenset(map(tuple, vertices[row])) for row in np.asarray(shape.faces)}
    return np.array([frozenset(map(tuple, points[row])) in own for row in triangles])


def frame(site):
    """Return the orthonormal columns (tangent, normal x tangent, normal)."""
    t = site.tangent
    s = unit(np.cross(site.normal, t))
    return np.column_stack([np.cross(s, site.normal), s, site.normal])


def place(site_A, site_B, distance, roll):
    """Return X_AB with the sites facing each other; for roll 0 their tangents are parallel."""
    c, s = np.cos(roll), np.sin(roll)
    about_normal = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    R = frame(site_A) @ about_normal @ np.diag([1.0, -1.0, -1.0]) @ frame(site_B).T
    return pose(R, site_A.point + distance * site_A.normal - R @ site_B.point)


def gaps(shape_A, shape_B, X_AB, n):
    """Return the gaps between A and B along unit vectors n (..., 3), in A, that point out of B.

    A half space is taken to be straight across n, wherever n points.
    """
    R, p = X_AB[:3, :3], X_AB[:3, 3]
    if isinstance(shape_A, HalfSpace):
        return n @ (np.array([p[0], p[1], 0.0]) - p) - support(shape_B, n @ R)
    if isinstance(shape_B, HalfSpace):
        foot = R.T @ -p
        foot[2] = 0.0
        return -support(shape_A, -n) - n @ (R @ foot + p)
    return -(n @ p) - support(shape_A, -n) - support(shape_B, n @ R)


def is_shallowest(shape_A, shape_B, site_A, site_B, X_AB, depth, directions, margin=1.5):
    """Tell whether overlap by ``depth`` at the sites is the least of all directions.

    Locally by the bends, which have to exceed the depth ``margin`` times; elsewhere by a search
    from ``directions``, the normals of all faces and the axes.
    """
    n = -site_A.normal
    R = X_AB[:3, :3]
    basis = frame(site_A)[:, :2]
    bend = basis.T @ (site_A.bend + R @ site_B.bend @ R.T) @ basis
    if np.linalg.eigvalsh(bend)[0] <= margin * depth:
        return False
    if isinstance(shape_A, HalfSpace) or isinstance(shape_B, HalfSpace):
        return True
    trial = np.vstack([directions, _normals(shape_B) @ R.T, -_normals(shape_A)])
    if best_gap(shape_A, shape_B, X_AB, trial)[0] > -depth * (1.0 - 1e-9):
        return False
    return _best_tilt(shape_A, shape_B, X_AB, n, basis) <= -depth * (1.0 - 1e-9)


def _best_tilt(shape_A, shape_B, X_AB, n, basis):
    """Return the largest gap along turned normals: a star of turns of all sizes, then climbing."""
    angle, reach = np.meshgrid(
        np.linspace(0.0, 2.0 * np.pi, 16, endpoint=False), 10.0 ** np.arange(-5.0, 0.5, 0.28)
    )
    tilts = np.stack([reach * np.cos(angle), reach * np.sin(angle)], axis=-1).reshape(-1, 2)
    step = reach.ravel()

    def values(t):
        r = np.linalg.norm(t, axis=-1)[..., None]
        return gaps(shape_A, shape_B, X_AB, np.cos(r) * n + np.sinc(r / np.pi) * (t @ basis.T))

    best = values(tilts)
    start = np.argsort(best)[-4:]
    tilts, best, step = tilts[start], best[start], 0.3 * step[start]
    compass = np.array([[1, 0], [0, 1], [-1, 0], [0, -1], [1, 1], [-1, 1], [-1, -1], [1, -1]])
    rows = np.arange(len(tilts))
    for _ in range(24):
        around = tilts[:, None] + step[:, None, None] * compass
        found = values(around)
        k = found.argmax(axis=1)
        better = found[rows, k] > best
        tilts = np.where(better[:, None], around[rows, k], tilts)
        best = np.where(better, found[rows, k], best)
        step = np.where(better, step, 0.5 * step)
    return best.max()


def best_gap(shape_A, shape_B, X_AB, directions, rounds=16):
    """Return the largest gap found from ``directions`` on by climbing at random, and its normal.

    Every gap is a lower bound of the signed distance, so a depth with a larger one is wrong.
    """
    rng = np.random.default_rng(3)
    values = gaps(shape_A, shape_B, X_AB, directions)
    order = np.argsort(values)[-6:]
    n, best = directions[order], values[order]
    radius = 0.2
    for _ in range(rounds):
        trial = n[:, None] + radius * rng.normal(size=(len(n), 8, 3))
        trial /= np.linalg.norm(trial, axis=2)[:, :, None]
        values = gaps(shape_A, shape_B, X_AB, trial)
        k = values.argmax(axis=1)
        rows = np.arange(len(n))
        better = values[rows, k] > best
        n = np.where(better[:, None], trial[rows, k], n)
        best = np.where(better, values[rows, k], best)
        radius *= 0.6
    return float(best.max()), n[best.argmax()]


def _normals(shape):
    if isinstance(shape, Cylinder):
        return np.array([_Z, -_Z])
    if isinstance(shape, Sphere | Capsule):
        return np.zeros((0, 3))
    if isinstance(shape, Box | Ellipsoid):
        return np.vstack([np.eye(3), -np.eye(3)])
    return faces_of(shape)[1]
