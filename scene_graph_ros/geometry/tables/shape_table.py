"""All shapes of a scene as arrays: what kernels read instead of Python objects.

Row i of a ``ShapeTable`` describes shape i in its own frame G. Hulls and triangle surfaces are
shared: two rows with the same source and scale hold the same index. Every array is C-contiguous
and writable, so that one compiled signature fits all tables; nobody writes to a table after it
was built.
"""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from scene_graph_ros.geometry.meshes.hull import Hull
from scene_graph_ros.geometry.meshes.sources import hull_of, is_convex, source_identity, surface_of
from scene_graph_ros.geometry.meshes.surfaces import Surface
from scene_graph_ros.geometry.shapes.kinds import ShapeKind
from scene_graph_ros.geometry.shapes.mesh_shape import MeshShape
from scene_graph_ros.geometry.shapes.shape import PrimitiveShape, Shape
from scene_graph_ros.geometry.tables.hull_blocks import pack_blocks

__all__ = ["Hulls", "ShapeTable", "Surfaces", "build_shape_table"]


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
    is_closed: np.ndarray
    """(m,) bool: every edge is shared by two triangles that run through it in opposite ways."""
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


_SIZE: dict[ShapeKind, Callable[[Any], tuple[float, float, float]]] = {
    ShapeKind.SPHERE: lambda s: (s.radius, 0.0, 0.0),
    ShapeKind.CAPSULE: lambda s: (s.radius, 0.5 * s.length, 0.0),
    ShapeKind.BOX: lambda s: (0.5 * s.width, 0.5 * s.depth, 0.5 * s.height),
    ShapeKind.CYLINDER: lambda s: (s.radius, 0.5 * s.length, 0.0),
    ShapeKind.ELLIPSOID: lambda s: (s.a, s.b, s.c),
    ShapeKind.HALF_SPACE: lambda s: (0.0, 0.0, 0.0),
    ShapeKind.CONVEX: lambda s: (0.0, 0.0, 0.0),
    ShapeKind.MESH: lambda s: (0.0, 0.0, 0.0),
}


def build_shape_table(shapes: Sequence[Shape], exact: Sequence[bool]) -> ShapeTable:
    """Build the table of ``shapes``, one row each.

    Args:
        shapes: of any kind; meshes are read here, unless they were before.
        exact: per shape, whether a ``Mesh`` keeps its triangles in contact and distance.

    Raises:
        MeshError: a mesh can't be read or has no triangle with an area.

    """
    n = len(shapes)
    kind = np.array([shape.kind for shape in shapes], dtype=np.int32)
    size = np.array([_SIZE[shape.kind](shape) for shape in shapes]).reshape(n, 3)
    hull_index = np.full(n, -1, dtype=np.int32)
    surface_index = np.full(n, -1, dtype=np.int32)
    lower, upper = np.empty((n, 3)), np.empty((n, 3))
    hulls: list[Hull] = []
    surfaces: list[Surface] = []
    rows_of: dict[Any, tuple[int, int]] = {}
    for row, shape in enumerate(shapes):
        if isinstance(shape, PrimitiveShape):
            lower[row], upper[row] = shape.local_bounds()
            continue
        assert isinstance(shape, MeshShape)  # the shapes without bounds of their own
        key = source_identity(shape)
        if key not in rows_of:
            hulls.append(hull_of(shape))
            if shape.kind == ShapeKind.MESH:
                surfaces.append(surface_of(shape))
            rows_of[key] = (
                len(hulls) - 1,
                len(surfaces) - 1 if shape.kind == ShapeKind.MESH else -1,
            )
        hull_index[row], surface_index[row] = rows_of[key]
        vertices = hulls[hull_index[row]].vertices
        lower[row], upper[row] = vertices.min(axis=0), vertices.max(axis=0)
    extents = np.where(np.isfinite(lower) & np.isfinite(upper), upper, 0.0)
    extents -= np.where(np.isfinite(lower) & np.isfinite(upper), lower, 0.0)
    return ShapeTable(
        kind=kind,
        size=size,
        hull=hull_index,
        surface=surface_index,
        exact=np.array(
            [
                wanted
                and isinstance(shape, MeshShape)
                and shape.kind == ShapeKind.MESH
                and not is_convex(shape)
                for shape, wanted in zip(shapes, exact, strict=True)
            ],
            dtype=np.bool_,
        ),
        lower=lower,
        upper=upper,
        scale=extents.max(axis=1, initial=0.0),
        hulls=_pack_hulls(hulls),
        surfaces=_pack_surfaces(surfaces),
    )


