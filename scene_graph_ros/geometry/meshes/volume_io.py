"""Read and write tetrahedral meshes: VTK files, old (.vtk) and XML (.vtu), by meshio."""

from __future__ import annotations

import os
from pathlib import Path
import tempfile
from typing import Any

import numpy as np

from scene_graph_ros.geometry.errors import MeshError
from scene_graph_ros.geometry.meshes.distinct_rows import distinct_rows
from scene_graph_ros.geometry.meshes.io import read_file, VOLUME_FILE_TYPES
from scene_graph_ros.geometry.meshes.limited_inflate import limited_inflate
from scene_graph_ros.geometry.meshes.mesh_points import check_vertices
from scene_graph_ros.geometry.meshes.promises import check_is_there, check_promises
from scene_graph_ros.geometry.meshes.solids.crossings import first_crossing
from scene_graph_ros.geometry.meshes.solids.winding import winding_numbers
from scene_graph_ros.geometry.meshes.volume_mesh import VolumeMesh
from scene_graph_ros.geometry.quoting import quoted

__all__ = ["VOLUME_FILE_TYPES", "load_volume_mesh", "parse_volume_mesh", "save_volume_mesh"]

_ASKED = 2
"""Random points of each tetrahedron, at which it is asked how many others are there."""


def load_volume_mesh(path: str | os.PathLike[str]) -> VolumeMesh:
    """Read the tetrahedra of a .vtk or .vtu file; triangles, lines and points are left out.

    Vertices that no tetrahedron uses are dropped, and tetrahedra numbered the other way round are
    turned, as writers disagree about it.

    Raises:
        MeshError: the file is missing or unreadable, holds no tetrahedra, or other solid cells, or
            they are no mesh; names the file and the reason.

    """
    name = f"mesh file {os.fspath(path)!r}"
    return parse_volume_mesh(read_file(path), Path(path).suffix, name=name)


def parse_volume_mesh(contents: bytes, file_type: str, *, name: str) -> VolumeMesh:
    """Read a tetrahedral mesh from the contents of a file; see ``load_volume_mesh``.

    Args:
        contents: the file's bytes.
        file_type: "vtk" or "vtu", with or without a dot, in any case.
        name: the mesh's name in messages.

    """
    file_type = file_type.lower().lstrip(".")
    if file_type not in VOLUME_FILE_TYPES:
        known = ", ".join(VOLUME_FILE_TYPES)
        raise MeshError(
            f"{name}: no reader of tetrahedra for {quoted(file_type)}; known are {known}"
        )
    check_is_there(contents, name)
    loaded = _read(contents, file_type, name)
    blocks = [block.data for block in loaded.cells if block.type == "tetra"]
    if not blocks:
        kinds = sorted({block.type for block in loaded.cells})
        raise MeshError(f"{name}: there are no tetrahedra, but {', '.join(kinds) or 'no cells'}")
    others = sorted({b.type for b in loaded.cells if b.dim == 3 and b.type != "tetra"})
    if others:
        raise MeshError(f"{name}: beside tetrahedra there are {', '.join(others)}, not read")
    points = np.asarray(loaded.points, dtype=np.float64)
    corners = np.concatenate(blocks).astype(np.int64)
    if points.ndim != 2 or points.shape[1] != 3:
        raise MeshError(f"{name}: points must be (n, 3), not {points.shape}")
    if corners.min() < 0 or corners.max() >= len(points):
        raise MeshError(f"{name}: a tetrahedron refers to a vertex that is not there")
    # Some writers give each tetrahedron points of its own.
    distinct = distinct_rows(points + 0.0)
    used, corners = np.unique(distinct.first[distinct.inverse][corners], return_inverse=True)
    points, corners = points[used], corners.reshape(-1, 4)
    check_vertices(points, name)
    negative = VolumeMesh.trusted(points, corners).volumes() < 0.0
    corners[negative, :2] = corners[negative, 1::-1]
    try:
        mesh = VolumeMesh(points, corners)
    except MeshError as error:
        raise MeshError(f"{name}: {error}") from error
    _refuse_overlaps(mesh, name)
    return mesh


def _refuse_overlaps(mesh: VolumeMesh, name: str) -> None:
    """Refuse tetrahedra that overlap.

    Where faces conform, the boundary's winding number at a point is the number of tetrahedra that
    are there. It is above one somewhere only if the boundary crosses itself, or if it is so in a
    tetrahedron: its middle and random points are asked, since on a grid edges alone may cross.
    """
    boundary = mesh.boundary_triangles()
    point = first_crossing(mesh.vertices, boundary)
    if point is None:
        weights = np.random.default_rng(3).dirichlet(np.ones(4), _ASKED)
        weights = np.vstack([np.full(4, 0.25), weights])
        corners = mesh.vertices[mesh.tetrahedra]
        inner = np.concatenate([(corners * w[:, None]).sum(axis=1) for w in weights])
        many = np.flatnonzero(winding_numbers(inner, mesh.vertices, boundary) > 1)
        point = inner[many[0]] if len(many) else None
    if point is not None:
        place = ", ".join(f"{x:.6g}" for x in point)
        raise MeshError(f"{name}: tetrahedra overlap at ({place})")


def _read(contents: bytes, file_type: str, name: str) -> Any:
    check_promises(contents, file_type, name)
    import meshio

    try:
        # Some of meshio's readers want a file with a name, not a stream.
        with tempfile.TemporaryDirectory() as folder, limited_inflate():
            file = Path(folder, f"mesh.{file_type}")
            file.write_bytes(contents)
            return meshio.read(file, file_format=file_type)
    except SystemExit as error:  # that is how meshio ends when a file is not what it says
        raise MeshError(f"{name}: unreadable {file_type}") from error
    except Exception as error:  # third-party parsers raise whatever they meet
        raise MeshError(f"{name}: unreadable {file_type}: {quoted(error)}") from error


def save_volume_mesh(path: str | os.PathLike[str], mesh: VolumeMesh) -> None:
    """Write a mesh as .vtk or .vtu, without loss; ``load_volume_mesh`` gives it back.

    Raises MeshError for another suffix, OSError where the file cannot be written.
    """
    import meshio

    path = Path(path)
    if path.suffix.lower().lstrip(".") not in VOLUME_FILE_TYPES:
        known = " or ".join(f".{kind}" for kind in VOLUME_FILE_TYPES)
        raise MeshError(f"mesh file {str(path)!r}: a volume mesh is written as {known}")
    meshio.Mesh(mesh.vertices, [("tetra", mesh.tetrahedra)]).write(path)
