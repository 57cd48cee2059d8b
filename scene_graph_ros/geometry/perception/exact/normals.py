"""Normals at visible points."""

import math

from scene_graph_ros.geometry.compiled.dispatch import by_kind
from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel
from scene_graph_ros.geometry.compiled.places import LAST_PLACE
from scene_graph_ros.geometry.shapes.every_kind import every_kind
from scene_graph_ros.geometry.shapes.kinds import ShapeKind
from scene_graph_ros.geometry.spatial.vectors import cross, load_vector, subtract, unit

__all__ = ["box_axis", "is_on_end", "normal_at", "triangle_corners", "triangle_normal"]

_UP = (0.0, 0.0, 1.0)


@inlined_kernel
def box_axis(size, p):
    """Return the axis, 0 to 2, across the face of a box that a point is on."""
    x, y, z = abs(p[0]) - size[0], abs(p[1]) - size[1], abs(p[2]) - size[2]
    if x >= y and x >= z:
        return 0
    return 1 if y >= z else 2


@inlined_kernel
def is_on_end(size, p):
    """Tell whether a point of a cylinder is on one of its ends, not on its side."""
    return abs(p[2]) - size[1] >= math.sqrt(p[0] * p[0] + p[1] * p[1]) - size[0]


@inlined_kernel
def _box_normal(size, p):
    axis = box_axis(size, p)
    if axis == 0:
        return (1.0, 0.0, 0.0)
    return (0.0, 1.0, 0.0) if axis == 1 else _UP


@inlined_kernel
def _cylinder_normal(size, p):
    if is_on_end(size, p):
        return _UP
    return unit((p[0], p[1], 0.0), _UP)


@inlined_kernel
def _sphere_normal(p):
    return unit(p, _UP)


@inlined_kernel
def _capsule_normal(size, p):
    return unit((p[0], p[1], p[2] - max(-size[1], min(size[1], p[2]))), _UP)


@inlined_kernel
def _ellipsoid_normal(size, p):
    x, y, z = p[0] / size[0], p[1] / size[1], p[2] / size[2]
    return unit((x / size[0], y / size[1], z / size[2]), _UP)


@inlined_kernel
def _half_space_normal():
    return _UP


_NORMALS = every_kind(
    "normals at visible points",
    {
        ShapeKind.SPHERE: _sphere_normal,
        ShapeKind.CAPSULE: _capsule_normal,
        ShapeKind.BOX: _box_normal,
        ShapeKind.CYLINDER: _cylinder_normal,
        ShapeKind.ELLIPSOID: _ellipsoid_normal,
        ShapeKind.HALF_SPACE: _half_space_normal,
        # Hulls and meshes have those of their triangles.
        ShapeKind.CONVEX: _half_space_normal,
        ShapeKind.MESH: _half_space_normal,
    },
)


@by_kind(lean_kernel, ["kind"], _NORMALS)
def normal_at(kind, size, p):
    """Return a unit normal, out or in, of a shape with a closed form at a point of its surface."""


@inlined_kernel
def triangle_corners(bodies, row, triangle):
    """Return the corners of a body's triangle, in G."""
    mesh = bodies.mesh[row] & LAST_PLACE
    at = (bodies.triangle_start[mesh] + triangle) & LAST_PLACE
    first = bodies.vertex_start[mesh]
    a = load_vector(bodies.vertices, (first + bodies.triangles[at, 0]) & LAST_PLACE)
    b = load_vector(bodies.vertices, (first + bodies.triangles[at, 1]) & LAST_PLACE)
    c = load_vector(bodies.vertices, (first + bodies.triangles[at, 2]) & LAST_PLACE)
    return a, b, c


@lean_kernel
def triangle_normal(bodies, row, triangle):
    """Return a unit normal of a body's triangle, up or down by its winding."""
    a, b, c = triangle_corners(bodies, row, triangle)
    return unit(cross(subtract(b, a), subtract(c, a)), _UP)
