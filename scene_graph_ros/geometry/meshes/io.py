"""Read triangle meshes from files, from file contents in memory and from arrays.

OBJ is read here; every other format (STL, DAE, PLY, GLB, OFF, ...) by trimesh, which is
imported when such a file is met. A file with several bodies gives one mesh of them all, each
with its transform applied. The unit that a COLLADA file states is applied; its up axis is not,
as in RViz.
"""

import io
import itertools
import os
from pathlib import Path
from typing import Any

import numpy as np

from scene_graph_ros.geometry.errors import MeshError

__all__ = ["VOLUME_FILE_TYPES", "read_file", "read_mesh", "read_mesh_contents"]

VOLUME_FILE_TYPES = ("vtk", "vtu")
"""Suffixes, without the dot, of files that may hold tetrahedra: ``volume_io`` reads them."""

Triangulation = tuple[np.ndarray, np.ndarray]


def read_mesh(path: str | os.PathLike[str]) -> Triangulation:
    """Read a mesh file.

    Returns:
        vertices (n, 3) float64 in the file's unit and triangles (m, 3) int64; m = 0 for a file
        of points alone.

    Raises:
        MeshError: the file is missing, unreadable, empty or holds a coordinate that is not finite;
            the message names the file and the reason.

    """
    name = f"mesh file {os.fspath(path)!r}"
    return read_mesh_contents(read_file(path), Path(path).suffix, name=name)


def read_file(path: str | os.PathLike[str]) -> bytes:
    """Read a file of a mesh. Raises MeshError, naming it, if it is missing or unreadable."""
    try:
        return Path(path).read_bytes()
    except FileNotFoundError as error:
        raise MeshError(f"mesh file {os.fspath(path)!r} does not exist") from error
    except OSError as error:
        raise MeshError(f"mesh file {os.fspath(path)!r}: {error.strerror}") from error


def read_mesh_contents(contents: bytes, file_type: str, *, name: str) -> Triangulation:
    """Read a mesh from the contents of a file; see ``read_mesh``.

    Args:
        contents: what the file would hold.
        file_type: its suffix, with or without the dot, in any case.
        name: what messages call the mesh.

    """
    file_type = file_type.lower().lstrip(".")
    if not contents.strip():
        raise MeshError(f"{name}: the file is empty")
    if file_type == "obj":
        vertices, triangles = _parse_obj(contents, name)
    else:
        vertices, triangles = _read_by_trimesh(contents, file_type, name)
    return checked_mesh(vertices, triangles, name)


def checked_mesh(vertices: Any, triangles: Any, name: str) -> Triangulation:
    """Return copies as float64 and int64, or raise MeshError saying what is wrong."""
    vertices = _copied(vertices, np.float64, f"{name}: vertices")
    triangles = _copied(triangles, np.int64, f"{name}: triangles")
    if not len(vertices):
        raise MeshError(f"{name}: there are no vertices")
    finite = np.isfinite(vertices).all(axis=1)
    if not finite.all():
        row = int(np.flatnonzero(~finite)[0])
        raise MeshError(f"{name}: vertex {row} is not finite: {vertices[row].tolist()}")
    wrong = (triangles < 0) | (triangles >= len(vertices))
    if wrong.any():
        row = int(np.flatnonzero(wrong.any(axis=1))[0])
        raise MeshError(
            f"{name}: triangle {row} refers to vertices {triangles[row].tolist()}, "
            f"there are {len(vertices)}"
        )
    return vertices, triangles


def _copied(array: Any, dtype: Any, label: str) -> np.ndarray:
    """Return a C-contiguous ``(n, 3)`` copy; an empty array may have any shape."""
    try:
        given = np.asarray(array)
        if not given.size:
            return np.zeros((0, 3), dtype=dtype)
        result: np.ndarray = np.array(given.astype(dtype, casting="same_kind"), order="C")
    except (TypeError, ValueError) as error:
        raise MeshError(f"{label} must be (n, 3) {np.dtype(dtype).name}: {error}") from error
    if result.ndim != 2 or result.shape[1] != 3:
        raise MeshError(f"{label} must be (n, 3), not {result.shape}")
    return result


