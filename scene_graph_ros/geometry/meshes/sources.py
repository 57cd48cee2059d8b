"""The data of ``Convex`` and ``Mesh``: read, scaled, and built once per process.

Hulls and surfaces are kept by (identity of the source, scale), so that a hundred geometries of
one file share one hull; the least recently used are forgotten.
"""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import replace
import hashlib
from typing import TYPE_CHECKING

import numpy as np

from scene_graph_ros.geometry.errors import MeshError
from scene_graph_ros.geometry.meshes.cache import BuildCache
from scene_graph_ros.geometry.meshes.distinct_rows import used_indices
from scene_graph_ros.geometry.meshes.file_pictures import FilePictures
from scene_graph_ros.geometry.meshes.hull import convex_hull, Hull
from scene_graph_ros.geometry.meshes.io import (
    checked_mesh,
    ColoredMesh,
    FilesRead,
    MESH_FILE_TYPES,
    read_colored_mesh,
    read_file_marked,
    VOLUME_FILE_TYPES,
)
from scene_graph_ros.geometry.meshes.solids.mesh_report import MeshReport, PiecesReport, Repair
from scene_graph_ros.geometry.meshes.surfaces import (
    build_surface,
    is_convex_surface,
    Surface,
    with_area,
)
from scene_graph_ros.geometry.meshes.vertex_cells import cells_of
from scene_graph_ros.geometry.shapes.kinds import ShapeKind
from scene_graph_ros.geometry.shapes.mesh_pieces import BY_OBJECTS
from scene_graph_ros.geometry.shapes.mesh_shape import MeshShape
from scene_graph_ros.geometry.tolerances import MAX_SHAPE_SIZE, MIN_MESH_SIZE

if TYPE_CHECKING:
    from scene_graph_ros.geometry.meshes.volume_mesh import VolumeMesh

__all__ = [
    "MESH_FILE_TYPES",
    "file_colors",
    "file_pictures",
    "files_read",
    "hull_of",
    "hulls_of",
    "is_convex",
    "load_surface",
    "open_edges_of",
    "report_of",
    "source_identity",
    "surface_of",
    "validate",
    "volume_of",
]

_CAPACITY = 4096


_raw: BuildCache[ColoredMesh] = BuildCache(_CAPACITY)
_hulls: BuildCache[Hull] = BuildCache(_CAPACITY)
_piece_hulls: BuildCache[list[Hull]] = BuildCache(_CAPACITY)
_surfaces: BuildCache[Surface] = BuildCache(_CAPACITY)
_built: BuildCache[Surface] = BuildCache(_CAPACITY)
_reports: BuildCache[MeshReport] = BuildCache(_CAPACITY)
_convex: BuildCache[bool] = BuildCache(_CAPACITY)
_raw_volumes: BuildCache[tuple[VolumeMesh, FilesRead]] = BuildCache(_CAPACITY)


def source_identity(shape: MeshShape) -> Hashable:
    """Return the key of the shape's hull and surface."""
    return (shape.kind, shape.source_key, shape.scale, shape.repair_tolerance, shape.pieces)


def load_surface(shape: MeshShape) -> tuple[np.ndarray, np.ndarray]:
    """Return the shape's data in G.

    Returns:
        vertices (n, 3) in metres, scale applied, and triangles (m, 3), counter-clockwise seen
        from outside also where the scale mirrors. For a ``Convex`` m may be 0.

    Raises:
        MeshError: the source can't be read or is no mesh; names source and reason.

    """
    vertices, triangles, *_ = _raw.get(shape.source_key, lambda: _read(shape))
    scale = np.array(shape.scale)
    if scale.prod() < 0.0:
        triangles = np.ascontiguousarray(triangles[:, ::-1])
    with np.errstate(over="ignore"):
        scaled = vertices * scale
    if not np.abs(scaled).max() <= MAX_SHAPE_SIZE:
        raise MeshError(
            f"{_name(shape)}: scaled by {shape.scale} it reaches further than {MAX_SHAPE_SIZE:g} m"
        )
    if 0.0 < float(np.ptp(scaled, axis=0).max()) < MIN_MESH_SIZE:
        raise MeshError(
            f"{_name(shape)}: scaled by {shape.scale} it is smaller than {MIN_MESH_SIZE:g} m"
        )
    return scaled, triangles


def file_colors(shape: MeshShape) -> np.ndarray | None:
    """Return colours (m, 3) of the triangles of ``load_surface`` where the file itself has some.

    NaN for triangles without; None for a file without, and for OBJ, which names other files'.
    Raises MeshError as ``load_surface`` does.
    """
    return _raw.get(shape.source_key, lambda: _read(shape)).colors


