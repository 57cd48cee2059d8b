"""Where a point of a shape with a closed form is on the picture that covers it.

Coordinates (u, v) run from 0 to 1 across the picture, u to the right and v up. Seen from outside,
no picture is mirrored. On sides around the z axis, u goes once around, v goes up along z, and the
middle of the picture is towards the x axis. ``docs/cameras.md`` lists all.
"""

import math

from scene_graph_ros.geometry.compiled.dispatch import by_kind
from scene_graph_ros.geometry.compiled.kernel import lean_kernel
from scene_graph_ros.geometry.perception.exact.normals import box_axis, is_on_end
from scene_graph_ros.geometry.shapes.every_kind import every_kind
from scene_graph_ros.geometry.shapes.kinds import ShapeKind
from scene_graph_ros.geometry.spatial.elementary import arc_tangent

__all__ = ["picture_coordinates"]


@lean_kernel
def _around(p):
    return 0.5 + arc_tangent(p[1], p[0]) / (2.0 * math.pi)


@lean_kernel
def _latitude(p):
    """Return the angle of a direction above the xy plane."""
    return arc_tangent(p[2], math.sqrt(p[0] * p[0] + p[1] * p[1]))


@lean_kernel
def _on_box(size, p):
    """Return the place on a face, which shows all of the picture; z or, on the ends, y is up."""
    axis = box_axis(size, p)
    side = 1.0 if p[axis] >= 0.0 else -1.0
    x, y, z = p[0] / size[0], p[1] / size[1], p[2] / size[2]
    if axis == 0:
        return 0.5 + 0.5 * side * y, 0.5 + 0.5 * z
    if axis == 1:
        return 0.5 - 0.5 * side * x, 0.5 + 0.5 * z
    return 0.5 + 0.5 * side * x, 0.5 + 0.5 * y


@lean_kernel
def _on_cylinder(size, p):
    if is_on_end(size, p):
        side = 1.0 if p[2] >= 0.0 else -1.0
        return 0.5 + 0.5 * side * p[0] / size[0], 0.5 + 0.5 * p[1] / size[0]
    return _around(p), 0.5 + 0.5 * p[2] / size[1]


@lean_kernel
def _on_capsule(size, p):
    """Return v by the length of the way up along the surface."""
    radius, half = size[0], size[1]
    z = max(-half, min(half, p[2]))
    way = z + radius * _latitude((p[0], p[1], p[2] - z))
    return _around(p), 0.5 + 0.5 * way / (half + 0.5 * math.pi * radius)


@lean_kernel
def _on_sphere(p):
    return _around(p), 0.5 + _latitude(p) / math.pi


@lean_kernel
def _on_ellipsoid(size, p):
    q = (p[0] / size[0], p[1] / size[1], p[2] / size[2])
    return _around(q), 0.5 + _latitude(q) / math.pi


@lean_kernel
def _on_half_space(p):
    return p[0], p[1]


_COORDINATES = every_kind(
    "coordinates on pictures",
    {
        ShapeKind.SPHERE: _on_sphere,
        ShapeKind.ELLIPSOID: _on_ellipsoid,
        ShapeKind.CAPSULE: _on_capsule,
        ShapeKind.BOX: _on_box,
        ShapeKind.CYLINDER: _on_cylinder,
        ShapeKind.HALF_SPACE: _on_half_space,
        # Meshes have the coordinates of their files.
        ShapeKind.CONVEX: _on_half_space,
        ShapeKind.MESH: _on_half_space,
    },
)


@by_kind(lean_kernel, ["kind"], _COORDINATES)
def picture_coordinates(kind, size, p):
    """Return (u, v) of a point on the surface of a shape, given in its frame G.

    Of a half space they are x and y in metres: a picture covers a square metre.
    """
