"""The convex hulls of a mesh's pieces, and the triangles that all of them together have."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.errors import MeshError
from scene_graph_ros.geometry.meshes.hull import convex_hull, Hull, triangles_of_hull
from scene_graph_ros.geometry.spatial.sums import least_squares

__all__ = ["grown", "hulls_of_pieces", "triangles_of_hulls"]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

MOST_PIECES = 4096

_ONE_PLANE = 0.1
"""Singular values of a vertex's normals below this part of the largest are of one direction."""


def hulls_of_pieces(pieces: Sequence[FloatArray], name: str) -> list[Hull]:
    """Return the hulls of points (k, 3) each; one without area is no piece.

    Raises MeshError where none is left, or there are more than MOST_PIECES.
    """
    if len(pieces) > MOST_PIECES:
        raise MeshError(f"{name}: {len(pieces)} pieces, more than {MOST_PIECES} are refused")
    hulls = [convex_hull(points) for points in pieces if len(points)]
    hulls = [hull for hull in hulls if hull.faces]
    if not hulls:
        raise MeshError(f"{name}: no piece has an area")
    return hulls


def grown(hull: Hull, by: float) -> FloatArray:
    """Return the vertices (v, 3) of a hull with each face moved outwards by so many metres.

    Where faces of a vertex are nearly in one plane, or there are many of them, they are moved by
    about as much.
    """
    counts = [len(face) for face in hull.faces]
    at = np.concatenate(hull.faces)
    normals = np.repeat(hull.normals, counts, axis=0)
    order = np.argsort(at, kind="stable")
    ends = np.flatnonzero(np.diff(at[order])) + 1
    result = hull.vertices.copy()
    for which in np.split(order, ends):
        along = normals[which]
        step = least_squares(along, np.full(len(along), by), _ONE_PLANE)
        result[at[which[0]]] += step
    return result


def triangles_of_hulls(hulls: Sequence[Hull]) -> tuple[FloatArray, IntArray]:
    """Return vertices (v, 3) and triangles (m, 3) of all hulls, those of a flat one once."""
    starts = np.cumsum([0, *(len(hull.vertices) for hull in hulls)])
    triangles = [
        triangles_of_hull(hull)[: None if len(hull.faces) > 2 else len(hull.vertices) - 2] + start
        for hull, start in zip(hulls, starts, strict=False)
    ]
    return np.concatenate([hull.vertices for hull in hulls]), np.concatenate(triangles)
