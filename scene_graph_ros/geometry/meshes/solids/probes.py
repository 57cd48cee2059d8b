"""Random points at which closed triangles are asked how often they wind around them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.meshes.distinct_rows import used_indices
from scene_graph_ros.geometry.meshes.solids.winding import Tree, winding_numbers

__all__ = ["probes", "wound_otherwise"]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

_SAMPLES = 256
"""Points in the box, and as many beside vertices."""


def probes(vertices: FloatArray, triangles: IntArray) -> FloatArray:
    """Return points (n, 3) in the box of triangles (m, 3), and beside their vertices."""
    rng = np.random.default_rng(2)
    corners = vertices[used_indices(triangles, len(vertices))[0]]
    lower, upper = corners.min(axis=0), corners.max(axis=0)
    spread = rng.uniform(lower, upper, (_SAMPLES, 3))
    beside = corners[rng.integers(len(corners), size=_SAMPLES)]
    beside = beside + rng.normal(scale=1e-3 * float((upper - lower).max()), size=beside.shape)
    return np.concatenate([spread, beside])


def wound_otherwise(
    vertices: FloatArray, triangles: IntArray, tree: Tree | None = None
) -> FloatArray | None:
    """Return a probe (3,) around which triangles (m, 3) wind neither once nor not at all, or None.

    Where a surface crosses itself along edges that lie in triangles, no triangle crosses another.
    """
    samples = probes(vertices, triangles)
    numbers = winding_numbers(samples, vertices, triangles, tree=tree)
    rows = np.flatnonzero((numbers != 0) & (numbers != 1))
    return np.asarray(samples[rows[0]]) if len(rows) else None
