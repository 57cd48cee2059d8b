"""Walk over triangles from neighbour to neighbour: which belong together, and which are turned."""

import numpy as np

from scene_graph_ros.geometry.compiled.kernel import kernel

__all__ = ["count_apart", "walk_parts"]


@kernel
def walk_parts(mate, start):
    """Find the parts of triangles that are joined by half edges with a mate.

    Args:
        mate: (3 m,) the half edge across each, or -1.
        start: (3 m,) the vertex that each half edge begins at.

    Returns:
        (label, turned, is_two_sided): for each triangle (m,) its part, counted from 0 in the order
        of the triangles, and whether it runs the other way than the part's first one; for each
        part, whether that can be said.

    """
    m = len(mate) // 3
    label = np.full(m, -1, np.int64)
    turned = np.zeros(m, np.bool_)
    is_two_sided = np.ones(m, np.bool_)
    stack = np.empty(m, np.int64)
    count = 0
    for first in range(m):
        if label[first] >= 0:
            continue
        label[first] = count
        stack[0], depth = first, 1
        while depth > 0:
            depth -= 1
            t = stack[depth]
            for k in range(3):
                across = mate[3 * t + k]
                if across < 0:
                    continue
                other = across // 3
                # Neighbours that run alike go through their edge in opposite ways.
                is_turned = turned[t] != (start[across] == start[3 * t + k])
                if label[other] < 0:
                    label[other] = count
                    turned[other] = is_turned
                    stack[depth] = other
                    depth += 1
                elif turned[other] != is_turned:
                    is_two_sided[count] = False
        count += 1
    return label, turned, is_two_sided[:count].copy()


@kernel
def count_apart(triangles, n):
    """Return the number of sets of triangles (m, 3) that have none of n vertices in common."""
    parent = np.arange(n)
    is_used = np.zeros(n, np.bool_)
    count = 0
    for t in range(len(triangles)):
        for k in range(3):
            i = triangles[t, k]
            if not is_used[i]:
                is_used[i] = True
                count += 1
            while parent[i] != i:
                parent[i] = parent[parent[i]]
                i = parent[i]
            if k == 0:
                root = i
            elif i != root:
                # The lower one, so that few steps lead up where a file writes part by part.
                root, i = min(i, root), max(i, root)
                parent[i] = root
                count -= 1
    return count
