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

from hard_corpus.bodies import corners, extent, faces_of, support
from scene_graph_ros.geometry import (
    Box,
    Capsule,
    Convex,
    Cylinder,
    Ellipsoid,
    HalfSpace,
    Mesh,
    Sphere,
)

__all__ = [
    "STIFF",
    "Site",
    "are_shallowest",
    "best_gap",
    "gaps",
    "place",
    "pose",
    "sites_of",
    "unit",
]

STIFF = 1e6
MOST_PRODUCTS = 5_000_000
"""Of directions with corners, at once."""

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
    v = np.asarray(v, float)
    return v / np.sqrt(v @ v)


def _cross(a, b):
    """Return a x b of two vectors; numpy's is made for arrays of them, and takes longer."""
    return np.array(
        [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    )


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
    around = _cross(_Z, radial)
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
    s = unit(_cross(site.normal, site.tangent))
    return np.array([_cross(s, site.normal), s, site.normal]).T


def place(site_A, site_B, distance, roll):
    """Return X_AB with the sites facing each other; for roll 0 their tangents are parallel."""
    c, s = np.cos(roll), np.sin(roll)
    # About the normal, then half a turn about the tangent.
    turn = np.array([[c, s, 0.0], [s, -c, 0.0], [0.0, 0.0, -1.0]])
    R = frame(site_A) @ turn @ frame(site_B).T
    return pose(R, site_A.point + distance * site_A.normal - R @ site_B.point)


def gaps(shape_A, shape_B, X_AB, n):
    """Return the gaps between A and B along unit vectors n (..., 3), in A, that point out of B.

    Of several poses X_AB (m, 4, 4), each with its own n (m, k, 3), the gaps (m, k). A half space
    is taken to be straight across n, wherever n points.
    """
    R, p = X_AB[..., :3, :3], X_AB[..., :3, 3]
    if isinstance(shape_A, HalfSpace):
        return _along(n, p * [1.0, 1.0, 0.0] - p) - support(shape_B, n @ R)
    if isinstance(shape_B, HalfSpace):
        foot = -_along(R.swapaxes(-1, -2), p) * [1.0, 1.0, 0.0]
        return -support(shape_A, -n) - _along(n, _along(R, foot) + p)
    return -_along(n, p) - support(shape_A, -n) - support(shape_B, n @ R)


def _along(n, p):
    """Return n @ p for rows n (..., 3); of (m, 3) points each with its own rows (m, k, 3)."""
    return (n @ p[..., None])[..., 0]


def are_shallowest(shape_A, shape_B, sites, X_AB, depth, directions, margin=1.5):
    """Tell of which overlaps by ``depth`` at the sites that is the least of all directions.

    Locally by the bends, which have to exceed the depth ``margin`` times; elsewhere by a search
    from ``directions``, the normals of all faces and the axes.

    Args:
        shape_A: in contact at the first site of each pair.
        shape_B: at the second.
        sites: (m,) pairs.
        X_AB: (m, 4, 4).
        depth: metres.
        directions: (k, 3).
        margin: see above.

    """
    R = X_AB[:, :3, :3]
    basis = np.array([frame(site_A)[:, :2] for site_A, _ in sites])
    bend_A, bend_B = (np.array([pair[k].bend for pair in sites]) for k in (0, 1))
    bend = basis.swapaxes(1, 2) @ (bend_A + R @ bend_B @ R.swapaxes(1, 2)) @ basis
    found = np.linalg.eigvalsh(bend)[:, 0] > margin * depth
    if isinstance(shape_A, HalfSpace) or isinstance(shape_B, HalfSpace):
        return found
    rounding = 16.0 * np.finfo(float).eps * (extent(shape_A) + extent(shape_B))
    bound = rounding - depth * (1.0 - 1e-9)
    of_both = np.vstack([directions, -_normals(shape_A)])
    of_B = _normals(shape_B)
    # Of hulls with thousands of corners one case fills the memory that a hundred others take.
    products = (len(of_both) + len(of_B)) * max(_corner_count(shape_A), _corner_count(shape_B))
    together = max(1, MOST_PRODUCTS // products)
    candidates = np.flatnonzero(found)
    for rows in np.split(candidates, range(together, len(candidates), together)):
        trial = np.concatenate(
            [
                np.broadcast_to(of_both, (len(rows), *of_both.shape)),
                of_B @ R[rows].swapaxes(1, 2),
            ],
            axis=1,
        )
        found[rows] = best_gap(shape_A, shape_B, X_AB[rows], trial)[0] <= bound
    for rows in np.split(np.flatnonzero(found), range(together, found.sum(), together)):
        n = np.array([-sites[row][0].normal for row in rows]).reshape(-1, 3)
        found[rows] = _best_tilt(shape_A, shape_B, X_AB[rows], n, basis[rows]) <= bound
    return found


def _best_tilt(shape_A, shape_B, X_AB, n, basis):
    """Return the largest gap along turned normals: a star of turns of all sizes, then climbing.

    Of poses (m, 4, 4), with the normals n (m, 3) and two columns (m, 3, 2) across them.
    """
    angle, reach = np.meshgrid(
        np.linspace(0.0, 2.0 * np.pi, 16, endpoint=False), 10.0 ** np.arange(-5.0, 0.5, 0.28)
    )
    tilts = np.stack([reach * np.cos(angle), reach * np.sin(angle)], axis=-1).reshape(-1, 2)
    step = np.broadcast_to(reach.ravel(), (len(n), reach.size))
    tilts = np.broadcast_to(tilts, (len(n), *tilts.shape))

    def values(t):
        r = np.linalg.norm(t, axis=-1)[..., None]
        across = t @ basis.swapaxes(1, 2)
        return gaps(shape_A, shape_B, X_AB, np.cos(r) * n[:, None] + np.sinc(r / np.pi) * across)

    best = values(tilts)
    start = np.argsort(best)[:, -4:]
    tilts, best, step = _taken(tilts, start), _taken(best, start), 0.3 * _taken(step, start)
    compass = np.array([[1, 0], [0, 1], [-1, 0], [0, -1], [1, 1], [-1, 1], [-1, -1], [1, -1]])
    for _ in range(24):
        around = tilts[:, :, None] + step[:, :, None, None] * compass
        count = tilts.shape[1] * len(compass)
        found = values(around.reshape(-1, count, 2)).reshape(around.shape[:-1])
        is_better, tilts, best = _climbed(tilts, best, around, found)
        step = np.where(is_better, step, 0.5 * step)
    return best.max(axis=1)


def best_gap(shape_A, shape_B, X_AB, directions, rounds=16):
    """Return the largest gap found from ``directions`` on by climbing at random, and its normal.

    Every gap is a lower bound of the signed distance, so a depth with a larger one is wrong. Of
    several poses (m, 4, 4), each with its own directions (m, k, 3), each one's.
    """
    rng = np.random.default_rng(3)
    values = gaps(shape_A, shape_B, X_AB, directions)
    order = np.argsort(values)[..., -6:]
    n, best = _taken(directions, order), _taken(values, order)
    radius = 0.2
    for _ in range(rounds):
        trial = n[..., None, :] + radius * rng.normal(size=(n.shape[-2], 8, 3))
        trial /= np.linalg.norm(trial, axis=-1)[..., None]
        flat = trial.reshape(*n.shape[:-2], -1, 3)
        values = gaps(shape_A, shape_B, X_AB, flat).reshape(trial.shape[:-1])
        _, n, best = _climbed(n, best, trial, values)
        radius *= 0.6
    return best.max(axis=-1), _taken(n, best.argmax(axis=-1)[..., None])[..., 0, :]


def _taken(rows, chosen):
    """Return the chosen rows (..., c) of (..., k), or of vectors (..., k, d)."""
    if rows.ndim == chosen.ndim:
        return np.take_along_axis(rows, chosen, axis=-1)
    return np.take_along_axis(rows, chosen[..., None], axis=-2)


def _climbed(places, best, trial, values):
    """Return which places (..., d) have a better one among trials (..., 8, d), and the best."""
    k = values.argmax(axis=-1)[..., None]
    found = _taken(values, k)[..., 0]
    is_better = found > best
    there = _taken(trial, k)[..., 0, :]
    return (
        is_better,
        np.where(is_better[..., None], there, places),
        np.where(is_better, found, best),
    )


def _corner_count(shape):
    return len(corners(shape)) if isinstance(shape, Box | Convex | Mesh) else 1


def _normals(shape):
    if isinstance(shape, Cylinder):
        return np.array([_Z, -_Z])
    if isinstance(shape, Sphere | Capsule):
        return np.zeros((0, 3))
    if isinstance(shape, Box | Ellipsoid):
        return np.vstack([np.eye(3), -np.eye(3)])
    return faces_of(shape)[1]
