"""The prisms of height fields, each as a convex hull of its own."""

import numpy as np

from scene_graph_ros.geometry import Convex


def prisms_of(shape, heights=None):
    """Return (center, hull about it) of each prism of a field, in the order of its elements."""
    heights = shape.heights if heights is None else heights
    x, y = shape.x(), shape.y()
    result = []
    for i in range(heights.shape[0] - 1):
        for j in range(heights.shape[1] - 1):
            for ways in (((0, 0), (0, 1), (1, 1)), ((0, 0), (1, 1), (1, 0))):
                top = np.array([(x[j + v], y[i + u], heights[i + u, j + v]) for u, v in ways])
                bottom = np.column_stack([top[:, :2], np.full(3, shape.floor)])
                corners = np.concatenate([top, bottom])
                center = corners.mean(axis=0)
                result.append((center, Convex(vertices=corners - center)))
    return result
