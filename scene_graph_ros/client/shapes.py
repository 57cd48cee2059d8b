"""Shapes as messages, in metres."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from scene_graph_msgs.msg import Shape

__all__ = [
    "box",
    "capsule",
    "convex",
    "cylinder",
    "ellipsoid",
    "half_space",
    "height_field",
    "mesh",
    "point_cloud",
    "sphere",
    "voxel_grid",
]


def _shape(kind: int, *dimensions: float) -> Shape:
    return Shape(kind=kind, dimensions=[float(value) for value in dimensions])


def sphere(radius: float) -> Shape:
    """Return a ball."""
    return _shape(Shape.SPHERE, radius)


def box(x: float, y: float, z: float) -> Shape:
    """Return a box of these edge lengths, centred on its origin."""
    return _shape(Shape.BOX, x, y, z)


def capsule(radius: float, length: float) -> Shape:
    """Return a cylinder along z with half balls on its ends, which ``length`` leaves out."""
    return _shape(Shape.CAPSULE, radius, length)


def cylinder(radius: float, length: float) -> Shape:
    """Return a cylinder along z, centred on its origin."""
    return _shape(Shape.CYLINDER, radius, length)


def ellipsoid(a: float, b: float, c: float) -> Shape:
    """Return an ellipsoid of these semi-axes along x, y and z."""
    return _shape(Shape.ELLIPSOID, a, b, c)


def half_space() -> Shape:
    """Return all points with z <= 0."""
    return _shape(Shape.HALF_SPACE)


def mesh(resource: str, scale: float = 1.0) -> Shape:
    """Return the surface in a mesh file, by a path or ``package://`` as the node sees it.

    It lies below a package, the folder of the scene that the node starts with, or one that the
    node's parameter ``resource_folders`` names.
    """
    return Shape(kind=Shape.MESH, resource=resource, scale=[float(scale)] * 3)


def convex(resource: str, scale: float = 1.0) -> Shape:
    """Return the convex hull of a mesh file; named as in `mesh`."""
    return Shape(kind=Shape.CONVEX, resource=resource, scale=[float(scale)] * 3)


def point_cloud(points: ArrayLike, radius: ArrayLike) -> Shape:
    """Return balls about points ``(n, 3)`` of one radius, or ``(n,)`` of one each."""
    vertices = np.asarray(points, dtype=np.float64).reshape(-1).tolist()
    radii = np.atleast_1d(np.asarray(radius, dtype=np.float64)).tolist()
    return Shape(kind=Shape.POINT_CLOUD, vertices=vertices, dimensions=radii)


def height_field(heights: ArrayLike, size: tuple[float, float], floor: float) -> Shape:
    """Return the solid from a floor (m) up to heights ``(rows, cols)`` (m), so long along x and y.

    Raises ValueError for heights that are no rows of columns.
    """
    rows = np.asarray(heights, dtype=np.float64)
    if rows.ndim != 2:
        raise ValueError(f"heights must be (rows, cols), not {rows.shape}")
    return _shape(Shape.HEIGHT_FIELD, *size, floor, rows.shape[1], *rows.reshape(-1).tolist())


def voxel_grid(occupancy: ArrayLike, voxel: float, *, unknown_is_free: bool = False) -> Shape:
    """Return boxes of an edge (m) of states ``(nx, ny, nz)``: 0 free, 1 occupied, 2 unknown.

    Raises ValueError for states of other axes.
    """
    states = np.asarray(occupancy, dtype=np.float64)
    if states.ndim != 3:
        raise ValueError(f"occupancy must be (nx, ny, nz), not {states.shape}")
    flat = states.reshape(-1)
    starts = np.flatnonzero(np.diff(flat, prepend=-1.0))
    runs = np.stack([flat[starts], np.diff(starts, append=len(flat))], axis=1).reshape(-1)
    return _shape(Shape.VOXEL_GRID, voxel, float(unknown_is_free), *states.shape, *runs.tolist())
