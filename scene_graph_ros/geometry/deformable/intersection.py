"""Where the surfaces of contact of deformable bodies are: polygons in their tetrahedra.

Against a rigid body, it is the part of the rigid surface inside the deformed tetrahedra: each
triangle's plane cuts a tetrahedron in a polygon, of which the part inside the triangle is kept; a
half space is a plane alone. Between two deformable bodies it is where their fields (``field.py``)
are equal: in each pair of tetrahedra a plane, which cuts the one in a polygon that is clipped by
the other. This is the sampling of Han, Masterjohn and Castro, "A convex formulation of frictional
contact between rigid and deformable bodies" (2023), with one centroid for each polygon.

Heights are positive on the side of A. Which of two tetrahedra has a polygon that lies in their
common face, and that touching is no contact, is said in ``narrowphase/clip.py``.

Positions are relative to an origin near A, in W's axes.
"""

import math

import numpy as np

from scene_graph_ros.geometry.deformable.faces import add_face, grown, new_rows
from scene_graph_ros.geometry.jit import kernel, lean_kernel
from scene_graph_ros.geometry.meshes.scratch import (
    polygon_buffer,
    POLYGON_CORNERS,
    traversal_stack,
)
from scene_graph_ros.geometry.narrowphase.bvh_pairs import (
    absolute_rotation,
    next_leaf_at_box,
    next_leaf_near_box,
)
from scene_graph_ros.geometry.narrowphase.clip import (
    clip_by_tetrahedron,
    planes_that_cut,
    side_mask,
    slice_tetrahedron,
    snapped,
)
from scene_graph_ros.geometry.spatial.vectors import (
    add,
    cross,
    dot,
    load_vector,
    norm,
    rotate,
    rotate_inverse,
    scale,
    subtract,
    transpose,
    unit,
)
from scene_graph_ros.geometry.tolerances import EQUAL_FIELDS

__all__ = ["deformable_faces", "half_space_faces", "surface_faces"]

_ZERO = (0.0, 0.0, 0.0)
_UP = (0.0, 0.0, 1.0)
_IDENTITY = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)
_NO_CUT = (0, 15)


@lean_kernel
def _load_corners(vertices, tetrahedra, t, shift, corners):
    """Write the corners of a tetrahedron, moved by ``shift``, into ``corners``: x, then y, z."""
    for k in range(4):
        for axis in range(3):
            corners[4 * axis + k] = vertices[tetrahedra[t, k], axis] + shift[axis]


@lean_kernel
def _corner(corners, k):
    return (corners[k], corners[4 + k], corners[8 + k])


@lean_kernel
def _height(corners, k, n, p, slack):
    """Return the height of corner k above the plane through p, 0 within the slack."""
    return snapped(dot(n, subtract(_corner(corners, k), p)), slack)


@lean_kernel
def _heights(corners, n, p, slack):
    """Return the heights of the four corners above the plane through p with unit normal n."""
    return (
        _height(corners, 0, n, p, slack),
        _height(corners, 1, n, p, slack),
        _height(corners, 2, n, p, slack),
        _height(corners, 3, n, p, slack),
    )


@kernel
def half_space_faces(vertices, tetrahedra, is_solid, n, p, slack, resolution):
    """Return the rows of the faces (see ``faces.py``) between a body and a half space.

    Args:
        vertices: (v, 3).
        tetrahedra: (t, 4).
        is_solid: (t,).
        n: the half space's outward normal.
        p: a point of its boundary.
        slack: metres: a corner this near the plane is on it.
        resolution: metres: what is narrower is no face.

    """
    rows, count = new_rows(), 0
    buffer, corners = polygon_buffer(), np.empty(12)
    for t in range(len(tetrahedra)):
        if not is_solid[t]:
            continue
        _load_corners(vertices, tetrahedra, t, _ZERO, corners)
        f = _heights(corners, n, p, slack)
        mask = side_mask(f)
        if mask in _NO_CUT:
            continue
        if count == len(rows):
            rows = grown(rows)
        size = slice_tetrahedron(corners, f, mask, buffer[0])
        count = add_face(rows, count, buffer[0], size, n, t, 0, resolution)
    return rows[:count]


@lean_kernel
def _clipped(buffer, size, n, planes, slack, heights):
    """Keep what is inside four planes of a polygon with normal n; return (side, size)."""
    cutting = planes_that_cut(buffer[0], size, n, planes, slack)
    if cutting < 0:
        return 0, 0
    return clip_by_tetrahedron(buffer, size, n, planes, cutting, slack, heights)


