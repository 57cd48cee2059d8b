"""Bodies for tests of distances: numpy support functions, surfaces and contact sites of shapes.

Everything here is written independently of the kernels: a support function is the largest
``d @ x`` over the body, ``outside`` is positive beyond the surface, and a site is a point of the
surface with an outward normal, known by construction.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

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
from scene_graph_ros.geometry.narrowphase.convex_distance import convex_distance
from scene_graph_ros.geometry.query.distance.dispatch import core_of
from scene_graph_ros.geometry.query.distance.driver import solve_pairs, WITHIN
from scene_graph_ros.geometry.query.distance.solved_pairs import NO_FAILURE
from scene_graph_ros.geometry.tables.held_table import hold
from scene_graph_ros.geometry.tables.shape_table import build_shape_table

__all__ = [
    "Answer",
    "Site",
    "align",
    "answer",
    "answer_convex",
    "outside",
    "pose",
    "residuals",
    "separation",
    "sites",
    "support",
]


class Answer(NamedTuple):
    """The result for a pair, every vector in A's frame."""

    distance: float
    p_ACa: np.ndarray
    p_ACb: np.ndarray
    nhat_BA_A: np.ndarray
    unique: bool
    gap: float


class Site(NamedTuple):
    """A point of a surface, an outward unit normal there, and what kind of feature it is."""

    feature: str
    point: np.ndarray
    normal: np.ndarray


def pose(rotation, position):
    """Return the (4, 4) pose of a scipy Rotation or a matrix, and a position."""
    X = np.eye(4)
    X[:3, :3] = rotation.as_matrix() if isinstance(rotation, Rotation) else rotation
    X[:3, 3] = position
    return X


def points_of(shape):
    """Return the corners of a shape that has corners."""
    if isinstance(shape, Box):
        half = 0.5 * np.array([shape.width, shape.depth, shape.height])
        return np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * half
    return np.asarray(shape.vertices) * np.asarray(shape.scale)


def support(shape, d):
    """Return the largest ``d @ x`` over the shape for directions d (..., 3)."""
    d = np.asarray(d, float)
    if isinstance(shape, Sphere):
        return shape.radius * np.linalg.norm(d, axis=-1)
    if isinstance(shape, Capsule):
        return shape.radius * np.linalg.norm(d, axis=-1) + 0.5 * shape.length * abs(d[..., 2])
    if isinstance(shape, Cylinder):
        radial = np.hypot(d[..., 0], d[..., 1])
        return shape.radius * radial + 0.5 * shape.length * abs(d[..., 2])
    if isinstance(shape, Ellipsoid):
        return np.linalg.norm(d * [shape.a, shape.b, shape.c], axis=-1)
    return (d @ points_of(shape).T).max(axis=-1)


def outside(shape, x):
    """Return a lower bound of how far x is beyond the shape's surface (negative inside)."""
    x = np.asarray(x, float)
    if isinstance(shape, Sphere):
        return np.linalg.norm(x) - shape.radius
    if isinstance(shape, Capsule):
        z = np.clip(x[2], -0.5 * shape.length, 0.5 * shape.length)
        return np.linalg.norm(x - [0, 0, z]) - shape.radius
    if isinstance(shape, Cylinder):
        return max(np.hypot(x[0], x[1]) - shape.radius, abs(x[2]) - 0.5 * shape.length)
    if isinstance(shape, Ellipsoid):
        axes = np.array([shape.a, shape.b, shape.c])
        length = np.linalg.norm(x / axes)
        slope = np.linalg.norm(x / axes**2)
        return (length - 1.0) * length / slope if slope > 0.0 else -axes.min()
    if isinstance(shape, HalfSpace):
        return x[2]
    planes = ConvexHull(points_of(shape)).equations
    return (planes[:, :3] @ x + planes[:, 3]).max()


def separation(shape_A, shape_B, X_AB, n):
    """Return the gap between A and B along directions n (..., 3) that point out of B."""
    n = np.asarray(n, float)
    offset = -(n @ X_AB[:3, 3])
    if isinstance(shape_B, HalfSpace):
        return offset - support(shape_A, -n)
    return offset - support(shape_A, -n) - support(shape_B, n @ X_AB[:3, :3])


def sites(shape, rng):
    """Return contact sites of a shape: one of each kind of feature it has."""
    if isinstance(shape, Sphere):
        n = unit(rng.normal(size=3))
        return [Site("smooth", shape.radius * n, n)]
    if isinstance(shape, HalfSpace):
        return [Site("face", np.array([*rng.normal(size=2), 0.0]), np.array([0.0, 0.0, 1.0]))]
    if isinstance(shape, Ellipsoid):
        axes = np.array([shape.a, shape.b, shape.c])
        n = unit(rng.normal(size=3))
        return [Site("smooth", axes**2 * n / np.linalg.norm(axes * n), n)]
    if isinstance(shape, Capsule | Cylinder):
        half = 0.5 * shape.length
        angle = rng.uniform(0.0, 2.0 * np.pi)
        radial = np.array([np.cos(angle), np.sin(angle), 0.0])
        z = np.array([0.0, 0.0, 1.0])
        side = Site("side", shape.radius * radial + 0.3 * half * z, radial)
        if isinstance(shape, Capsule):
            n = unit(radial + rng.uniform(0.2, 2.0) * z)
            return [side, Site("smooth", half * z + shape.radius * n, n)]
        cap = Site("face", half * z + 0.4 * shape.radius * radial, z)
        n = unit(radial + rng.uniform(0.3, 2.0) * z)
        return [side, cap, Site("rim", half * z + shape.radius * radial, n)]
    return corner_sites(points_of(shape))