def _starts(lengths: Sequence[int]) -> np.ndarray:
    """Return where compressed rows of these lengths start, and where the last one ends."""
    return np.concatenate([[0], np.cumsum(np.asarray(lengths, dtype=np.int64))]).astype(np.int64)


def _stack(parts: Sequence[np.ndarray], shape: tuple[int, ...], dtype: type) -> np.ndarray:
    """Concatenate along the first axis into a writable C-contiguous array, also if none."""
    return np.concatenate([np.zeros((0, *shape), dtype=dtype), *parts]).astype(dtype, copy=False)


def _flat(rows: Sequence[np.ndarray]) -> np.ndarray:
    return _stack(rows, (), np.int64)


def _pack_hulls(hulls: Sequence[Hull]) -> Hulls:
    vertex_start = _starts([len(hull.vertices) for hull in hulls])
    shifted = list(zip(hulls, vertex_start[:-1], strict=True))
    neighbors = [row for hull in hulls for row in hull.neighbors]
    faces = [row for hull in hulls for row in hull.faces]
    block_start, blocks = pack_blocks(hulls)
    return Hulls(
        vertex_start=vertex_start,
        vertices=_stack([hull.vertices for hull in hulls], (3,), np.float64),
        neighbor_start=_starts([len(row) for row in neighbors]),
        neighbors=_stack([_flat(h.neighbors) + shift for h, shift in shifted], (), np.int64),
        face_start=_starts([len(hull.faces) for hull in hulls]),
        face_normals=_stack([hull.normals for hull in hulls], (3,), np.float64),
        face_offsets=_stack([hull.offsets for hull in hulls], (), np.float64),
        face_vertex_start=_starts([len(row) for row in faces]),
        face_vertices=_stack([_flat(h.faces) + shift for h, shift in shifted], (), np.int64),
        block_start=block_start,
        blocks=blocks,
    )


def _pack_surfaces(surfaces: Sequence[Surface]) -> Surfaces:
    vertex_start = _starts([len(surface.vertices) for surface in surfaces])
    triangle_start = _starts([len(surface.triangles) for surface in surfaces])
    node_start = _starts([len(surface.node_left) for surface in surfaces])
    left, right = [], []
    for surface, triangle, node in zip(
        surfaces, triangle_start[:-1], node_start[:-1], strict=True
    ):
        is_leaf = surface.node_left < 0
        left.append(np.where(is_leaf, surface.node_left - triangle, surface.node_left + node))
        right.append(np.where(is_leaf, surface.node_right, surface.node_right + node))

    def column(name: str, shape: tuple[int, ...]) -> np.ndarray:
        return _stack([getattr(surface, name) for surface in surfaces], shape, np.float64)

    def shifted(name: str, shape: tuple[int, ...], starts: np.ndarray) -> np.ndarray:
        rows = zip(surfaces, starts[:-1], strict=True)
        return _stack([getattr(surface, name) + at for surface, at in rows], shape, np.int64)

    return Surfaces(
        vertex_start=vertex_start,
        vertices=column("vertices", (3,)),
        triangle_start=triangle_start,
        triangles=shifted("triangles", (3,), vertex_start),
        normals=column("normals", (3,)),
        vertex_pseudonormals=column("vertex_pseudonormals", (3,)),
        edge_pseudonormals=column("edge_pseudonormals", (3, 3)),
        is_closed=np.array([surface.is_closed for surface in surfaces], dtype=np.bool_),
        node_start=node_start,
        node_lower=column("node_lower", (3,)),
        node_upper=column("node_upper", (3,)),
        node_left=_stack(left, (), np.int64),
        node_right=_stack(right, (), np.int64),
        order=shifted("order", (), triangle_start),
    )
