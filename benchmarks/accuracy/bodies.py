"""Shapes of about 20 cm in numpy: their support functions, and points of their surfaces.

Written independently of the core: nothing here calls its kernels.
"""

from __future__ import annotations

from collections.abc import Callable
import functools
from typing import Any, NamedTuple

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
    "FEATURES",
    "KINDS",
    "Site",
    "corners",
    "draw",
    "edge_directions",
    "face_normals",
    "pit",
    "site",
    "size",
    "support",
]

KINDS = ("Sphere", "Capsule", "Box", "Cylinder", "Ellipsoid", "HalfSpace", "Convex", "Mesh")
"""The eight shapes, in the order of ``ShapeKind``."""

FEATURES = {
    "Sphere": ("smooth",),
    "Capsule": ("side", "smooth"),
    "Box": ("face", "edge", "vertex"),
    "Cylinder": ("side", "face", "rim"),
    "Ellipsoid": ("smooth",),
    "HalfSpace": ("face",),
    "Convex": ("face", "edge", "vertex"),
    "Mesh": ("face", "edge", "vertex"),
}
"""What of a shape can be nearest."""

_CORNERS = 12
_PIT = 0.3
"""Depth of a mesh's pit, as a part of the distance from its centre to the pit's face."""


class Site(NamedTuple):
    """A point of a surface, an outward unit normal there, and a direction along the feature.

    The direction is the edge's, the axis', or the rim's tangent; on a face that of one of its
    edges. It is at right angles to the normal.
    """

    feature: str
    point: np.ndarray
    normal: np.ndarray
    tangent: np.ndarray


def _unit(v: np.ndarray) -> np.ndarray:
    return v / np.linalg.norm(v)