@lean_kernel
def _store_plane(planes, k, n, offset):
    """Write plane k of four, in the layout of ``clip_by_tetrahedron``."""
    for axis in range(3):
        planes[4 * axis + k] = n[axis]
    planes[12 + k] = offset


@lean_kernel
def _edge_planes(a, b, c, n, planes):
    """Write the planes through a triangle's edges, inwards, and one that cuts nothing (16,)."""
    for k in range(3):
        start, end = (a, b) if k == 0 else ((b, c) if k == 1 else (c, a))
        inward = unit(cross(n, subtract(end, start)), _UP)
        _store_plane(planes, k, inward, -dot(inward, start))
    _store_plane(planes, 3, _ZERO, math.inf)


@lean_kernel
def _box_triangle(a, b, c, box):
    """Write centre and half extents of the box around a triangle into ``box`` (6,)."""
    for axis in range(3):
        low = min(a[axis], b[axis], c[axis])
        high = max(a[axis], b[axis], c[axis])
        box[axis] = 0.5 * low + 0.5 * high
        box[axis + 3] = 0.5 * high - 0.5 * low


@lean_kernel
def _is_near(boxes, t, box, slack):
    """Tell whether the box of tetrahedron t is within the slack of another box."""
    return (
        abs(boxes[t, 0] - box[0]) <= boxes[t, 3] + box[3] + slack
        and abs(boxes[t, 1] - box[1]) <= boxes[t, 4] + box[4] + slack
        and abs(boxes[t, 2] - box[2]) <= boxes[t, 5] + box[5] + slack
    )


@lean_kernel
def _next_near(tree, boxes, is_solid, walk, box, slack):
    """Go on to the next solid tetrahedron whose box is near another.

    Args:
        tree: (node boxes, left, right, order).
        boxes: (t, 6) of the tetrahedra.
        is_solid: (t,).
        walk: (stack, state (3,)): state is the depth of the stack, the next slot and the last of
            a leaf; at first (1, 0, 0), with the root on the stack.
        box: (6,).
        slack: metres.

    Returns:
        the tetrahedron, -1 at the end.

    """
    nodes, left, right, order = tree
    stack, state = walk
    while True:
        while state[1] < state[2]:
            t = order[state[1]]
            state[1] += 1
            if is_solid[t] and _is_near(boxes, t, box, slack):
                return t
        state[0], node = next_leaf_at_box(nodes, left, right, stack, state[0], box, 0, slack)
        if node < 0:
            return -1
        state[1] = -1 - left[node]
        state[2] = state[1] + right[node]


@lean_kernel
def _start(walk):
    """Begin a walk at the root."""
    stack, state = walk
    stack[0] = 0
    state[0], state[1], state[2] = 1, 0, 0


@lean_kernel
def _load_triangle(surface, k, R, p):
    """Return the corners and the normal of a triangle, from G to W's axes."""
    vertices, triangles, normals = surface
    a = add(p, rotate(R, load_vector(vertices, triangles[k, 0])))
    b = add(p, rotate(R, load_vector(vertices, triangles[k, 1])))
    c = add(p, rotate(R, load_vector(vertices, triangles[k, 2])))
    return a, b, c, rotate(R, load_vector(normals, k))


@lean_kernel
def _triangle_face(buffer, scratch, a, n, slack):
    """Return (side, size) of the part of a triangle inside a tetrahedron.

    Args:
        buffer: a ``polygon_buffer``.
        scratch: (corners of the tetrahedron (12,), planes of the triangle (16,), heights (8,)).
        a: a corner of the triangle.
        n: its normal.
        slack: metres.

    """
    corners, planes, heights = scratch
    f = _heights(corners, n, a, slack)
    mask = side_mask(f)
    if mask in _NO_CUT:
        return 0, 0
    size = slice_tetrahedron(corners, f, mask, buffer[0])
    return _clipped(buffer, size, n, planes, slack, heights)


