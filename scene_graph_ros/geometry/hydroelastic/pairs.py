"""Contact polygons of pairs of bodies: walks through their trees to the elements that may meet."""

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel
from scene_graph_ros.geometry.cutting.bvh_pairs import (
    absolute_rotation,
    boxes_meet,
    is_apart,
    next_leaf_above_plane,
    next_leaf_at_box,
    next_leaf_near_box,
)
from scene_graph_ros.geometry.hydroelastic.clipping import (
    add_cut_by_level,
    add_triangle,
    BOX,
    cut_by_plane,
    cut_by_slab,
    cut_triangle_by_slab,
    FULL,
    meet_triangle,
    move_element,
    slice_by_level,
)
from scene_graph_ros.geometry.meshes.bvh import traversal_stack
from scene_graph_ros.geometry.spatial.vectors import (
    dot,
    rotate,
    rotate_inverse,
    scale,
    transpose,
)

__all__ = ["half_space_and_surface", "half_space_and_volume", "volume_and_other"]


@inlined_kernel
def volume_and_other(table, body_A, body_B, is_rigid, X_AB, slack, narrow, work):
    """Add the polygons of volume A and another body, a volume or a rigid surface, in A.

    Args:
        table: an ElementTable.
        body_A: a compliant volume.
        body_B: a compliant volume or, if
        is_rigid: a rigid surface.
        X_AB: (R_AB, p_AB).
        slack: metres, lengths that count as zero.
        narrow: metres, widths too narrow to keep.
        work: the output, see ``clipping``.

    """
    (R_AB, p_AB), moved, polygon = X_AB, work.moved, work.buffer[0]
    elements, planes, boxes = table.elements, table.planes, table.boxes
    node_boxes, left, right = tree = table.node_boxes, table.node_left, table.node_right
    R_BA, p_BA = transpose(R_AB), scale(-1.0, rotate_inverse(R_AB, p_AB))
    absolute = absolute_rotation(R_BA)
    turned = R_BA, absolute, p_BA
    stack_A, stack_B = traversal_stack(), traversal_stack()
    root_A = table.node_start[body_A]
    other = node_boxes, root_A
    stack_B[0] = table.node_start[body_B]
    depth_B = 1
    while depth_B > 0:
        depth_B, node_B = next_leaf_near_box(tree, stack_B, depth_B, other, turned, slack)
        if node_B < 0 or work.counts[FULL]:
            return
        first_B = -1 - left[node_B]
        for b in range(first_B, first_B + right[node_B]):
            if not boxes_meet(boxes, b, node_boxes, root_A, R_BA, absolute, p_BA, slack):
                continue
            move_element(elements, planes, b, is_rigid, R_AB, p_AB, moved)
            stack_A[0], depth = root_A, 1
            while depth > 0:
                depth, node = next_leaf_at_box(tree, stack_A, depth, moved, BOX, slack)
                if node < 0:
                    break
                first = -1 - left[node]
                for a in range(first, first + right[node]):
                    if is_apart(boxes, a, moved, BOX, slack):
                        continue
                    if is_rigid:
                        cutting = meet_triangle(elements, planes, a, moved, slack, polygon)
                        if cutting >= 0:
                            add_triangle(elements, planes, a, b, cutting, slack, narrow, work)
                        continue
                    count, cutting = slice_by_level(elements, a, b, moved, slack, polygon)
                    if cutting >= 0:
                        add_cut_by_level(elements, a, b, count, cutting, slack, narrow, work)


@inlined_kernel
def half_space_and_volume(table, body_A, slab, margin, X_AB, slack, narrow, work):
    """Add the polygons, in A, of volume A and half space B.

    ``slab`` is the element of a compliant half space, -1 of a rigid one; ``margin`` the former's.
    The rest is as for ``volume_and_other``.
    """
    (R_AB, p_AB), elements = X_AB, table.elements
    n = (R_AB[2], R_AB[5], R_AB[8])
    offset = -dot(n, p_AB)
    g, c = (0.0, 0.0, 0.0), 0.0
    if slab >= 0:
        g = rotate(R_AB, (elements[slab, 16], elements[slab, 17], elements[slab, 18]))
        c = elements[slab, 19] - dot(g, p_AB)
    tree, stack = (table.node_boxes, table.node_left, table.node_right), traversal_stack()
    stack[0] = table.node_start[body_A]
    depth, below = 1, (scale(-1.0, n), margin - offset)
    while depth > 0:
        # A rigid plane only cuts what reaches to both of its sides.
        depth, node = next_leaf_above_plane(tree, stack, depth, below, slab < 0, slack)
        if node < 0 or work.counts[FULL]:
            return
        first = -1 - table.node_left[node]
        for a in range(first, first + table.node_right[node]):
            if slab < 0:
                cut_by_plane(elements, a, (n, offset), slack, narrow, work)
            else:
                plane = (n, offset - margin)
                cut_by_slab(elements, a, slab, (g, c), plane, slack, narrow, work)


@inlined_kernel
def half_space_and_surface(table, slab, margin, body_B, X_BA, slack, narrow, work):
    """Add the polygons, in B, of compliant half space A with element ``slab`` and rigid surface B.

    The rest is as for ``half_space_and_volume``.
    """
    (R_BA, p_BA), elements = X_BA, table.elements
    n = (R_BA[2], R_BA[5], R_BA[8])
    offset = -dot(n, p_BA) - margin
    g = rotate(R_BA, (elements[slab, 16], elements[slab, 17], elements[slab, 18]))
    field = (g[0], g[1], g[2], elements[slab, 19] - dot(g, p_BA))
    tree, stack = (table.node_boxes, table.node_left, table.node_right), traversal_stack()
    stack[0] = table.node_start[body_B]
    depth, below = 1, (scale(-1.0, n), -offset)
    while depth > 0:
        depth, node = next_leaf_above_plane(tree, stack, depth, below, False, slack)
        if node < 0 or work.counts[FULL]:
            return
        first = -1 - table.node_left[node]
        for t in range(first, first + table.node_right[node]):
            cut_triangle_by_slab(elements, t, slab, field, (n, offset), slack, narrow, work)
