"""Bodies to compile kernels with."""

import numpy as np

from scene_graph_ros.geometry.meshes.vertex_cells import CELL_LIMIT

__all__ = ["FACES", "TETRAHEDRON", "many_corners"]

TETRAHEDRON = np.array([[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.1, 0.0], [0.0, 0.0, 0.1]])
FACES = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])


def many_corners() -> np.ndarray:
    """Return points ``(v, 3)`` of a ball (m): so many that their hull has cells."""
    ways = np.random.default_rng(0).normal(size=(CELL_LIMIT + 1, 3))
    return 0.1 * ways / np.linalg.norm(ways, axis=1)[:, None]
