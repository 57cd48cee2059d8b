"""Where two deformed bodies meet: where their fields (``field.py``) are equal.

In each pair of tetrahedra that is a plane, which cuts A's in a polygon that is clipped by B's, as
Han, Masterjohn and Castro do in "A convex formulation of frictional contact between rigid and
deformable bodies" (2023).

The difference of the fields, B's less A's, is positive on the side of A. Which of two tetrahedra
has a polygon that lies in their common face, and that touching is no contact, is said in
``cutting/clip.py``. Positions are relative to an origin near A, in W's axes.
"""

import numpy as np

from scene_graph_ros.geometry.compiled.kernel import kernel, lean_kernel
from scene_graph_ros.geometry.cutting.bvh_pairs import absolute_rotation, next_leaf_near_box
from scene_graph_ros.geometry.cutting.clip import side_mask, slice_tetrahedron, snapped
from scene_graph_ros.geometry.cutting.polygons import polygon_buffer, POLYGON_CORNERS
from scene_graph_ros.geometry.deformable.elements import (
    clipped,
    corner,
    load_corners,
    next_near,
    NO_CUT,
    start_walk,
    store_plane,
    UP,
    ZERO,
)
from scene_graph_ros.geometry.deformable.faces import add_face, grown, new_rows
from scene_graph_ros.geometry.meshes.bvh import traversal_stack
from scene_graph_ros.geometry.spatial.vectors import (
    cross,
    dot,
    load_vector,
    norm,
    scale,
    subtract,
    unit,
)
from scene_graph_ros.geometry.tolerances import EQUAL_FIELDS

__all__ = ["deformable_faces"]

_IDENTITY = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)


@lean_kernel
def _differences(corners, own, corners_other, other, gradient, sign, slack):
    """Return ``sign`` times (another tetrahedron's linear field less the own one) at four corners.

    Differences up to ``slack``, a length of the field, are 0.
    """
    base = corner(corners_other, 0)
    f0 = other[0] + dot(gradient, subtract(corner(corners, 0), base)) - own[0]
    f1 = other[0] + dot(gradient, subtract(corner(corners, 1), base)) - own[1]
    f2 = other[0] + dot(gradient, subtract(corner(corners, 2), base)) - own[2]
    f3 = other[0] + dot(gradient, subtract(corner(corners, 3), base)) - own[3]
    return (
        snapped(sign * f0, slack),
        snapped(sign * f1, slack),
        snapped(sign * f2, slack),
        snapped(sign * f3, slack),
    )


@lean_kernel
def _values(field, tetrahedra, t):
    """Return the field at the four corners of a tetrahedron."""
    return (
        field[tetrahedra[t, 0]],
        field[tetrahedra[t, 1]],
        field[tetrahedra[t, 2]],
        field[tetrahedra[t, 3]],
    )


@lean_kernel
def _inward_planes(corners, planes):
    """Write four unit normals into a tetrahedron, each with an offset, into ``planes`` (16,)."""
    for k in range(4):
        a, b = corner(corners, (k + 1) % 4), corner(corners, (k + 2) % 4)
        n = cross(subtract(b, a), subtract(corner(corners, (k + 3) % 4), a))
        n = unit(n, UP)
        if dot(n, subtract(corner(corners, k), a)) < 0.0:
            n = scale(-1.0, n)
        store_plane(planes, k, n, -dot(n, a))


@lean_kernel
def _field_face(buffer, scratch, side_A, side_B, slack):
    """Return (side, size, normal) of where the fields of two tetrahedra are equal.

    Args:
        buffer: a ``polygon_buffer``.
        scratch: (corners (12,), corners of B (12,), planes of B (16,), heights (8,)).
        side_A: the field of A's tetrahedron: (values at its corners, gradient).
        side_B: the same of B.
        slack: metres.

    """
    corners, corners_B, planes, heights = scratch
    (own, g), (own_B, g_B) = side_A, side_B
    n, steepness = subtract(g_B, g), norm(g) + norm(g_B)
    length = norm(n)
    if not length > EQUAL_FIELDS * steepness:
        return 0, 0, n
    limit = slack * steepness  # the height above the plane, times the gradient
    f = _differences(corners, own, corners_B, own_B, g_B, 1.0, limit)
    mask = side_mask(f)
    if mask in NO_CUT:
        return 0, 0, n
    if side_mask(_differences(corners_B, own_B, corners, own, g, -1.0, limit)) in NO_CUT:
        return 0, 0, n
    n = scale(1.0 / length, n)
    size = slice_tetrahedron(corners, f, mask, buffer[0])
    side, size = clipped(buffer, size, n, planes, slack, heights)
    return side, size, n


@kernel
def deformable_faces(tree, body_A, tree_B, body_B, shift, slack, resolution):
    """Return the rows of the faces between two deformable bodies: where their fields are equal.

    No face is where the fields have the same gradient: there they are equal everywhere, or
    nowhere.

    Args:
        tree: as of ``surface_faces``.
        body_A: (vertices, tetrahedra, is_solid, element boxes, field (v,), gradients (t, 3)).
        tree_B: the tree of B.
        body_B: as ``body_A``, from an origin of its own.
        shift: B's origin from A's.
        slack: metres: a corner this near a plane is on it.
        resolution: metres: narrower polygons are no faces.

    """
    vertices, tetrahedra, is_solid, element_boxes, field, gradients = body_A
    vertices_B, tetrahedra_B, is_solid_B, element_boxes_B, field_B, gradients_B = body_B
    boxes_B, left_B, right_B, order_B = tree_B
    rows, count, buffer, box = new_rows(), 0, polygon_buffer(), np.empty(6)
    scratch = np.empty(12), np.empty(12), np.empty(16), np.empty(POLYGON_CORNERS)
    walk, stack_B = (traversal_stack(), np.empty(3, np.int64)), traversal_stack()
    turned = _IDENTITY, absolute_rotation(_IDENTITY), scale(-1.0, shift)
    other = tree[0], 0
    stack_B[0], depth = 0, 1
    while True:
        depth, leaf = next_leaf_near_box(
            (boxes_B, left_B, right_B), stack_B, depth, other, turned, slack
        )
        if leaf < 0:
            return rows[:count]
        for slot in range(-1 - left_B[leaf], -1 - left_B[leaf] + right_B[leaf]):
            u = order_B[slot]
            if not is_solid_B[u]:
                continue
            for axis in range(3):
                box[axis] = element_boxes_B[u, axis] + shift[axis]
                box[axis + 3] = element_boxes_B[u, axis + 3]
            load_corners(vertices_B, tetrahedra_B, u, shift, scratch[1])
            _inward_planes(scratch[1], scratch[2])
            side_B = _values(field_B, tetrahedra_B, u), load_vector(gradients_B, u)
            start_walk(walk)
            while True:
                t = next_near(tree, element_boxes, is_solid, walk, box, slack)
                if t < 0:
                    break
                load_corners(vertices, tetrahedra, t, ZERO, scratch[0])
                side_A = _values(field, tetrahedra, t), load_vector(gradients, t)
                side, size, n = _field_face(buffer, scratch, side_A, side_B, slack)
                if size >= 3:
                    if count == len(rows):
                        rows = grown(rows)
                    count = add_face(rows, count, buffer[side], size, n, t, u, resolution)