def _across(normal: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Return the unit vector of v's part at right angles to the normal."""
    return _unit(v - (v @ normal) * normal)


def _hull_points(rng: np.random.Generator) -> np.ndarray:
    """Return points of a round polytope, or of a prism, whose faces are polygons."""
    if rng.random() < 0.5:
        radii = rng.uniform(0.09, 0.11, (_CORNERS, 1))
        directions = rng.normal(size=(_CORNERS, 3))
        return radii * directions / np.linalg.norm(directions, axis=1, keepdims=True)
    angles = np.linspace(0.0, 2.0 * np.pi, 5, endpoint=False) + rng.uniform(0.0, 1.0)
    ring = 0.1 * np.column_stack([np.cos(angles), np.sin(angles)])
    half = rng.uniform(0.07, 0.1)
    return np.array([[*p, z] for z in (-half, half) for p in ring])


def _oriented_triangles(points: np.ndarray) -> np.ndarray:
    """Return the hull's triangles (t, 3), counter-clockwise seen from outside."""
    return _triangles_of(points.tobytes())


@functools.lru_cache(maxsize=16)
def _triangles_of(data: bytes) -> np.ndarray:
    points = np.frombuffer(data).reshape(-1, 3)
    hull = ConvexHull(points)
    triangles = hull.simplices.copy()
    a, b, c = (points[triangles[:, k]] for k in range(3))
    inward = np.einsum("ij,ij->i", np.cross(b - a, c - a), hull.equations[:, :3]) < 0.0
    triangles[inward] = triangles[inward][:, [0, 2, 1]]
    return triangles


def _pitted_mesh(rng: np.random.Generator) -> Mesh:
    """Return a closed mesh: a polytope with a pit, so that it is not its own hull."""
    points = _hull_points(rng)
    triangles = _oriented_triangles(points)
    a, b, c = triangles[0]
    apex = (1.0 - _PIT) * points[[a, b, c]].mean(axis=0)
    k = len(points)
    faces = np.vstack([triangles[1:], [[a, b, k], [b, c, k], [c, a, k]]])
    return Mesh(vertices=np.vstack([points, apex]), faces=faces)


def pit(mesh: Mesh) -> np.ndarray:
    """Return the corners (4, 3) of the tetrahedron that is missing in a mesh of ``draw``."""
    faces = np.asarray(mesh.faces)[-3:]
    return np.asarray(mesh.vertices)[[*faces[:, 0], faces[0, 2]]]


def draw(kind: str, rng: np.random.Generator) -> Any:
    """Return a shape of the kind, each of its extents between 14 and 22 cm."""
    a, b, c = rng.uniform(0.07, 0.11, 3)
    makers: dict[str, Callable[[], Any]] = {
        "Sphere": lambda: Sphere(a),
        "Capsule": lambda: Capsule(0.6 * a, b),
        "Box": lambda: Box(2 * a, 2 * b, 2 * c),
        "Cylinder": lambda: Cylinder(a, 2 * b),
        "Ellipsoid": lambda: Ellipsoid(a, b, c),
        "HalfSpace": HalfSpace,
        "Convex": lambda: Convex(vertices=_hull_points(rng)),
        "Mesh": lambda: _pitted_mesh(rng),
    }
    return makers[kind]()


def corners(shape: Any) -> np.ndarray:
    """Return the corners (n, 3) of a polytope; a mesh's are those of its hull."""
    if isinstance(shape, Box):
        half = 0.5 * np.array([shape.width, shape.depth, shape.height])
        return np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * half
    return np.asarray(shape.vertices)


def size(shape: Any) -> float:
    """Return the largest extent (m) along the shape's axes; 0 of a half space."""
    if isinstance(shape, HalfSpace):
        return 0.0
    axes = np.eye(3)
    return float((support(shape, axes) + support(shape, -axes)).max())


def face_normals(shape: Any) -> np.ndarray:
    """Return the outward normals (n, 3) of a polytope's triangles; none of a round shape."""
    if not isinstance(shape, Box | Convex | Mesh):
        return np.empty((0, 3))
    points = corners(shape)
    return _normals(points, _oriented_triangles(points))


def edge_directions(shape: Any) -> np.ndarray:
    """Return directions (n, 3) of all straight edges, of a polytope or of a capsule's core."""
    if isinstance(shape, Capsule):
        return np.array([[0.0, 0.0, 1.0]])
    if not isinstance(shape, Box | Convex | Mesh):
        return np.empty((0, 3))
    points = corners(shape)
    triangles = _oriented_triangles(points)
    pairs = np.sort(
        np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    )
    ends = points[np.unique(pairs, axis=0)]
    return ends[:, 1] - ends[:, 0]


def support(shape: Any, d: np.ndarray) -> np.ndarray:
    """Return the largest ``d . x`` over the shape's hull, for directions (..., 3)."""
    if isinstance(shape, Sphere):
        return shape.radius * np.linalg.norm(d, axis=-1)
    if isinstance(shape, Capsule):
        return shape.radius * np.linalg.norm(d, axis=-1) + 0.5 * shape.length * np.abs(d[..., 2])
    if isinstance(shape, Cylinder):
        radial = np.hypot(d[..., 0], d[..., 1])
        return shape.radius * radial + 0.5 * shape.length * np.abs(d[..., 2])
    if isinstance(shape, Ellipsoid):
        return np.linalg.norm(d * np.array([shape.a, shape.b, shape.c]), axis=-1)
    return (d @ corners(shape).T).max(axis=-1)


def site(shape: Any, feature: str, rng: np.random.Generator) -> Site:
    """Return a random point of one of the shape's features with one of its normals."""
    if isinstance(shape, Sphere):
        n = _unit(rng.normal(size=3))
        return Site(feature, shape.radius * n, n, _across(n, rng.normal(size=3)))
    if isinstance(shape, Ellipsoid):
        axes = np.array([shape.a, shape.b, shape.c])
        n = _unit(rng.normal(size=3))
        point = axes**2 * n / np.linalg.norm(axes * n)
        return Site(feature, point, n, _across(n, rng.normal(size=3)))
    if isinstance(shape, HalfSpace):
        point = np.array([*rng.uniform(-0.3, 0.3, 2), 0.0])
        return Site(feature, point, np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0]))
    if isinstance(shape, Capsule | Cylinder):
        return _site_of_revolution(shape, feature, rng)
    points = corners(shape)
    triangles = _oriented_triangles(points)
    if isinstance(shape, Mesh):
        triangles = _without_pit(points, triangles, pit(shape))
    return _site_of_polytope(points, triangles, feature, rng)


