"""Graphs as callers give them: symmetric matrices of which vertices are adjacent."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.errors import SceneGraphError
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.real_arrays import real_array

__all__ = ["CliqueError", "checked_adjacency", "is_clique", "sparse"]


class CliqueError(SceneGraphError, ValueError):
    """A matrix that is no graph, or a solver's answer that is no clique."""


def checked_adjacency(adjacency_matrix: Any) -> NDArray[np.bool_]:
    """Return a graph as a dense matrix ``(n, n)`` of bool, without vertices' edges to themselves.

    It may come as a sparse matrix or as an array of bool, or of 0 and 1. Raises CliqueError naming
    the shape, the entry, or the first pair that is not symmetric.
    """
    given = adjacency_matrix
    dense = given.toarray() if hasattr(given, "toarray") else given
    rule = "adjacency_matrix must have entries of bool, or 0 and 1"
    array = real_array(dense, rule, CliqueError)
    entries = array.astype(np.bool_)
    if array.ndim != 2 or array.shape[0] != array.shape[1]:
        raise CliqueError(f"adjacency_matrix must have the shape (n, n), not {array.shape}")
    if not (array == entries).all():
        raise CliqueError(f"{rule}, not {quoted(given)}")
    uneven = np.argwhere(entries != entries.T)
    if len(uneven):
        i, j = uneven[0].tolist()
        raise CliqueError(
            f"adjacency_matrix must be symmetric; [{i}, {j}] is {bool(entries[i, j])}, [{j}, {i}]"
            f" is {bool(entries[j, i])}"
        )
    np.fill_diagonal(entries, False)
    return entries


def is_clique(adjacent: NDArray[np.bool_], members: Iterable[int]) -> bool:
    """Tell whether all of some vertices are adjacent to each other."""
    rows = np.fromiter(members, dtype=np.intp)
    return int(adjacent[np.ix_(rows, rows)].sum()) == len(rows) * (len(rows) - 1)


def sparse(adjacent: NDArray[np.bool_]) -> Any:
    """Return a dense matrix as a csc_matrix of bool, the argument of solvers of one's own."""
    from scipy.sparse import csc_matrix

    return csc_matrix(adjacent)
