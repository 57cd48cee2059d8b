"""Plain numpy facts about shapes: support values, containment, corners. Nothing of the product."""

import functools

import numpy as np
from scipy.spatial import ConvexHull

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
    "closed_mesh",
    "corners",
    "dented_mesh",
    "extent",
    "faces_of",
    "outside",
    "rescaled",
    "scattered_hull",
    "support",
]

_SIGNS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
_corners = {}
_faces = {}
_planes = {}


def corners(shape):
    """Return the (n, 3) points whose hull a box, hull or mesh is."""
    key = shape
    if key not in _corners:
        if isinstance(shape, Box):
            _corners[key] = 0.5 * _SIGNS * [shape.width, shape.depth, shape.height]
        else:
            points = np.asarray(shape.vertices) * np.asarray(shape.scale)
            if len(points) > 50:
                points = points[ConvexHull(points).vertices]
            _corners[key] = points
    return _corners[key]


def faces_of(shape):
    """Return a polytope's triangles as (m, 3) rows of ``corners``, (m, 3) normals, (m,) offsets.

    The normals come from cross products of sides, qhull only says which corners make a triangle.
    """
    if shape not in _faces:
        points = corners(shape)
        hull = ConvexHull(points)
        a, b, c = (points[hull.simplices[:, k]] for k in range(3))
        normals = np.cross(b - a, c - a)
        normals /= np.linalg.norm(normals, axis=1)[:, None]
        inwards = np.einsum("ij,ij->i", normals, hull.equations[:, :3]) < 0.0
        normals[inwards] *= -1.0
        offsets = (normals @ points.T).max(axis=1)
        _faces[shape] = hull.simplices, normals, offsets, hull.neighbors
    return _faces[shape]


def support(shape, d):
    """Return the largest ``d @ x`` over a finite shape, for directions (..., 3)."""
    if isinstance(shape, Sphere):
        return shape.radius * np.linalg.norm(d, axis=-1)
    if isinstance(shape, Capsule):
        return shape.radius * np.linalg.norm(d, axis=-1) + 0.5 * shape.length * abs(d[..., 2])
    if isinstance(shape, Cylinder):
        radial = np.hypot(d[..., 0], d[..., 1])
        return shape.radius * radial + 0.5 * shape.length * abs(d[..., 2])
    if isinstance(shape, Ellipsoid):
        return np.linalg.norm(d * [shape.a, shape.b, shape.c], axis=-1)
    return (d @ corners(shape).T).max(axis=-1)


def outside(shape, x):
    """Return how far the point x is off the surface, to first order there; negative inside."""
    if isinstance(shape, HalfSpace):
        return x[2]
    if isinstance(shape, Sphere):
        return np.linalg.norm(x) - shape.radius
    if isinstance(shape, Capsule):
        z = x[2] - min(max(x[2], -0.5 * shape.length), 0.5 * shape.length)
        return np.sqrt(x[0] ** 2 + x[1] ** 2 + z**2) - shape.radius
    if isinstance(shape, Cylinder):
        return max(np.hypot(x[0], x[1]) - shape.radius, abs(x[2]) - 0.5 * shape.length)
    if isinstance(shape, Ellipsoid):
        axes = np.array([shape.a, shape.b, shape.c])
        length = np.linalg.norm(x / axes)
        slope = np.linalg.norm(x / axes**2)
        return (length - 1.0) * length / slope if slope > 0.0 else -axes.min()
    if isinstance(shape, Box):
        return np.max(np.abs(x) - 0.5 * np.array([shape.width, shape.depth, shape.height]))
    if _plane_of(shape) is not None:
        return _off_flat(shape, x)
    _, normals, offsets, _ = faces_of(shape)
    return np.max(normals @ x - offsets)


