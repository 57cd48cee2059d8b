"""The boxes around triangles."""

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.compiled.kernel import kernel
from scene_graph_ros.geometry.meshes.kernel_arrays import for_kernels

__all__ = ["triangle_boxes"]

FloatArray = NDArray[np.float64]


def triangle_boxes(
    vertices: FloatArray, triangles: NDArray[np.int64]
) -> tuple[FloatArray, FloatArray]:
    """Return the lower and the upper corners (m, 3) of the boxes around (m, 3) triangles."""
    lower, upper = _boxes(for_kernels(vertices), for_kernels(triangles))
    return lower, upper


@kernel
def _boxes(vertices, triangles):
    """Return the lower and the upper corners."""
    lower = np.empty((len(triangles), 3))
    upper = np.empty((len(triangles), 3))
    for t in range(len(triangles)):
        i, j, k = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        for axis in range(3):
            a, b, c = vertices[i, axis], vertices[j, axis], vertices[k, axis]
            lower[t, axis] = min(min(a, b), c)
            upper[t, axis] = max(max(a, b), c)
    return lower, upper
