"""Dividing the tetrahedra of a mesh until no edge is too long.

An edge that is the longest of every tetrahedron around it is halved, and they with it; the mesh
stays conforming, and the pieces do not get flatter without bound (Rivara, "Local modification of
meshes for adaptive and/or multigrid finite-element methods", 1991). Edges of equal length are
told apart by their vertices, so there always is such an edge while one is too long, and all there
are at a time are halved at once.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.errors import MeshError
from scene_graph_ros.geometry.meshes.tessellate.counts import MAX_ELEMENTS
from scene_graph_ros.geometry.meshes.volume_mesh import VolumeMesh

__all__ = ["with_short_edges"]

_EDGES = np.array([[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]])

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


def with_short_edges(mesh: VolumeMesh, longest: float) -> VolumeMesh:
    """Return the same solid in tetrahedra with no edge longer than ``longest`` (metres, > 0).

    Its first vertices are those of ``mesh``. Raises MeshError if there would be more than
    MAX_ELEMENTS tetrahedra.
    """
    # No tetrahedron with such edges is larger than the regular one.
    _check_count(mesh, longest, mesh.volume * 6.0 * math.sqrt(2.0) / longest / longest / longest)
    vertices, tetrahedra = mesh.vertices, mesh.tetrahedra
    while True:
        ends, edge_of, longest_first = _ranked_edges(vertices, tetrahedra)
        span = vertices[ends[:, 1]] - vertices[ends[:, 0]]
        too_long = np.einsum("ij,ij->i", span, span) > longest * longest
        if not too_long.any():
            return VolumeMesh.trusted(vertices, tetrahedra)
        # Of each tetrahedron the longest edge; those that are it for all around them are halved.
        top = edge_of[np.arange(len(edge_of)), longest_first[edge_of].argmin(axis=1)]
        around = np.bincount(edge_of.ravel(), minlength=len(ends))
        is_halved = (np.bincount(top, minlength=len(ends)) == around) & too_long
        vertices, tetrahedra = _halve(vertices, tetrahedra, ends, top, is_halved)
        _check_count(mesh, longest, len(tetrahedra))


def _check_count(mesh: VolumeMesh, longest: float, count: float) -> None:
    if count > MAX_ELEMENTS:
        raise MeshError(
            f"edges of {longest:g} m in a solid of {mesh.volume:g} m^3 ask for at least"
            f" {count:.3g} tetrahedra; more than {MAX_ELEMENTS} are refused: allow longer ones"
        )


def _ranked_edges(
    vertices: FloatArray, tetrahedra: IntArray
) -> tuple[IntArray, IntArray, IntArray]:
    """Return the edges ``(e, 2)``, those of each tetrahedron ``(t, 6)``, and ranks ``(e,)``.

    Rank 0 is the longest edge.
    """
    pairs = np.sort(tetrahedra[:, _EDGES].reshape(-1, 2), axis=1)
    keys, edge_of = np.unique(pairs[:, 0] * len(vertices) + pairs[:, 1], return_inverse=True)
    ends = np.stack([keys // len(vertices), keys % len(vertices)], axis=1)
    span = vertices[ends[:, 1]] - vertices[ends[:, 0]]
    rank = np.empty(len(ends), np.int64)
    rank[np.argsort(-np.einsum("ij,ij->i", span, span), kind="stable")] = np.arange(len(ends))
    return ends, edge_of.reshape(-1, 6), rank


def _halve(
    vertices: FloatArray,
    tetrahedra: IntArray,
    ends: IntArray,
    top: IntArray,
    is_halved: NDArray[np.bool_],
) -> tuple[FloatArray, IntArray]:
    """Halve edges, each the ``top`` one of all tetrahedra around it."""
    middle = np.full(len(ends), -1)
    middle[is_halved] = len(vertices) + np.arange(int(is_halved.sum()))
    halved = ends[is_halved]
    vertices = np.concatenate(
        [vertices, 0.5 * vertices[halved[:, 0]] + 0.5 * vertices[halved[:, 1]]]
    )
    is_cut = is_halved[top]
    cut, edges = tetrahedra[is_cut], top[is_cut]
    # One half keeps the one end, the other the other; corners keep their places, and so their
    # orientation.
    halves = [
        np.where(cut == ends[edges, side][:, None], middle[edges][:, None], cut) for side in (0, 1)
    ]
    return vertices, np.concatenate([tetrahedra[~is_cut], *halves])