def _plane_of(shape):
    """Return points without volume as (middle, (3, 3) axes, rank, outline); None with volume.

    The outline holds rows (n, offset) with n @ y <= offset in the first ``rank`` axes.
    """
    if shape not in _planes:
        points = corners(shape)
        middle = points.mean(axis=0)
        _, spread, axes = np.linalg.svd(points - middle)
        rank = int(np.sum(spread > 1e-14 * max(spread[0], np.abs(points).max())))
        local = (points - middle) @ axes.T
        outline = np.zeros((0, rank + 1))
        if rank == 1:
            outline = np.array([[1.0, local[:, 0].max()], [-1.0, -local[:, 0].min()]])
        if rank == 2:
            outline = ConvexHull(local[:, :2]).equations * [1.0, 1.0, -1.0]
        _planes[shape] = None if rank == 3 else (middle, axes, rank, outline)
    return _planes[shape]


def _off_flat(shape, x):
    """Return how far x is from a polygon, segment or point, at least to first order; 0 on it."""
    middle, axes, rank, outline = _plane_of(shape)
    y = axes @ (x - middle)
    beyond = outline[:, :rank] @ y[:rank] - outline[:, rank]
    return max(np.linalg.norm(y[rank:]), *beyond, 0.0)


@functools.lru_cache(maxsize=100_000)
def extent(shape):
    """Return the size L of a shape: its largest extent along its axes, 0 if it is infinite."""
    if isinstance(shape, HalfSpace):
        return 0.0
    axes = np.eye(3)
    return float(np.max(support(shape, axes) + support(shape, -axes)))


def rescaled(shape, factor):
    """Return the shape, ``factor`` times as large."""
    if isinstance(shape, HalfSpace):
        return shape
    if isinstance(shape, Convex):
        return Convex(vertices=factor * np.asarray(shape.vertices), scale=shape.scale)
    if isinstance(shape, Mesh):
        vertices = factor * np.asarray(shape.vertices)
        return Mesh(vertices=vertices, faces=shape.faces, scale=shape.scale)
    names = {
        Sphere: ("radius",),
        Capsule: ("radius", "length"),
        Box: ("width", "depth", "height"),
        Cylinder: ("radius", "length"),
        Ellipsoid: ("a", "b", "c"),
    }[type(shape)]
    return type(shape)(*(factor * getattr(shape, name) for name in names))


def scattered_points(count, seed, stretch=(1.0, 0.8, 0.7)):
    """Return points scattered on an ellipsoid about the origin, all corners of their hull."""
    points = np.random.default_rng(seed).normal(size=(count, 3))
    return points / np.linalg.norm(points, axis=1)[:, None] * stretch


@functools.cache
def scattered_hull(size, count, seed=5):
    """Return a Convex with ``count`` corners and an extent of exactly ``size``."""
    return Convex(vertices=_sized(scattered_points(count, seed), size))


@functools.cache
def closed_mesh(size, count, seed=6):
    """Return a convex closed Mesh of triangles that face outwards."""
    points = _sized(scattered_points(count, seed), size)
    return Mesh(vertices=points, faces=_outward(points, ConvexHull(points).simplices))


@functools.cache
def dented_mesh(size, count, seed=6):
    """Return ``closed_mesh`` with its last triangle pushed in to the middle: not convex."""
    mesh = closed_mesh(size, count, seed)
    points, faces = np.asarray(mesh.vertices), np.asarray(mesh.faces)
    a, b, c = faces[-1]
    tip = len(points)
    points = np.vstack([points, 0.3 * points[[a, b, c]].mean(axis=0)])
    return Mesh(
        vertices=points, faces=np.vstack([faces[:-1], [[a, b, tip], [b, c, tip], [c, a, tip]]])
    )


def _sized(points, size):
    return points * (size / np.ptp(points, axis=0).max())


def _outward(points, triangles):
    a, b, c = (points[triangles[:, k]] for k in range(3))
    inwards = np.einsum("ij,ij->i", np.cross(b - a, c - a), a) < 0.0
    return np.where(inwards[:, None], triangles[:, ::-1], triangles)
