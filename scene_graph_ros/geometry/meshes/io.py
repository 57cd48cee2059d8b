"""Read triangle meshes from files, from file contents in memory and from arrays.

DAE, OBJ, OFF, PLY and STL are read by files of their names; GLB and glTF by trimesh, which is
imported when such a file is met. A file with several bodies gives one mesh of them all, each
with its transform applied. The unit that a COLLADA file states is applied; its up axis is not,
as in RViz.
"""

from collections.abc import Callable
import io
import os
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from scene_graph_ros.geometry.errors import MeshError
from scene_graph_ros.geometry.files import FileMark, MAX_MESH_BYTES, read_marked
from scene_graph_ros.geometry.meshes.color_warnings import warn_of_color
from scene_graph_ros.geometry.meshes.dae_file import parse_dae
from scene_graph_ros.geometry.meshes.file_pictures import FilePicture, FilePictures
from scene_graph_ros.geometry.meshes.gltf_file import (
    buffers_beside,
    GLTF_TYPES,
    with_buffers,
)
from scene_graph_ros.geometry.meshes.gltf_materials import gltf_pictures, without_images
from scene_graph_ros.geometry.meshes.gltf_plain import plain_gltf
from scene_graph_ros.geometry.meshes.obj_file import parse_obj
from scene_graph_ros.geometry.meshes.off_file import parse_off
from scene_graph_ros.geometry.meshes.ply_file import parse_ply
from scene_graph_ros.geometry.meshes.promises import (
    check_is_no_pointer,
    check_is_there,
    check_promises,
    MAX_CORNERS,
)
from scene_graph_ros.geometry.meshes.scene_colors import scene_colors, scene_pictures
from scene_graph_ros.geometry.meshes.solids.mesh_report import Repair
from scene_graph_ros.geometry.meshes.stl_file import parse_stl
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.real_arrays import real_array, whole_array
from scene_graph_ros.geometry.spatial.sums import determinant, moved

__all__ = [
    "MESH_FILE_TYPES",
    "VOLUME_FILE_TYPES",
    "ColoredMesh",
    "FilesRead",
    "checked_mesh",
    "read_colored_mesh",
    "read_file",
    "read_file_marked",
    "read_mesh",
    "read_mesh_contents",
]

Triangulation = tuple[np.ndarray, np.ndarray]

_OWN: dict[str, Callable[[bytes, str, list[Repair]], Triangulation]] = {
    "obj": parse_obj,
    "off": parse_off,
    "stl": lambda contents, name, repairs: parse_stl(contents, name),  # it has triangles alone
}
"""What is read here, and has no colours in the file itself."""


VOLUME_FILE_TYPES = ("vtk", "vtu")
"""Suffixes, without the dot, of files that may hold tetrahedra: ``volume_io`` reads them."""

MESH_FILE_TYPES = tuple(sorted((*GLTF_TYPES, *VOLUME_FILE_TYPES, *_OWN, "dae", "ply")))
"""Suffixes of all files that can be read, without the dot."""

FilesRead = tuple[tuple[Path, FileMark], ...]
"""Files by the paths under which they are named, and which they were when they were read."""


class ColoredMesh(NamedTuple):
    """A mesh, and its triangles' look by its own file."""

    vertices: np.ndarray
    """(n, 3)."""
    triangles: np.ndarray
    """(m, 3)."""
    colors: np.ndarray | None = None
    """(m, 3) as ``scene_colors`` has them; None for OBJ, which names colours of other files."""
    pictures: FilePictures | None = None
    """None for OBJ as well."""
    files: FilesRead = ()
    """The mesh's file and the buffers that it names; none of a mesh from memory."""
    repairs: tuple[Repair, ...] = ()
    """What of the file was put right to have triangles."""


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
    """Read a file of a mesh; of glTF with the buffers beside it in its document.

    Raises MeshError, naming the file, if it or a buffer is missing, unreadable or too large.
    """
    return read_file_marked(path)[0]


def read_file_marked(path: str | os.PathLike[str]) -> tuple[bytes, FilesRead]:
    """Do as ``read_file``, and return which files were read: the mesh's first."""
    name, file_type = f"mesh file {os.fspath(path)!r}", Path(path).suffix.lower().lstrip(".")
    contents, mark = _read_limited(path, name, MAX_MESH_BYTES)
    files = [(Path(path), mark)]
    if file_type not in GLTF_TYPES:
        return contents, tuple(files)
    left = MAX_MESH_BYTES - len(contents)

    def read(place: str) -> bytes:
        nonlocal left
        beside = Path(path).parent / place
        called = f"{name}: buffer {quoted(place)}"
        data, mark = _read_limited(beside, called, left)
        check_is_no_pointer(data, called)
        files.append((beside, mark))
        left -= len(data)
        return data

    whole = with_buffers(contents, file_type, name, read)
    return whole, tuple(files)


