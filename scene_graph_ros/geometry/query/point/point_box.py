"""Signed distance from a point to a box."""

from scene_graph_ros.geometry.jit import kernel
from scene_graph_ros.geometry.spatial.vectors import norm, unit
from scene_graph_ros.geometry.tolerances import COINCIDENCE

__all__ = ["point_box"]


@kernel
def _signed_axis(axis, sign):
    return (
        sign if axis == 0 else 0.0,
        sign if axis == 1 else 0.0,
        sign if axis == 2 else 0.0,
    )


@kernel
def _point_box_inside(size, p_GQ, tolerance):
    """Leave through the nearest face: the first in x, y, z order, the positive one, in ties."""
    x, y, z = p_GQ
    gap_x, gap_y, gap_z = size[0] - abs(x), size[1] - abs(y), size[2] - abs(z)
    gap, second, axis, coordinate = gap_x, min(gap_y, gap_z), 0, x
    if gap_y < gap - tolerance:
        gap, second, axis, coordinate = gap_y, min(gap_x, gap_z), 1, y
    if gap_z < gap - tolerance:
        gap, second, axis, coordinate = gap_z, min(gap_x, gap_y), 2, z
    centred = abs(coordinate) <= tolerance
    sign = -1.0 if coordinate < 0.0 and not centred else 1.0
    face = sign * size[axis]
    p_GN = (face if axis == 0 else x, face if axis == 1 else y, face if axis == 2 else z)
    unique = not centred and second > gap + tolerance
    return sign * coordinate - size[axis], p_GN, _signed_axis(axis, sign), unique


@kernel
def point_box(size, p_GQ):
    """Return (phi, p_GN, grad_G, unique) of point Q; ``size`` holds the half extents.

    Inside, where several faces are nearest, the first in the order x, y, z is chosen, the
    positive one before the negative, and ``unique`` is False; so it is on an edge or a corner.
    """
    tolerance = COINCIDENCE * max(size[0], size[1], size[2])
    p_GN = (
        min(max(p_GQ[0], -size[0]), size[0]),
        min(max(p_GQ[1], -size[1]), size[1]),
        min(max(p_GQ[2], -size[2]), size[2]),
    )
    offset = (p_GQ[0] - p_GN[0], p_GQ[1] - p_GN[1], p_GQ[2] - p_GN[2])
    phi = norm(offset)
    if phi <= tolerance:
        return _point_box_inside(size, p_GQ, tolerance)
    return phi, p_GN, unit(offset, (1.0, 0.0, 0.0)), True
