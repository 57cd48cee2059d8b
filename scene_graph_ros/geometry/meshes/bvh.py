"""Bounding volume hierarchies over triangles, as flat arrays for kernels."""

import numpy as np

from scene_graph_ros.geometry.compiled.kernel import kernel
from scene_graph_ros.geometry.compiled.stack_arrays import stack_array
from scene_graph_ros.geometry.spatial.vectors import load_vector, store_vector

__all__ = ["LEAF_TRIANGLES", "MAX_DEPTH", "STACK_SIZE", "build_bvh", "traversal_stack"]

LEAF_TRIANGLES = 4
"""A node with at most this many triangles is not split."""

MAX_DEPTH = 64
"""Halving the number of triangles 64 times passes any array, so a stack of this size suffices."""

STACK_SIZE = 2 * MAX_DEPTH + 2
"""Entries of a stack: enough for a walk through two trees of the largest depth at once."""

traversal_stack = stack_array((STACK_SIZE,), np.int64)
"""Return an uninitialized array of ``STACK_SIZE`` int64."""


@kernel
def _select(order, keys, first, last, middle):
    """Move the smallest keys[first:last], and order's, before ``middle`` (Hoare's quickselect)."""
    low, high = first, last - 1
    while low < high:
        pivot = keys[(low + high) // 2]
        i, j = low, high
        while i <= j:
            while keys[i] < pivot:
                i += 1
            while keys[j] > pivot:
                j -= 1
            if i <= j:
                order[i], order[j] = order[j], order[i]
                keys[i], keys[j] = keys[j], keys[i]
                i += 1
                j -= 1
        if middle <= j:
            high = j
        elif middle >= i:
            low = i
        else:
            return


@kernel
def _enclose(order, first, last, lower, upper, node_lower, node_upper, node):
    """Write the box around the boxes order[first:last] to a node."""
    low, high = load_vector(lower, order[first]), load_vector(upper, order[first])
    for slot in range(first + 1, last):
        k = order[slot]
        low = min(low[0], lower[k, 0]), min(low[1], lower[k, 1]), min(low[2], lower[k, 2])
        high = max(high[0], upper[k, 0]), max(high[1], upper[k, 1]), max(high[2], upper[k, 2])
    store_vector(node_lower, node, low)
    store_vector(node_upper, node, high)


@kernel
def _longest_axis(lower, upper, node):
    """Return the axis along which a node's box is longest."""
    x = upper[node, 0] - lower[node, 0]
    y = upper[node, 1] - lower[node, 1]
    z = upper[node, 2] - lower[node, 2]
    if x >= y and x >= z:
        return 0
    return 1 if y >= z else 2


@kernel
def _push(stack, depth, node, first, last):
    """Write a range to be split into a row of the stack."""
    stack[depth, 0] = node
    stack[depth, 1] = first
    stack[depth, 2] = last


@kernel
def build_bvh(lower, upper):
    """Build a tree over n boxes, split at the median of centres along the longest side.

    Args:
        lower: (n, 3) lower corners, n > 0.
        upper: (n, 3) upper corners.

    Returns:
        (node_lower, node_upper, node_left, node_right, order) as in ``Surfaces``, with rows
        counted from 0; children follow their parent.

    """
    n = len(lower)
    capacity = 2 * n
    node_lower = np.empty((capacity, 3))
    node_upper = np.empty((capacity, 3))
    left = np.empty(capacity, np.int64)
    right = np.empty(capacity, np.int64)
    order = np.arange(n)
    centre = np.empty(n)
    stack = np.empty((MAX_DEPTH, 3), np.int64)
    _push(stack, 0, 0, 0, n)
    depth, count = 1, 1
    while depth > 0:
        depth -= 1
        node, first, last = stack[depth, 0], stack[depth, 1], stack[depth, 2]
        _enclose(order, first, last, lower, upper, node_lower, node_upper, node)
        if last - first <= LEAF_TRIANGLES:
            left[node] = -1 - first
            right[node] = last - first
            continue
        axis = _longest_axis(node_lower, node_upper, node)
        for k in range(first, last):
            centre[k] = lower[order[k], axis] + upper[order[k], axis]
        middle = (first + last) // 2
        _select(order, centre, first, last, middle)
        left[node], right[node] = count, count + 1
        _push(stack, depth, count + 1, middle, last)
        _push(stack, depth + 1, count, first, middle)
        depth += 2
        count += 2
    return (
        node_lower[:count].copy(),
        node_upper[:count].copy(),
        left[:count].copy(),
        right[:count].copy(),
        order,
    )
