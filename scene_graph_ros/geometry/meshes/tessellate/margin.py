"""A layer around a solid: one prism on each triangle of its surface, in three tetrahedra.

The vertices of the surface move so far that every face around them moves out by the margin, by
the shortest way. The solid itself is left as it is, and so is its surface of extent 0.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.errors import MeshError
from scene_graph_ros.geometry.meshes.tessellate.solid import Solid
from scene_graph_ros.geometry.meshes.volume_mesh import VolumeMesh
from scene_graph_ros.geometry.tolerances import MARGIN_DEFECT

__all__ = ["grown"]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

_SWEEPS = 1000
"""Sweeps over the faces around all vertices; vertices of a convex body need a few tens."""


def grown(solid: Solid, margin: float, depth: float, name: str) -> Solid:
    """Return the solid with a layer of thickness ``margin`` around it.

    Args:
        solid: any; its vertices on the surface come first.
        margin: metres, above 0.
        depth: metres that the extent 1 stands for.
        name: the shape's name in messages.

    Returns:
        the outer vertices first, with an extent of ``-margin / depth``, then those of ``solid``.

    Raises:
        MeshError: a vertex whose faces cannot all move out, or a layer that would fold over,
            as in a hole narrower than the layer.

    """
    count = solid.surface_count
    offsets = _offsets(solid.vertices[:count], solid.triangles, margin, name)
    vertices = np.concatenate([solid.vertices[:count] + offsets, solid.vertices])
    layer = _prisms(solid.triangles, count)
    if not (VolumeMesh.trusted(vertices, layer).volumes() > 0.0).all():
        raise MeshError(
            f"the margin {margin:g} m of {name} is too large for its mesh: the layer folds over"
        )
    extent = np.concatenate([np.full(count, -margin / depth), solid.extent])
    tetrahedra = np.concatenate([solid.tetrahedra + count, layer])
    return Solid(vertices, tetrahedra, solid.triangles, extent)


def _prisms(triangles: IntArray, count: int) -> IntArray:
    """Cut the prisms between inner and outer triangles into tetrahedra, (3 t, 4).

    The diagonal of each side starts at its inner vertex of lower number, so that neighbours agree.
    """
    a, b, c = np.take_along_axis(triangles, np.argsort(triangles, axis=1, kind="stable"), axis=1).T
    inner_a, inner_b, inner_c = a + count, b + count, c + count
    parts = [
        (inner_a, inner_b, inner_c, c),
        (inner_a, inner_b, c, b),
        (inner_a, b, c, a),
    ]
    tetrahedra = np.concatenate([np.stack(rows, axis=1) for rows in parts])
    order = np.argsort(triangles, axis=1, kind="stable")
    is_even = (np.roll(order, -1, axis=1) - order == 1).sum(axis=1) == 2
    wrong = np.tile(~is_even, len(parts))
    tetrahedra[wrong, 0], tetrahedra[wrong, 1] = (
        tetrahedra[wrong, 1],
        tetrahedra[wrong, 0].copy(),
    )
    return tetrahedra


def _offsets(vertices: FloatArray, triangles: IntArray, margin: float, name: str) -> FloatArray:
    """Return the shortest displacement of each vertex that moves all its faces by ``margin``.

    Per vertex a quadratic programme, ``min |d|^2 with n . d >= margin`` for its triangles,
    solved in its dual by coordinate ascent (Hildreth 1957), for all vertices at once.
    """
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    corner = triangles.reshape(-1)
    order = np.argsort(corner, kind="stable")
    valence = np.bincount(corner, minlength=len(vertices))
    start = np.concatenate([[0], np.cumsum(valence)[:-1]])
    around = normals[order // 3]
    offsets = np.zeros_like(vertices)
    multiplier = np.zeros(len(around))
    for _ in range(_SWEEPS):
        for k in range(int(valence.max())):
            rows = np.flatnonzero(valence > k)
            face = start[rows] + k
            short = 1.0 - np.einsum("ij,ij->i", around[face], offsets[rows])
            added = np.maximum(short, -multiplier[face])
            multiplier[face] += added
            offsets[rows] += added[:, None] * around[face]
        reached = np.einsum("ij,ij->i", around, np.repeat(offsets, valence, axis=0))
        if (reached >= 1.0 - MARGIN_DEFECT).all():
            return margin * offsets
    raise MeshError(
        f"the margin of {name}: the faces around a vertex cannot all move out; smooth the mesh"
    )