def _parse_obj(contents: bytes, name: str) -> Triangulation:
    """Read vertices and faces of a Wavefront OBJ; polygons become fans, the rest is skipped."""
    vertices: list[list[float]] = []
    triangles: list[tuple[int, int, int]] = []
    text = contents.decode("utf-8", errors="replace").replace("\\\n", " ")
    for number, line in enumerate(text.splitlines(), start=1):
        words = line.split("#", 1)[0].split()
        if not words or words[0] not in ("v", "f"):
            continue
        try:
            if words[0] == "v":
                vertices.append([float(word) for word in words[1:4]])
                if len(words) < 4:
                    raise ValueError("a vertex needs three numbers")
            else:
                corners = [_obj_index(word, len(vertices)) for word in words[1:]]
                if len(corners) < 3:
                    raise ValueError("a face needs three corners")
                pairs = itertools.pairwise(corners[1:])
                triangles.extend((corners[0], b, c) for b, c in pairs)
        except ValueError as error:
            raise MeshError(f"{name}: line {number}: {error}: {line.strip()!r}") from error
    return np.array(vertices).reshape(-1, 3), np.array(triangles, dtype=np.int64).reshape(-1, 3)


def _obj_index(word: str, count: int) -> int:
    """Turn a corner such as ``7/1/2`` or ``-1`` into an index from 0."""
    index = int(word.split("/", 1)[0])
    return index - 1 if index > 0 else count + index


def _read_by_trimesh(contents: bytes, file_type: str, name: str) -> Triangulation:
    import trimesh

    known = set(trimesh.available_formats())
    if file_type not in known:
        raise MeshError(
            f"{name}: no reader for {file_type!r}; known are {', '.join(sorted(known))}"
        )
    if file_type == "stl" and _is_truncated_stl(contents):
        raise MeshError(f"{name}: unreadable stl: it ends before its last triangle")
    try:
        loaded = trimesh.load(
            io.BytesIO(contents), file_type=file_type, process=False, force="scene"
        )
    except Exception as error:  # third-party parsers raise whatever they meet
        raise MeshError(f"{name}: unreadable {file_type}: {error!r}") from error
    return _flatten(loaded)


def _is_truncated_stl(contents: bytes) -> bool:
    """Tell whether a binary STL is shorter than the number of triangles it states."""
    if contents.lstrip()[:5].lower() == b"solid" and b"facet" in contents[:1024]:
        return False
    count = int.from_bytes(contents[80:84], "little")
    return len(contents) < 84 + 50 * count


def _flatten(scene: Any) -> Triangulation:
    """Concatenate the bodies of a trimesh scene in world coordinates, in metres if it says so."""
    vertices, triangles, count = [np.zeros((0, 3))], [np.zeros((0, 3), dtype=np.int64)], 0
    for node in scene.graph.nodes_geometry:
        transform, key = scene.graph[node]
        body = scene.geometry[key]
        transform = np.asarray(transform)
        points = np.asarray(body.vertices) @ transform[:3, :3].T + transform[:3, 3]
        corners = np.asarray(getattr(body, "faces", np.zeros((0, 3))), dtype=np.int64)
        if np.linalg.det(transform[:3, :3]) < 0.0:
            corners = corners[:, ::-1]
        vertices.append(points * _metres(body.metadata.get("units")))
        triangles.append(corners + count)
        count += len(points)
    return np.concatenate(vertices), np.concatenate(triangles)


def _metres(unit: str | None) -> float:
    """Return the factor of a COLLADA unit as trimesh reports it (``"0.01 * meters"``)."""
    if unit is not None and unit.endswith("* meters"):
        return float(unit.split("*", 1)[0])
    return 1.0