def _site_of_revolution(shape: Any, feature: str, rng: np.random.Generator) -> Site:
    half, r = 0.5 * shape.length, shape.radius
    angle = rng.uniform(0.0, 2.0 * np.pi)
    radial = np.array([np.cos(angle), np.sin(angle), 0.0])
    around = np.array([-np.sin(angle), np.cos(angle), 0.0])
    z = np.array([0.0, 0.0, rng.choice([-1.0, 1.0])])
    if feature == "side":
        return Site(feature, r * radial + rng.uniform(0.0, 0.9) * half * z, radial, z)
    if feature == "face":
        return Site(feature, half * z + rng.uniform(0.0, 0.9) * r * radial, z, around)
    slope = rng.uniform(0.1, 1.4)
    n = np.cos(slope) * radial + np.sin(slope) * z
    if feature == "rim":
        return Site(feature, half * z + r * radial, n, around)
    return Site(feature, half * z + r * n, n, around)


def _without_pit(points: np.ndarray, triangles: np.ndarray, hole: np.ndarray) -> np.ndarray:
    """Return the hull's triangles without those in the plane of the pit's opening."""
    normal = _unit(np.cross(hole[1] - hole[0], hole[2] - hole[0]))
    heights = np.abs((points[triangles] - hole[0]) @ normal).max(axis=1)
    return triangles[heights > 1e-9]


def _site_of_polytope(
    points: np.ndarray, triangles: np.ndarray, feature: str, rng: np.random.Generator
) -> Site:
    """Draw from the hull's triangles; the normal is inside the feature's cone of normals."""
    face = points[triangles[rng.integers(len(triangles))]]
    normals = _normals(points, _oriented_triangles(points))
    if feature == "face":
        n = _unit(np.cross(face[1] - face[0], face[2] - face[0]))
        weights = rng.dirichlet([1.0, 1.0, 1.0])
        return Site(feature, weights @ face, n, _across(n, face[1] - face[0]))
    if feature == "vertex":
        n = _mix(_touching(points, normals, face[:1]), rng)
        return Site(feature, face[0], n, _across(n, face[1] - face[0]))
    for start, end in ((0, 1), (1, 2), (2, 0)):
        touching = _touching(points, normals, face[[start, end]])
        if len(touching) == 2:
            n = _mix(touching, rng)
            t = _across(n, face[end] - face[start])
            weight = rng.uniform(0.05, 0.95)
            return Site(feature, weight * face[start] + (1.0 - weight) * face[end], n, t)
    raise AssertionError("each triangle of a hull has a real edge")


def _normals(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    a, b, c = (points[triangles[:, k]] for k in range(3))
    n = np.cross(b - a, c - a)
    return n / np.linalg.norm(n, axis=1, keepdims=True)


def _touching(points: np.ndarray, normals: np.ndarray, on: np.ndarray) -> np.ndarray:
    """Return the distinct face normals of the hull at all of the points ``on``."""
    heights = normals @ points.T
    reached = normals @ on.T
    found = normals[(reached >= heights.max(axis=1)[:, None] - 1e-12).all(axis=1)]
    distinct: list[np.ndarray] = []
    for n in found:
        if all(n @ m < 1.0 - 1e-9 for m in distinct):
            distinct.append(n)
    return np.array(distinct)


def _mix(normals: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Return a direction inside the cone of the normals, away from its border."""
    return _unit((0.1 + rng.dirichlet(np.ones(len(normals)))) @ normals)