def file_pictures(shape: MeshShape) -> FilePictures | None:
    """Return the pictures of the triangles of ``load_surface`` that the file itself has.

    None for a file without, and for OBJ, which leaves that to others. Raises MeshError as
    ``load_surface`` does.
    """
    return _raw.get(shape.source_key, lambda: _read(shape)).pictures


def files_read(shape: MeshShape) -> FilesRead:
    """Return the files that ``load_surface`` has the shape from, its own first; none from memory.

    Raises MeshError as ``load_surface`` does.
    """
    return _raw.get(shape.source_key, lambda: _read(shape)).files


def hull_of(shape: MeshShape) -> Hull:
    """Return the convex hull of the shape in G.

    Raises MeshError as ``load_surface`` does, of a mesh in pieces as ``hulls_of``.
    """

    def build() -> Hull:
        vertices, triangles = load_surface(shape)
        if shape.pieces is not None:
            vertices = np.concatenate([hull.vertices for hull in hulls_of(shape)])
        elif shape.kind == ShapeKind.MESH and len(triangles):
            # Triangles without area are no surface, unless there is nothing else.
            solid = triangles[with_area(vertices, triangles)]
            used = solid if len(solid) else triangles
            vertices = vertices[used_indices(used, len(vertices))[0]]
        hull = convex_hull(vertices)
        return hull._replace(cells=cells_of(hull.vertices))

    return _hulls.get(source_identity(shape), build)


def hulls_of(shape: MeshShape) -> list[Hull]:
    """Return the convex hulls in G of the shape's pieces, or its own where it has none.

    Raises:
        MeshError: as ``surface_of``, the file has no objects, or the library that splits a mesh is
            not installed or fails.

    """
    if shape.pieces is None:
        return [hull_of(shape)]

    def build() -> list[Hull]:
        from scene_graph_ros.geometry.meshes.pieces.coacd_split import split_by_coacd
        from scene_graph_ros.geometry.meshes.pieces.piece_hulls import hulls_of_pieces

        assert shape.pieces is not None  # it was looked at above
        if shape.pieces.by == BY_OBJECTS:
            vertices, triangles = load_surface(shape)
            labels = _objects(shape)
            order = np.argsort(labels, kind="stable")
            ends = np.flatnonzero(np.diff(labels[order])) + 1
            pieces = [vertices[np.unique(t)] for t in np.split(triangles[order], ends)]
        else:
            surface = surface_of(shape.with_pieces(None))
            pieces = split_by_coacd(surface, shape.pieces, _name(shape))
        return hulls_of_pieces(pieces, _name(shape))

    return _piece_hulls.get(source_identity(shape), build)


def _objects(shape: MeshShape) -> np.ndarray:
    """Return the object (m,) of each triangle of ``load_surface``. Raises MeshError."""
    from scene_graph_ros.geometry.meshes.obj_file import obj_objects

    if shape.file_type != "obj":
        kind = f"a .{shape.file_type} file" if shape.file_type else "an array"
        raise MeshError(
            f"{_name(shape)}: {kind} has no objects as an OBJ file has; pieces by 'coacd' are of"
            " any mesh"
        )
    if shape.path is None:
        assert shape.contents is not None  # a file type comes with a file or its contents
        labels = obj_objects(shape.contents)
    else:
        labels = obj_objects(read_file_marked(shape.path)[0])
    if len(labels) != len(load_surface(shape)[1]):
        raise MeshError(f"{_name(shape)}: the file has changed since it was read")
    return labels


def surface_of(shape: MeshShape) -> Surface:
    """Return the clean triangles of a ``Mesh`` in G, in pieces those around their hulls.

    Raises:
        MeshError: as ``load_surface``, or there is no triangle with an area; of a mesh in pieces
            as ``hulls_of``.

    """

    def build() -> Surface:
        if shape.pieces is not None:
            return _surface_of_pieces(shape)
        vertices, triangles = load_surface(shape)
        tolerance = shape.repair_tolerance
        digest = hashlib.blake2b(vertices.tobytes() + triangles.tobytes(), digest_size=16).digest()
        # By contents as well: uniting parts may take seconds, and files are copied.
        surface = _built.get(
            (digest, len(vertices), tolerance),
            lambda: build_surface(
                vertices, triangles, name=_name(shape), repair_tolerance=tolerance
            ),
        )
        of_file = _repairs_of_file(shape)
        if not of_file:
            return surface
        report = replace(surface.report, repairs=(*of_file, *surface.report.repairs))
        return surface._replace(report=report)

    return _surfaces.get(source_identity(shape), build)


def _repairs_of_file(shape: MeshShape) -> tuple[Repair, ...]:
    """Return the repairs of reading, in G."""
    repairs = _raw.get(shape.source_key, lambda: _read(shape)).repairs
    scale = np.array(shape.scale)
    return tuple(replace(r, point=tuple((scale * r.point).tolist())) for r in repairs)