def _read_limited(path: str | os.PathLike[str], name: str, limit: int) -> tuple[bytes, FileMark]:
    try:
        return read_marked(path, limit)
    except FileNotFoundError as error:
        raise MeshError(f"{name} does not exist") from error
    except OSError as error:
        raise MeshError(f"{name}: {error.strerror}") from error


def read_mesh_contents(contents: bytes, file_type: str, *, name: str) -> Triangulation:
    """Read a mesh from the contents of a file; see ``read_mesh``.

    Args:
        contents: the file's bytes.
        file_type: its suffix, with or without the dot, in any case.
        name: the mesh's name in messages.

    """
    return read_colored_mesh(contents, file_type, name=name)[:2]


def read_colored_mesh(contents: bytes, file_type: str, *, name: str) -> ColoredMesh:
    """Read a mesh as ``read_mesh_contents`` does, with its look by the file."""
    file_type = file_type.lower().lstrip(".")
    check_is_there(contents, name)
    repairs: list[Repair] = []
    if file_type == "ply":
        check_promises(contents, file_type, name)
        mesh = ColoredMesh(*parse_ply(contents, name, repairs))
    elif file_type == "dae":
        check_promises(contents, file_type, name)
        mesh = ColoredMesh(*parse_dae(contents, name, repairs))
    elif file_type in _OWN:
        mesh = ColoredMesh(*_OWN[file_type](contents, name, repairs))
    else:
        mesh = _read_gltf(contents, file_type, name)
    vertices, triangles = checked_mesh(mesh.vertices, mesh.triangles, name)
    return mesh._replace(vertices=vertices, triangles=triangles, repairs=tuple(repairs))


def checked_mesh(vertices: Any, triangles: Any, name: str) -> Triangulation:
    """Return copies as float64 and int64, or raise MeshError naming the fault."""
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
    is_whole = np.dtype(dtype).kind == "i"
    rule = f"{label} must be (n, 3) {'whole numbers' if is_whole else 'numbers'}"
    result = (whole_array if is_whole else real_array)(array, rule, MeshError)
    if not result.size:
        return np.zeros((0, 3), dtype=dtype)
    if result.ndim != 2 or result.shape[1] != 3:
        raise MeshError(f"{label} must be (n, 3), not {result.shape}")
    return result


def _read_gltf(contents: bytes, file_type: str, name: str) -> ColoredMesh:
    if file_type not in GLTF_TYPES:
        known = ", ".join(MESH_FILE_TYPES)
        raise MeshError(f"{name}: no reader for {quoted(file_type)}; known are {known}")
    check_promises(contents, file_type, name)
    import trimesh

    try:
        for uri in buffers_beside(contents, file_type):
            raise MeshError(
                f"{name}: its buffer {quoted(uri)} is not in it; a .glb file has all in one"
            )
        by_name = _gltf_pictures(contents, file_type, name)
        plain = without_images(plain_gltf(contents, file_type, name), "glb")
        # What is not finite is refused where all meshes are checked.
        with np.errstate(all="ignore"):
            scene = trimesh.load(io.BytesIO(plain), file_type="glb", process=False, force="scene")
            _check_size(scene, name)
            return ColoredMesh(
                *_flatten(scene), scene_colors(scene, name), scene_pictures(scene, by_name)
            )
    except MeshError:
        raise
    except Exception as error:  # third-party parsers raise whatever they meet
        raise MeshError(f"{name}: unreadable {file_type}: {quoted(error)}") from error


def _gltf_pictures(contents: bytes, file_type: str, name: str) -> dict[str, FilePicture]:
    try:
        return gltf_pictures(contents, file_type)
    except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError) as error:
        warn_of_color(f"{name}: shown without its pictures, which are unreadable: {quoted(error)}")
        return {}


def _flatten(scene: Any) -> Triangulation:
    """Concatenate the bodies of a trimesh scene in world coordinates."""
    vertices, triangles, count = [np.zeros((0, 3))], [np.zeros((0, 3), dtype=np.int64)], 0
    for node in scene.graph.nodes_geometry:
        transform, key = scene.graph[node]
        body = scene.geometry[key]
        transform = np.asarray(transform)
        points = moved(np.asarray(body.vertices), transform)
        corners = np.asarray(getattr(body, "faces", np.zeros((0, 3))), dtype=np.int64)
        if determinant(transform[:3, :3]) < 0.0:
            corners = corners[:, ::-1]
        vertices.append(points)
        triangles.append(corners + count)
        count += len(points)
    return np.concatenate(vertices), np.concatenate(triangles)


def _check_size(scene: Any, name: str) -> None:
    """Raise MeshError where the bodies, wherever they are placed, have too many vertices."""
    count = 0
    for node in scene.graph.nodes_geometry:
        body = scene.geometry[scene.graph[node][1]]
        count += max(len(body.vertices), len(getattr(body, "faces", ())))
        if count > MAX_CORNERS:
            raise MeshError(f"{name}: more than {MAX_CORNERS} vertices or triangles")