@kernel
def surface_faces(tree, body, tree_B, surface, R, p, slack, resolution):
    """Return the rows of the faces between a deformable body and a rigid surface.

    Args:
        tree: (node boxes (n, 6), left, right, order) of the body.
        body: (vertices (v, 3), tetrahedra (t, 4), is_solid (t,), element boxes (t, 6)).
        tree_B: the tree of the surface, in the frame G.
        surface: (vertices (m, 3), triangles (k, 3), unit normals (k, 3)) in G.
        R: of G in W.
        p: of G, from the origin.
        slack: metres: a corner this near a plane is on it.
        resolution: metres: what is narrower is no face.

    """
    vertices, tetrahedra, is_solid, element_boxes = body
    boxes_B, left_B, right_B, order_B = tree_B
    rows, count, buffer, box = new_rows(), 0, polygon_buffer(), np.empty(6)
    scratch = np.empty(12), np.empty(16), np.empty(POLYGON_CORNERS)
    walk, stack_B = (traversal_stack(), np.empty(3, np.int64)), traversal_stack()
    R_GW, p_GO = transpose(R), scale(-1.0, rotate_inverse(R, p))
    absolute = absolute_rotation(R_GW)
    stack_B[0], depth = 0, 1
    while True:
        depth, leaf = next_leaf_near_box(
            boxes_B, left_B, right_B, stack_B, depth, tree[0], 0, R_GW, absolute, p_GO, slack
        )
        if leaf < 0:
            return rows[:count]
        for slot in range(-1 - left_B[leaf], -1 - left_B[leaf] + right_B[leaf]):
            k = order_B[slot]
            a, b, c, n = _load_triangle(surface, k, R, p)
            _box_triangle(a, b, c, box)
            _edge_planes(a, b, c, n, scratch[1])
            _start(walk)
            while True:
                t = _next_near(tree, element_boxes, is_solid, walk, box, slack)
                if t < 0:
                    break
                _load_corners(vertices, tetrahedra, t, _ZERO, scratch[0])
                side, size = _triangle_face(buffer, scratch, a, n, slack)
                if size >= 3:
                    if count == len(rows):
                        rows = grown(rows)
                    count = add_face(rows, count, buffer[side], size, n, t, k, resolution)


@lean_kernel
def _differences(corners, own, corners_other, other, gradient, sign, slack):
    """Return ``sign`` times (another tetrahedron's linear field less the own one) at four corners.

    Differences up to ``slack``, a length of the field, are 0.
    """
    base = _corner(corners_other, 0)
    f0 = other[0] + dot(gradient, subtract(_corner(corners, 0), base)) - own[0]
    f1 = other[0] + dot(gradient, subtract(_corner(corners, 1), base)) - own[1]
    f2 = other[0] + dot(gradient, subtract(_corner(corners, 2), base)) - own[2]
    f3 = other[0] + dot(gradient, subtract(_corner(corners, 3), base)) - own[3]
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
        a, b = _corner(corners, (k + 1) % 4), _corner(corners, (k + 2) % 4)
        n = cross(subtract(b, a), subtract(_corner(corners, (k + 3) % 4), a))
        n = unit(n, _UP)
        if dot(n, subtract(_corner(corners, k), a)) < 0.0:
            n = scale(-1.0, n)
        _store_plane(planes, k, n, -dot(n, a))


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
    if mask in _NO_CUT:
        return 0, 0, n
    if side_mask(_differences(corners_B, own_B, corners, own, g, -1.0, limit)) in _NO_CUT:
        return 0, 0, n
    n = scale(1.0 / length, n)
    size = slice_tetrahedron(corners, f, mask, buffer[0])
    side, size = _clipped(buffer, size, n, planes, slack, heights)
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
        resolution: metres: what is narrower is no face.

    """
    vertices, tetrahedra, is_solid, element_boxes, field, gradients = body_A
    vertices_B, tetrahedra_B, is_solid_B, element_boxes_B, field_B, gradients_B = body_B
    boxes_B, left_B, right_B, order_B = tree_B
    rows, count, buffer, box = new_rows(), 0, polygon_buffer(), np.empty(6)
    scratch = np.empty(12), np.empty(12), np.empty(16), np.empty(POLYGON_CORNERS)
    walk, stack_B = (traversal_stack(), np.empty(3, np.int64)), traversal_stack()
    absolute, back = absolute_rotation(_IDENTITY), scale(-1.0, shift)
    stack_B[0], depth = 0, 1
    while True:
        depth, leaf = next_leaf_near_box(
            boxes_B, left_B, right_B, stack_B, depth, tree[0], 0, _IDENTITY, absolute, back, slack
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
            _load_corners(vertices_B, tetrahedra_B, u, shift, scratch[1])
            _inward_planes(scratch[1], scratch[2])
            side_B = _values(field_B, tetrahedra_B, u), load_vector(gradients_B, u)
            _start(walk)
            while True:
                t = _next_near(tree, element_boxes, is_solid, walk, box, slack)
                if t < 0:
                    break
                _load_corners(vertices, tetrahedra, t, _ZERO, scratch[0])
                side_A = _values(field, tetrahedra, t), load_vector(gradients, t)
                side, size, n = _field_face(buffer, scratch, side_A, side_B, slack)
                if size >= 3:
                    if count == len(rows):
                        rows = grown(rows)
                    count = add_face(rows, count, buffer[side], size, n, t, u, resolution)