def _surface_of_pieces(shape: MeshShape) -> Surface:
    """Return the surface of the union of the hulls; its report is that of the file."""
    from scene_graph_ros.geometry.meshes.pieces.piece_hulls import triangles_of_hulls

    vertices, triangles = triangles_of_hulls(hulls_of(shape))
    united = build_surface(vertices, triangles, name=f"the pieces of {_name(shape)}")
    of_file = surface_of(shape.with_pieces(None))
    doubt = united.report.reason and f"its pieces: {united.report.reason}"
    report = replace(of_file.report, reason=of_file.report.reason or doubt)
    return united._replace(report=report, open_edges=of_file.open_edges)


def report_of(shape: MeshShape) -> MeshReport:
    """Return the report on the triangles of a ``Mesh``. Raises MeshError as ``surface_of``.

    How far pieces leave the solid is looked for here, which reading does not.
    """
    surface = surface_of(shape)
    if shape.pieces is None:
        return surface.report
    return _reports.get(source_identity(shape), lambda: _report_of_pieces(shape, surface))


def _report_of_pieces(shape: MeshShape, union: Surface) -> MeshReport:
    from scene_graph_ros.geometry.meshes.pieces.leaving import farthest_outside

    whole = shape.with_pieces(None)
    solid, report = surface_of(whole), report_of(whole)
    added, missing = farthest_outside(union, solid), farthest_outside(solid, union)
    pieces = PiecesReport(
        len(hulls_of(shape)), added.found, added.bound, missing.found, missing.bound
    )
    return replace(report, reason=report.reason or union.report.reason, pieces=pieces)


def open_edges_of(shape: MeshShape) -> np.ndarray:
    """Return (k, 2, 3) metres: the ends of edges that stay open. Raises as ``surface_of``."""
    return surface_of(shape).open_edges


def is_convex(shape: MeshShape) -> bool:
    """Tell whether the triangles of a ``Mesh`` are its convex hull."""
    return _convex.get(
        source_identity(shape), lambda: is_convex_surface(surface_of(shape), hull_of(shape))
    )


def volume_of(shape: MeshShape) -> VolumeMesh:
    """Return the tetrahedra of a .vtk or .vtu source in G, scaled.

    Raises:
        MeshError: as ``load_volume_mesh``.

    """
    from scene_graph_ros.geometry.meshes.volume_mesh import VolumeMesh

    assert shape.file_type in VOLUME_FILE_TYPES  # callers ask for others elsewhere
    raw = _raw_volume(shape)[0]
    tetrahedra = raw.tetrahedra
    if np.prod(shape.scale) < 0.0:
        tetrahedra = np.ascontiguousarray(tetrahedra[:, [1, 0, 2, 3]])
    return VolumeMesh.trusted(raw.vertices * shape.scale, tetrahedra)


def _raw_volume(shape: MeshShape) -> tuple[VolumeMesh, FilesRead]:
    from scene_graph_ros.geometry.meshes.volume_io import parse_volume_mesh

    def read() -> tuple[VolumeMesh, FilesRead]:
        if shape.path is not None:
            name = f"mesh file {str(shape.path)!r}"
            contents, files = read_file_marked(shape.path)
            return parse_volume_mesh(contents, shape.file_type, name=name), files
        assert shape.contents is not None  # a file type comes with a file or its contents
        return parse_volume_mesh(shape.contents, shape.file_type, name=_name(shape)), ()

    return _raw_volumes.get(shape.source_key, read)


def validate(shape: MeshShape) -> None:
    """Read the shape and build the queries' data of it, so that errors come now.

    Raises:
        MeshError: the shape can't be used in proximity queries; names source and reason.

    """
    hull_of(shape)
    if shape.kind == ShapeKind.MESH:
        surface_of(shape)


def _name(shape: MeshShape) -> str:
    if shape.path is not None:
        return f"{shape.type_name} of file {str(shape.path)!r}"
    return f"{shape.type_name} from memory"


def _read(shape: MeshShape) -> ColoredMesh:
    if shape.file_type in VOLUME_FILE_TYPES:
        volume, files = _raw_volume(shape)
        return ColoredMesh(volume.vertices, volume.boundary_triangles(), files=files)
    if shape.path is not None:
        name = f"mesh file {str(shape.path)!r}"
        contents, files = read_file_marked(shape.path)
        return read_colored_mesh(contents, shape.file_type, name=name)._replace(files=files)
    if shape.contents is not None:
        return read_colored_mesh(shape.contents, shape.file_type, name=_name(shape))
    faces = np.zeros((0, 3), dtype=np.int64) if shape.faces is None else shape.faces
    assert shape.vertices is not None  # a shape without path and contents has vertices
    return ColoredMesh(*checked_mesh(shape.vertices, faces, _name(shape)))
