"""Convex functions of edges' costs: estimates of their largest values, and their slopes."""

from __future__ import annotations

import numpy as np

from scene_graph_ros.convex.graphs.expressions.expressions import value_of
from scene_graph_ros.convex.graphs.expressions.term_kernels import KINDS, values

__all__ = ["sizes_of_atoms", "slope_of"]

_LEAST = 1e-300
"""In place of 0, where it is divided by."""


def sizes_of_atoms(kind: str, most: np.ndarray, constant: np.ndarray) -> np.ndarray:
    """Return estimates of atoms' values ``(G,)``, from bounds of their vectors and central values.

    Both are ``(G, k)``. Of norms and squares no vector costs more; quotients are those of the
    largest divisor.
    """
    if kind == "exponential":
        most = constant
    elif kind == "quotient":
        most = np.concatenate([np.maximum(most[:, :1], _LEAST), most[:, 1:]], axis=1)
    found: np.ndarray = values(KINDS[kind], np.ascontiguousarray(most))
    return found


def slope_of(kind: str, w: np.ndarray) -> np.ndarray:
    """Return a subgradient ``(k,)`` of one atom at a vector."""
    if kind == "squares":
        return 2.0 * w
    if kind == "exponential":
        return np.array([value_of(kind, w)])
    if kind == "quotient":
        if not w[0] > 0.0:
            return np.zeros(len(w))
        q = w[1:] / w[0]
        return np.append(-float(q @ q), 2.0 * q)
    if kind == "norm":
        length = float(np.linalg.norm(w))
        return w / length if length else w
    largest = int(np.abs(w).argmax())
    return np.asarray(np.sign(w[largest]) * (np.arange(len(w)) == largest))
