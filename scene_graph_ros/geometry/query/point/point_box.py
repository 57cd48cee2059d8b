"""Signed distance from a point to a box."""

import math

from scene_graph_ros.geometry.compiled.division import reciprocal
from scene_graph_ros.geometry.compiled.kernel import inlined_kernel
from scene_graph_ros.geometry.spatial.vectors import norm
from scene_graph_ros.geometry.tolerances import COINCIDENCE

__all__ = ["point_box"]


_PART_OF_TWO, _PART_OF_THREE = math.sqrt(0.5), math.sqrt(1.0 / 3.0)
"""Each coordinate of the mean direction of so many axes."""


@inlined_kernel
def _signed(value, coordinate, tolerance):
    """Return a value with the sign of a coordinate, which is positive in the middle."""
    return -value if coordinate < -tolerance else value


@inlined_kernel
def _way_out(size, p_GQ, tolerance):
    """Return (phi, p_GN, grad_G, unique) of a point inside, which leaves by the nearest face.

    That is the first in x, y, z order, the positive one, in ties. On an edge or a corner the
    gradient is the mean of the normals of the faces that meet there, as a unit vector.
    """
    x, y, z = p_GQ
    gap_x, gap_y, gap_z = size[0] - abs(x), size[1] - abs(y), size[2] - abs(z)
    gap, second = gap_x, min(gap_y, gap_z)
    by_y = gap_y < gap - tolerance
    gap, second = gap_y if by_y else gap, min(gap_x, gap_z) if by_y else second
    by_z = gap_z < gap - tolerance
    gap, second = gap_z if by_z else gap, min(gap_x, gap_y) if by_z else second
    by_y = by_y and not by_z
    by_x = not (by_y or by_z)
    coordinate = z if by_z else (y if by_y else x)
    extent = size[2] if by_z else (size[1] if by_y else size[0])
    centred = abs(coordinate) <= tolerance
    sign = -1.0 if coordinate < 0.0 and not centred else 1.0
    face = sign * extent
    p_GN = (face if by_x else x, face if by_y else y, face if by_z else z)
    grad_G = (sign if by_x else 0.0, sign if by_y else 0.0, sign if by_z else 0.0)
    unique = not centred and second > gap + tolerance
    of_x, of_y, of_z = gap_x <= tolerance, gap_y <= tolerance, gap_z <= tolerance
    faces = (1.0 if of_x else 0.0) + (1.0 if of_y else 0.0) + (1.0 if of_z else 0.0)
    at_edge = faces > 1.0
    part = _PART_OF_TWO if faces < 3.0 else _PART_OF_THREE
    grad_G = (
        (_signed(part, x, tolerance) if of_x else 0.0) if at_edge else grad_G[0],
        (_signed(part, y, tolerance) if of_y else 0.0) if at_edge else grad_G[1],
        (_signed(part, z, tolerance) if of_z else 0.0) if at_edge else grad_G[2],
    )
    return sign * coordinate - extent, p_GN, grad_G, unique


@inlined_kernel
def point_box(size, p_GQ):
    """Return (phi, p_GN, grad_G, unique) of point Q; ``size`` holds the half extents.

    Inside, where several faces are nearest, the first in the order x, y, z is chosen, the
    positive one before the negative, and ``unique`` is False; on an edge or a corner, too, where
    the gradient has the mean direction of the faces' normals.
    """
    tolerance = COINCIDENCE * max(size[0], size[1], size[2])
    near = (
        min(max(p_GQ[0], -size[0]), size[0]),
        min(max(p_GQ[1], -size[1]), size[1]),
        min(max(p_GQ[2], -size[2]), size[2]),
    )
    offset = (p_GQ[0] - near[0], p_GQ[1] - near[1], p_GQ[2] - near[2])
    distance = norm(offset)
    outside = distance > tolerance
    depth, face, axis, is_only = _way_out(size, p_GQ, tolerance)
    p_GN = (
        near[0] if outside else face[0],
        near[1] if outside else face[1],
        near[2] if outside else face[2],
    )
    inverse = reciprocal(distance)
    grad_G = (
        offset[0] * inverse if outside else axis[0],
        offset[1] * inverse if outside else axis[1],
        offset[2] * inverse if outside else axis[2],
    )
    return distance if outside else depth, p_GN, grad_G, outside or is_only
