"""All shapes of a scene as arrays, which kernels read instead of Python objects.

Row i of a ``ShapeTable`` describes shape i in its own frame G. Hulls and triangle surfaces are
shared: two rows with the same source and scale hold the same index. Every array is C-contiguous
and writable, so that one compiled signature fits all tables; nobody writes to a table after it
was built. ``shape_table`` builds them. Kernels need not know how, so that they are not compiled
anew where a reader of meshes changes.
"""

from typing import NamedTuple

import numpy as np

__all__ = ["Hulls", "ShapeTable", "Surfaces", "empty_table"]


class Hulls(NamedTuple):
    """Convex hulls in compressed rows; every position is in G, with the scale applied.

    A hull of collinear or coplanar points is degenerate: a point and a segment have no faces, a
    flat polygon has two, of opposite normals. Vertices and adjacency are complete in any case.
    """

    vertex_start: np.ndarray
    """(h+1,) int64: hull k owns vertices ``vertex_start[k]:vertex_start[k+1]``."""
    vertices: np.ndarray
    """(V, 3) metres."""
    neighbor_start: np.ndarray
    """(V+1,) int64: vertex v owns ``neighbors[neighbor_start[v]:neighbor_start[v+1]]``."""
    neighbors: np.ndarray
    """(E,) int64 indices into ``vertices``: the other ends of the hull's edges."""
    face_start: np.ndarray
    """(h+1,) int64: hull k owns faces ``face_start[k]:face_start[k+1]``."""
    face_normals: np.ndarray
    """(F, 3) unit vectors out of the hull."""
    face_offsets: np.ndarray
    """(F,) metres: inside is where ``face_normals @ x <= face_offsets``."""
    face_vertex_start: np.ndarray
    """(F+1,) int64: face f owns ``face_vertices[face_vertex_start[f]:face_vertex_start[f+1]]``."""
    face_vertices: np.ndarray
    """int64 indices into ``vertices``, counter-clockwise seen from outside. Coplanar triangles
    are merged, so a face is a convex polygon."""
    block_start: np.ndarray
    """(h,) int64: where the block of hull k starts in ``blocks``."""
    blocks: np.ndarray
    """(P,) float64: vertices, neighbors and planes once more, in one array, as the general convex
    algorithm reads them (``tables.hull_blocks``). Nine arrays in the arguments of each of its
    functions take longer to copy than most of what they compute."""


class Surfaces(NamedTuple):
    """Triangle meshes for exact queries, each with a bounding volume hierarchy; in G, scaled."""

    vertex_start: np.ndarray
    """(m+1,) int64."""
    vertices: np.ndarray
    """(V, 3) metres."""
    triangle_start: np.ndarray
    """(m+1,) int64."""
    triangles: np.ndarray
    """(T, 3) int64 indices into ``vertices``, counter-clockwise seen from outside."""
    normals: np.ndarray
    """(T, 3) unit vectors."""
    vertex_pseudonormals: np.ndarray
    """(V, 3) unit vectors: face normals weighted by the angle at the vertex."""
    edge_pseudonormals: np.ndarray
    """(T, 3, 3) unit vectors: ``[t, k]`` is the mean normal at the edge from corner k to corner
    k+1 of triangle t; the triangle's own normal at a border."""
    part: np.ndarray
    """(T,) int64: which part of its mesh a triangle belongs to, counted from 0 and ascending:
    first the parts of the solid's boundary, then the sheets."""
    solid_parts: np.ndarray
    """(m,) int64: how many parts bound the mesh's solid; 0 for a mesh without an inside."""
    node_start: np.ndarray
    """(m+1,) int64: surface k owns nodes ``node_start[k]:node_start[k+1]``; the first is its
    root."""
    node_lower: np.ndarray
    """(N, 3) metres."""
    node_upper: np.ndarray
    """(N, 3) metres."""
    node_left: np.ndarray
    """(N,) int64: the left child's row, or ``-1 - slot`` at a leaf, whose triangles are
    ``order[slot : slot + node_right]``."""
    node_right: np.ndarray
    """(N,) int64: the right child's row, or the number of triangles at a leaf."""
    order: np.ndarray
    """(T,) int64: triangle rows in the order of the leaves."""


class ShapeTable(NamedTuple):
    """The shapes of n rows."""

    kind: np.ndarray
    """(n,) int32: a ``ShapeKind``."""
    size: np.ndarray
    """(n, 3) metres: sphere (r, 0, 0); capsule and cylinder (r, L/2, 0); box half extents;
    ellipsoid (a, b, c); zeros otherwise."""
    hull: np.ndarray
    """(n,) int32: the row's hull (``Convex``, ``Mesh``) or -1."""
    surface: np.ndarray
    """(n,) int32: the row's triangles (``Mesh``) or -1."""
    exact: np.ndarray
    """(n,) bool: contact and distance of this mesh use its triangles, not its hull. False for a
    mesh that is convex, where both are the same surface."""
    lower: np.ndarray
    """(n, 3) metres: bounding box in G; infinite for a half space."""
    upper: np.ndarray
    """(n, 3) metres."""
    scale: np.ndarray
    """(n,) metres: the largest extent of the bounding box; 0 for a half space."""
    hulls: Hulls
    surfaces: Surfaces


def empty_table() -> ShapeTable:
    """Return a table of no shapes, whose arrays have the types of all tables."""

    def ints(rows: int = 0, *columns: int) -> np.ndarray:
        return np.zeros((rows, *columns), dtype=np.int64)

    def floats(*shape: int) -> np.ndarray:
        return np.zeros((0, *shape))

    def indices() -> np.ndarray:
        return np.zeros(0, dtype=np.int32)

    return ShapeTable(
        kind=indices(),
        size=floats(3),
        hull=indices(),
        surface=indices(),
        exact=np.zeros(0, dtype=np.bool_),
        lower=floats(3),
        upper=floats(3),
        scale=floats(),
        hulls=Hulls(
            vertex_start=ints(1),
            vertices=floats(3),
            neighbor_start=ints(1),
            neighbors=ints(),
            face_start=ints(1),
            face_normals=floats(3),
            face_offsets=floats(),
            face_vertex_start=ints(1),
            face_vertices=ints(),
            block_start=ints(),
            blocks=floats(),
        ),
        surfaces=Surfaces(
            vertex_start=ints(1),
            vertices=floats(3),
            triangle_start=ints(1),
            triangles=ints(0, 3),
            normals=floats(3),
            vertex_pseudonormals=floats(3),
            edge_pseudonormals=floats(3, 3),
            part=ints(),
            solid_parts=ints(),
            node_start=ints(1),
            node_lower=floats(3),
            node_upper=floats(3),
            node_left=ints(),
            node_right=ints(),
            order=ints(),
        ),
    )
