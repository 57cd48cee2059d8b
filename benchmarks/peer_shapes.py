"""Our shapes as other libraries know them. A mesh stands for its convex hull, as in contact."""

from __future__ import annotations

import importlib
from typing import Any

import numpy as np

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
from scene_graph_ros.geometry.meshes.sources import hull_of

__all__ = [
    "add_mujoco_geom",
    "coal_shape",
    "drake_shape",
    "fcl_shape",
    "hull_triangles",
    "mujoco_geom",
]

_UP = np.array([0.0, 0.0, 1.0])


def hull_triangles(shape: Convex | Mesh) -> tuple[np.ndarray, np.ndarray]:
    """Return the vertices (n, 3) and triangles (t, 3) of a shape's convex hull."""
    hull = hull_of(shape)
    fans = [np.column_stack([np.full(len(f) - 2, f[0]), f[1:-1], f[2:]]) for f in hull.faces]
    return np.asarray(hull.vertices), np.concatenate(fans)


def _numbers(shape: Any) -> tuple[float, ...]:
    """Return a primitive's measures in the order in which Coal, Drake and FCL take them."""
    match shape:
        case Sphere():
            return (shape.radius,)
        case Box():
            return (shape.width, shape.depth, shape.height)
        case Capsule() | Cylinder():
            return (shape.radius, shape.length)
        case Ellipsoid():
            return (shape.a, shape.b, shape.c)
    raise TypeError(f"{shape!r} is no primitive")


def fcl_shape(shape: Any) -> Any:
    """Return python-fcl's shape."""
    fcl = importlib.import_module("fcl")
    if isinstance(shape, HalfSpace):
        return fcl.Halfspace(_UP, 0.0)
    if isinstance(shape, Convex | Mesh):
        vertices, triangles = hull_triangles(shape)
        faces = np.concatenate([np.full((len(triangles), 1), 3), triangles], axis=1).flatten()
        return fcl.Convex(vertices, len(triangles), faces)
    return getattr(fcl, type(shape).__name__)(*_numbers(shape))


def coal_shape(shape: Any) -> Any:
    """Return Coal's shape."""
    coal = importlib.import_module("coal")
    if isinstance(shape, HalfSpace):
        return coal.Halfspace(_UP, 0.0)
    if isinstance(shape, Convex | Mesh):
        vertices, triangles = hull_triangles(shape)
        points = coal.StdVec_Vec3s()
        points.extend(list(vertices))
        faces = coal.StdVec_Triangle()
        for t in triangles:
            faces.append(coal.Triangle(*(int(v) for v in t)))
        return coal.Convex(points, faces)
    return getattr(coal, type(shape).__name__)(*_numbers(shape))


def _normals(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Return a unit normal (n, 3) at each vertex: of its triangles, weighted by their areas."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    normals = np.zeros_like(vertices)
    for k in range(3):
        np.add.at(normals, faces[:, k], np.cross(b - a, c - a))
    return normals / np.maximum(np.linalg.norm(normals, axis=1), np.finfo(float).tiny)[:, None]


def drake_shape(shape: Any) -> Any:
    """Return Drake's shape; a mesh goes in as an OBJ file, with normals for its renderers."""
    drake = importlib.import_module("pydrake.geometry")
    if isinstance(shape, HalfSpace):
        return drake.HalfSpace()
    if isinstance(shape, Convex):
        return drake.Convex(points=hull_triangles(shape)[0].T, label="convex")
    if isinstance(shape, Mesh):
        vertices, faces = np.asarray(shape.vertices), np.asarray(shape.faces)
        lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in vertices.tolist()]
        lines += [f"vn {x!r} {y!r} {z!r}" for x, y, z in _normals(vertices, faces).tolist()]
        lines += [f"f {a}//{a} {b}//{b} {c}//{c}" for a, b, c in (faces + 1).tolist()]
        common = importlib.import_module("pydrake.common")
        text = common.MemoryFile("\n".join(lines).encode(), ".obj", "mesh")
        return drake.Mesh(mesh_data=drake.InMemoryMesh(mesh_file=text))
    return getattr(drake, type(shape).__name__)(*_numbers(shape))


def mujoco_geom(shape: Any, name: str) -> tuple[str, str]:
    """Return (attributes of a geom, asset) of MuJoCo's XML; the asset is empty but for meshes."""
    if isinstance(shape, HalfSpace):
        return 'type="plane" size="1 1 1"', ""
    if isinstance(shape, Convex | Mesh):
        vertices = " ".join(map(repr, hull_triangles(shape)[0].ravel().tolist()))
        return f'type="mesh" mesh="{name}"', f'<mesh name="{name}" vertex="{vertices}"/>'
    numbers = list(_numbers(shape))
    if isinstance(shape, Box):
        numbers = [0.5 * x for x in numbers]
    if isinstance(shape, Capsule | Cylinder):
        numbers[1] *= 0.5
    size = " ".join(map(repr, map(float, numbers)))
    return f'type="{type(shape).__name__.lower()}" size="{size}"', ""


def add_mujoco_geom(spec: Any, parent: Any, shape: Any, name: str, place: dict[str, Any]) -> None:
    """Add a geom to a body of an ``MjSpec``; ``place`` has its ``pos`` and ``quat`` (w first)."""
    types = importlib.import_module("mujoco").mjtGeom
    if isinstance(shape, HalfSpace):
        parent.add_geom(type=types.mjGEOM_PLANE, size=[0.0, 0.0, 1.0], **place)
        return
    if isinstance(shape, Convex | Mesh):
        spec.add_mesh(name=name, uservert=hull_triangles(shape)[0].ravel().tolist())
        parent.add_geom(type=types.mjGEOM_MESH, meshname=name, **place)
        return
    size = list(_numbers(shape))
    if isinstance(shape, Box):
        size = [0.5 * each for each in size]
    if isinstance(shape, Capsule | Cylinder):
        size[1] *= 0.5
    kind = getattr(types, f"mjGEOM_{type(shape).__name__.upper()}")
    parent.add_geom(type=kind, size=size + [0.0] * (3 - len(size)), **place)