def corner_sites(points):
    """Return a face, an edge and a vertex site of the convex hull of points."""
    hull = ConvexHull(points)
    face = hull.simplices[0]
    normal = hull.equations[0, :3]
    weights = np.array([0.5, 0.3, 0.2])
    found = [Site("face", weights @ points[face], normal)]
    for k, other in enumerate(hull.neighbors[0]):
        m = hull.equations[other, :3]
        if normal @ m < 0.99:
            edge = np.delete(face, k)
            n = unit(0.6 * normal + 0.4 * m)
            found.append(Site("edge", np.array([0.6, 0.4]) @ points[edge], n))
            break
    corner = face[0]
    around = [hull.equations[f, :3] for f, s in enumerate(hull.simplices) if corner in s]
    found.append(Site("vertex", points[corner], unit(np.mean(np.unique(around, axis=0), axis=0))))
    return found


def unit(v):
    """Return v / |v|."""
    return np.asarray(v) / np.linalg.norm(v)


def align(site_A, site_B, distance, roll):
    """Return X_AB that puts B's site ``distance`` beyond A's, tangent planes parallel."""
    # Any rotation that turns B's normal into the opposite of A's; then a roll about that.
    turn, _ = Rotation.align_vectors([-site_A.normal], [site_B.normal])
    R = (Rotation.from_rotvec(roll * site_A.normal) * turn).as_matrix()
    # align_vectors is good to 1e-8 in places: make the turn exact to rounding.
    R = Rotation.from_matrix(exact_turn(R @ site_B.normal, -site_A.normal) @ R).as_matrix()
    p = site_A.point + distance * site_A.normal - R @ site_B.point
    return pose(R, p)


def exact_turn(u, v):
    """Return the rotation of least angle that takes the unit vector u to v, for a small angle."""
    w = np.cross(u, v)
    W = np.array([[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]])
    return np.eye(3) + W + W @ W / (1.0 + u @ v)


def answer_convex(shape_A, shape_B, X_AB, max_distance=np.inf):
    """Return the general convex algorithm's Answer, whatever closed forms there are."""
    table = build_shape_table([shape_A, shape_B], [False, False])
    R = tuple(float(x) for x in X_AB[:3, :3].ravel())
    p = tuple(float(x) for x in X_AB[:3, 3])
    phi, a, b, n, unique, gap, _ = convex_distance(
        plain_core(table, 0),
        plain_core(table, 1),
        R,
        p,
        table.hulls.blocks,
        float(max_distance),
        0.0,
    )
    return Answer(phi, np.array(a), np.array(b), np.array(n), unique, gap)


def plain_core(table, row):
    """Return a row's core with Python numbers, so that one compiled signature serves all."""
    read = getattr(core_of, "py_func", core_of)
    kind, hull, radius, params = read(table, row)
    return int(kind), int(hull), float(radius), tuple(float(x) for x in params)


def answer(shape_A, shape_B, X_AB, *, X_WA=None, max_distance=np.inf):
    """Return what the dispatch answers, vectors taken back to A's frame from a world frame."""
    X_WA = np.eye(4) if X_WA is None else X_WA
    table = build_shape_table([shape_A, shape_B], [False, False])
    X_WG = np.ascontiguousarray([X_WA, X_WA @ X_AB])
    pairs = np.array([[0, 1]])
    solved = solve_pairs(hold(table), X_WG, pairs, float(max_distance), WITHIN)
    assert solved.failed == NO_FAILURE
    X_AB = relative(X_WA, X_WA @ X_AB)
    return Answer(
        solved.distance[0],
        solved.p_ACa[0],
        X_AB[:3, :3] @ solved.p_BCb[0] + X_AB[:3, 3],
        X_WA[:3, :3].T @ solved.nhat_BA_W[0],
        bool(solved.is_unique[0]),
        solved.gap[0],
    )


def relative(X_WA, X_WB):
    """Return X_AB, subtracting positions first."""
    R_AW = X_WA[:3, :3].T
    return pose(R_AW @ X_WB[:3, :3], R_AW @ (X_WB[:3, 3] - X_WA[:3, 3]))


def residuals(shape_A, shape_B, X_AB, result):
    """Return by how far a result violates what must hold for every pair (all should be ~0, m).

    Keys: ``unit`` of the normal, ``identity`` p_ACa - p_ACb = distance nhat, ``outside_A`` and
    ``outside_B`` of the witnesses, ``separation``: the gap along the normal is the distance. For
    bodies apart these together prove the distance, for overlapping ones that it is stationary.
    """
    R, p = X_AB[:3, :3], X_AB[:3, 3]
    n = result.nhat_BA_A
    rest = result.p_ACa - result.p_ACb - result.distance * n
    return {
        "unit": abs(np.linalg.norm(n) - 1.0),
        "identity": np.linalg.norm(rest),
        "outside_A": max(outside(shape_A, result.p_ACa), 0.0),
        "outside_B": max(outside(shape_B, R.T @ (result.p_ACb - p)), 0.0),
        "separation": abs(separation(shape_A, shape_B, X_AB, n) - result.distance),
    }


def tetrahedron_mesh(size):
    """Return a closed Mesh: a corner tetrahedron of edge ``size``."""
    vertices = size * np.vstack([np.zeros((1, 3)), np.eye(3)])
    faces = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])
    return Mesh(vertices=vertices, faces=faces)


def rounded_hull(size, count, seed=2):
    """Return a Convex of ``count`` points on an ellipsoid of extents about ``size``."""
    points = np.random.default_rng(seed).normal(size=(count, 3))
    points /= np.linalg.norm(points, axis=1)[:, None]
    return Convex(vertices=points * size * np.array([0.5, 0.4, 0.3]))
