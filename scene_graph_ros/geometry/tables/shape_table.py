"""Build the table of a scene's shapes, which kernels read: ``table_arrays`` has its arrays."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from scene_graph_ros.geometry.meshes.hull import Hull
from scene_graph_ros.geometry.meshes.sources import hull_of, is_convex, source_identity, surface_of
from scene_graph_ros.geometry.meshes.surfaces import Surface
from scene_graph_ros.geometry.shapes.kinds import ShapeKind
from scene_graph_ros.geometry.shapes.mesh_shape import MeshShape
from scene_graph_ros.geometry.shapes.shape import PrimitiveShape, Shape
from scene_graph_ros.geometry.tables.hull_blocks import pack_blocks
from scene_graph_ros.geometry.tables.table_arrays import Hulls, ShapeTable, Surfaces

__all__ = ["build_shape_table"]


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
    """Return the starts of compressed rows of these lengths, and the end of the last one."""
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
        part=_flat([surface.part for surface in surfaces]),
        solid_parts=np.array([surface.solid_parts for surface in surfaces], dtype=np.int64),
        node_start=node_start,
        node_lower=column("node_lower", (3,)),
        node_upper=column("node_upper", (3,)),
        node_left=_stack(left, (), np.int64),
        node_right=_stack(right, (), np.int64),
        order=shifted("order", (), triangle_start),
    )
