"""Walks down bounding volume hierarchies to the leaves that may meet another body.

Two trees are walked one after the other: first one against the whole of the other body, which is
turned, then, for each element that is left, the other against the box of that element, which by
then is aligned, so that most of the tests are six comparisons.

The trees are those of ``meshes.bvh.build_bvh``, many of them in one set of arrays: a ``tree`` is
(boxes, left, right) with boxes as centre and half extents ``(N, 6)`` and children ``(N,)``, or
``-1 - first`` of a leaf, which has ``right`` elements. A walk keeps a ``traversal_stack`` of nodes
still to be looked at, at first the root, and its depth. Each step returns (depth, node): the new
depth and the leaf, -1 at the end.
"""

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel

__all__ = [
    "absolute_rotation",
    "boxes_meet",
    "is_apart",
    "next_leaf_above_plane",
    "next_leaf_at_box",
    "next_leaf_near_box",
]


@lean_kernel
def absolute_rotation(R):
    """Return the magnitudes of the entries of a rotation."""
    return (
        abs(R[0]), abs(R[1]), abs(R[2]),
        abs(R[3]), abs(R[4]), abs(R[5]),
        abs(R[6]), abs(R[7]), abs(R[8]),
    )  # fmt: skip


@lean_kernel
def boxes_meet(boxes_A, a, boxes_B, b, R, absolute, p, slack):
    """Tell whether box a may meet box b, by the six directions of their faces.

    Args:
        boxes_A: (n, 6) centres and half extents in A.
        a: row.
        boxes_B: the same in B.
        b: row.
        R: R_AB.
        absolute: of its entries.
        p: p_AB.
        slack: metres by which boxes are taken as larger.

    """
    x, y, z = boxes_B[b, 0], boxes_B[b, 1], boxes_B[b, 2]
    u, v, w = boxes_B[b, 3], boxes_B[b, 4], boxes_B[b, 5]
    e, f, g = boxes_A[a, 3], boxes_A[a, 4], boxes_A[a, 5]
    tx = R[0] * x + R[1] * y + R[2] * z + p[0] - boxes_A[a, 0]
    if abs(tx) > e + absolute[0] * u + absolute[1] * v + absolute[2] * w + slack:
        return False
    ty = R[3] * x + R[4] * y + R[5] * z + p[1] - boxes_A[a, 1]
    if abs(ty) > f + absolute[3] * u + absolute[4] * v + absolute[5] * w + slack:
        return False
    tz = R[6] * x + R[7] * y + R[8] * z + p[2] - boxes_A[a, 2]
    if abs(tz) > g + absolute[6] * u + absolute[7] * v + absolute[8] * w + slack:
        return False
    if abs(R[0] * tx + R[3] * ty + R[6] * tz) > (
        u + absolute[0] * e + absolute[3] * f + absolute[6] * g + slack
    ):
        return False
    if abs(R[1] * tx + R[4] * ty + R[7] * tz) > (
        v + absolute[1] * e + absolute[4] * f + absolute[7] * g + slack
    ):
        return False
    return abs(R[2] * tx + R[5] * ty + R[8] * tz) <= (
        w + absolute[2] * e + absolute[5] * f + absolute[8] * g + slack
    )


@lean_kernel
def next_leaf_near_box(tree, stack, depth, other, turned, slack):
    """Go on to the next leaf of A's tree whose box may meet one that is turned.

    Args:
        tree: A's.
        stack: nodes.
        depth: how many.
        other: (boxes, b): row b of B's boxes.
        turned: (R_AB, the magnitudes of its entries, p_AB).
        slack: metres by which boxes are taken as larger.

    """
    (boxes, left, right), (boxes_B, b), (R, absolute, p) = tree, other, turned
    while depth > 0:
        depth -= 1
        node = stack[depth]
        if not boxes_meet(boxes, node, boxes_B, b, R, absolute, p, slack):
            continue
        if left[node] < 0:
            return depth, node
        stack[depth], stack[depth + 1] = right[node], left[node]
        depth += 2
    return depth, -1


@inlined_kernel
def is_apart(boxes, row, box, at, slack):
    """Tell whether the box in ``row`` and the one at entry ``at`` of array ``box`` don't meet."""
    return (
        abs(box[at] - boxes[row, 0]) > boxes[row, 3] + box[at + 3] + slack
        or abs(box[at + 1] - boxes[row, 1]) > boxes[row, 4] + box[at + 4] + slack
        or abs(box[at + 2] - boxes[row, 2]) > boxes[row, 5] + box[at + 5] + slack
    )


@inlined_kernel
def next_leaf_at_box(tree, stack, depth, box, at, slack):
    """Go on to the next leaf whose box meets an aligned one, entries ``at`` on of ``box``."""
    boxes, left, right = tree
    while depth > 0:
        depth -= 1
        node = stack[depth]
        if is_apart(boxes, node, box, at, slack):
            continue
        if left[node] < 0:
            return depth, node
        stack[depth], stack[depth + 1] = right[node], left[node]
        depth += 2
    return depth, -1


@lean_kernel
def next_leaf_above_plane(tree, stack, depth, plane, both, slack):
    """Go on to the next leaf whose box reaches into ``n . x + offset >= 0``.

    ``plane`` is (n, offset), a unit vector and metres. With ``both`` the box must reach below it,
    too.
    """
    (boxes, left, right), (n, offset) = tree, plane
    while depth > 0:
        depth -= 1
        node = stack[depth]
        height = offset + n[0] * boxes[node, 0] + n[1] * boxes[node, 1] + n[2] * boxes[node, 2]
        reach = slack + abs(n[0]) * boxes[node, 3]
        reach += abs(n[1]) * boxes[node, 4] + abs(n[2]) * boxes[node, 5]
        if height < -reach or (both and height > reach):
            continue
        if left[node] < 0:
            return depth, node
        stack[depth], stack[depth + 1] = right[node], left[node]
        depth += 2
    return depth, -1
