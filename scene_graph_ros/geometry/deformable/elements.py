"""Tetrahedra of deformed bodies in kernels: their corners, their planes, and walks to them."""

from scene_graph_ros.geometry.compiled.kernel import lean_kernel
from scene_graph_ros.geometry.cutting.bvh_pairs import is_apart, next_leaf_at_box
from scene_graph_ros.geometry.cutting.clip import clip_by_tetrahedron, planes_that_cut

__all__ = [
    "NO_CUT",
    "UP",
    "ZERO",
    "clipped",
    "corner",
    "load_corners",
    "next_near",
    "start_walk",
    "store_plane",
]

ZERO = (0.0, 0.0, 0.0)
UP = (0.0, 0.0, 1.0)
NO_CUT = (0, 15)
"""The masks of corners that are all on one side."""


@lean_kernel
def load_corners(vertices, tetrahedra, t, shift, corners):
    """Write the corners of a tetrahedron, moved by ``shift``, into ``corners``: x, then y, z."""
    for k in range(4):
        for axis in range(3):
            corners[4 * axis + k] = vertices[tetrahedra[t, k], axis] + shift[axis]


@lean_kernel
def corner(corners, k):
    """Return corner k of four that ``load_corners`` wrote."""
    return (corners[k], corners[4 + k], corners[8 + k])


@lean_kernel
def store_plane(planes, k, n, offset):
    """Write plane k of four, in the layout of ``clip_by_tetrahedron``."""
    for axis in range(3):
        planes[4 * axis + k] = n[axis]
    planes[12 + k] = offset


@lean_kernel
def clipped(buffer, size, n, planes, slack, heights):
    """Keep the part of a polygon with normal n inside four planes; return (side, size)."""
    cutting = planes_that_cut(buffer[0], size, n, planes, slack)
    if cutting < 0:
        return 0, 0
    return clip_by_tetrahedron(buffer, size, n, planes, cutting, slack, heights)


@lean_kernel
def next_near(tree, boxes, is_solid, walk, box, slack):
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
            if is_solid[t] and not is_apart(boxes, t, box, 0, slack):
                return t
        state[0], node = next_leaf_at_box((nodes, left, right), stack, state[0], box, 0, slack)
        if node < 0:
            return -1
        state[1] = -1 - left[node]
        state[2] = state[1] + right[node]


@lean_kernel
def start_walk(walk):
    """Begin a walk at the root."""
    stack, state = walk
    stack[0] = 0
    state[0], state[1], state[2] = 1, 0, 0
