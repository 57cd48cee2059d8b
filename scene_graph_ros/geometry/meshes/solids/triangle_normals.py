"""The unit normals of triangles."""

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.compiled.kernel import kernel
from scene_graph_ros.geometry.meshes.kernel_arrays import for_kernels
from scene_graph_ros.geometry.spatial.vectors import cross, load_vector, norm, subtract

__all__ = ["unit_normals"]


def unit_normals(
    vertices: NDArray[np.float64], triangles: NDArray[np.int64]
) -> NDArray[np.float64]:
    """Return the normals (m, 3) of (m, 3) triangles over (v, 3) vertices, 0 without area."""
    return np.asarray(_normals(for_kernels(vertices), for_kernels(triangles)))


@kernel
def _normals(vertices, triangles):
    """Return (m, 3) unit normals."""
    result = np.empty((len(triangles), 3))
    for t in range(len(triangles)):
        a = load_vector(vertices, triangles[t, 0])
        n = cross(
            subtract(load_vector(vertices, triangles[t, 1]), a),
            subtract(load_vector(vertices, triangles[t, 2]), a),
        )
        length = norm(n)
        if not length > 0.0:
            length = 1.0
        for axis in range(3):
            result[t, axis] = n[axis] / length
    return result
