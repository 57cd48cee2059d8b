"""Draw points of a polyhedron."""

from __future__ import annotations

from typing import Any

import numpy as np

from scene_graph_ros.geometry.optimization.errors import ConvexSetError
from scene_graph_ros.geometry.optimization.sets.arguments import (
    as_matrix,
    as_nonnegative,
    as_vector,
)
from scene_graph_ros.geometry.optimization.solve.hit_and_run import hit_and_run

__all__ = ["draw"]

_START_OUTSIDE = 1e-8
"""In the set's own units: how far outside a start may be."""


def draw(
    polyhedron: Any,
    generator: np.random.Generator,
    previous: Any,
    mixing_steps: int,
    subspace: Any,
    tol: float,
) -> np.ndarray:
    """Walk ``mixing_steps`` steps in a polyhedron, as `HPolyhedron.uniform_sample` says."""
    label, n = "HPolyhedron.uniform_sample", polyhedron.ambient_dimension
    if n == 0:
        return np.zeros(0)
    x = (
        polyhedron.chebyshev_center()
        if previous is None
        else as_vector(previous, f"{label}: previous_sample", n)
    )
    if not polyhedron.point_in_set(x, _START_OUTSIDE):
        raise ConvexSetError(
            f"{label}: previous_sample {x.tolist()} is outside; start with a point of the set"
        )
    basis = np.eye(n) if subspace is None else as_matrix(subspace, f"{label}: subspace")
    if len(basis) != n:
        raise ConvexSetError(f"{label}: subspace must have the shape ({n}, k), not {basis.shape}")
    lengths = np.linalg.norm(polyhedron.A, axis=1)
    A, b = polyhedron.A[lengths > 0.0], polyhedron.b[lengths > 0.0]
    A, b = A / lengths[lengths > 0.0, None], b / lengths[lengths > 0.0]
    crosses = np.linalg.norm(A @ basis, axis=1) > as_nonnegative(tol, f"{label}: tol")
    A, slack, step = A[crosses], (b - A @ x)[crosses], np.zeros(n)
    ways = generator.normal(size=(mixing_steps, basis.shape[1])) @ basis.T
    shares = generator.random(mixing_steps)
    if basis.shape[1] and not hit_and_run(A, slack, ways @ A.T, ways, shares, step):
        raise ConvexSetError(f"{label}: the set is unbounded; intersect it with a box")
    return x + step
