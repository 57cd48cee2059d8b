"""Where deformed bodies meet rigid surfaces: the part of the surface inside the tetrahedra.

The plane of each triangle cuts a tetrahedron in a polygon, of which the part inside the triangle
is kept; a half space is a plane alone. This is the sampling of Han, Masterjohn and Castro, "A
convex formulation of frictional contact between rigid and deformable bodies" (2023), with one
centroid for each polygon.

Heights are positive outside of the rigid body, on the side of A. Which of two tetrahedra has a
polygon that lies in their common face, and that touching is no contact, is said in
``cutting/clip.py``. Positions are relative to an origin near A, in W's axes.
"""

import math

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
    add,
    cross,
    dot,
    load_vector,
    rotate,
    rotate_inverse,
    scale,
    subtract,
    transpose,
    unit,
)

__all__ = ["half_space_faces", "surface_faces"]


@lean_kernel
def _height(corners, k, n, p, slack):
    """Return the height of corner k above the plane through p, 0 within the slack."""
    return snapped(dot(n, subtract(corner(corners, k), p)), slack)


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
        resolution: metres: narrower polygons are no faces.

    """
    rows, count = new_rows(), 0
    buffer, corners = polygon_buffer(), np.empty(12)
    for t in range(len(tetrahedra)):
        if not is_solid[t]:
            continue
        load_corners(vertices, tetrahedra, t, ZERO, corners)
        f = _heights(corners, n, p, slack)
        mask = side_mask(f)
        if mask in NO_CUT:
            continue
        if count == len(rows):
            rows = grown(rows)
        size = slice_tetrahedron(corners, f, mask, buffer[0])
        count = add_face(rows, count, buffer[0], size, n, t, 0, resolution)
    return rows[:count]


@lean_kernel
def _edge_planes(a, b, c, n, planes):
    """Write the planes through a triangle's edges, inwards, and one that cuts nothing (16,)."""
    for k in range(3):
        start, end = (a, b) if k == 0 else ((b, c) if k == 1 else (c, a))
        inward = unit(cross(n, subtract(end, start)), UP)
        store_plane(planes, k, inward, -dot(inward, start))
    store_plane(planes, 3, ZERO, math.inf)


@lean_kernel
def _box_triangle(a, b, c, box):
    """Write centre and half extents of the box around a triangle into ``box`` (6,)."""
    for axis in range(3):
        low = min(a[axis], b[axis], c[axis])
        high = max(a[axis], b[axis], c[axis])
        box[axis] = 0.5 * low + 0.5 * high
        box[axis + 3] = 0.5 * high - 0.5 * low


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
    if mask in NO_CUT:
        return 0, 0
    size = slice_tetrahedron(corners, f, mask, buffer[0])
    return clipped(buffer, size, n, planes, slack, heights)


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
        resolution: metres: narrower polygons are no faces.

    """
    vertices, tetrahedra, is_solid, element_boxes = body
    boxes_B, left_B, right_B, order_B = tree_B
    rows, count, buffer, box = new_rows(), 0, polygon_buffer(), np.empty(6)
    scratch = np.empty(12), np.empty(16), np.empty(POLYGON_CORNERS)
    walk, stack_B = (traversal_stack(), np.empty(3, np.int64)), traversal_stack()
    R_GW, p_GO = transpose(R), scale(-1.0, rotate_inverse(R, p))
    turned, other = (R_GW, absolute_rotation(R_GW), p_GO), (tree[0], 0)
    stack_B[0], depth = 0, 1
    while True:
        depth, leaf = next_leaf_near_box(
            (boxes_B, left_B, right_B), stack_B, depth, other, turned, slack
        )
        if leaf < 0:
            return rows[:count]
        for slot in range(-1 - left_B[leaf], -1 - left_B[leaf] + right_B[leaf]):
            k = order_B[slot]
            a, b, c, n = _load_triangle(surface, k, R, p)
            _box_triangle(a, b, c, box)
            _edge_planes(a, b, c, n, scratch[1])
            start_walk(walk)
            while True:
                t = next_near(tree, element_boxes, is_solid, walk, box, slack)
                if t < 0:
                    break
                load_corners(vertices, tetrahedra, t, ZERO, scratch[0])
                side, size = _triangle_face(buffer, scratch, a, n, slack)
                if size >= 3:
                    if count == len(rows):
                        rows = grown(rows)
                    count = add_face(rows, count, buffer[side], size, n, t, k, resolution)
