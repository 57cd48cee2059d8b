"""Where the corners of a mesh's triangles are on a picture, read when the mesh gets one.

OBJ files have ``vt`` lines; GLB and glTF are read by trimesh. Coordinates are (u, v): (0, 0)
is the lower left corner of the picture and (1, 1) the upper right one, as in OBJ files.
"""

from __future__ import annotations

from array import array
import io

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.errors import MeshError
from scene_graph_ros.geometry.meshes.cache import BuildCache
from scene_graph_ros.geometry.meshes.dae_file import dae_coordinates
from scene_graph_ros.geometry.meshes.gltf_file import GLTF_TYPES
from scene_graph_ros.geometry.meshes.gltf_materials import without_images
from scene_graph_ros.geometry.meshes.gltf_plain import plain_gltf
from scene_graph_ros.geometry.meshes.io import read_file
from scene_graph_ros.geometry.meshes.obj_file import obj_faces, obj_lines
from scene_graph_ros.geometry.meshes.promises import MAX_CORNERS
from scene_graph_ros.geometry.meshes.sources import load_surface
from scene_graph_ros.geometry.shapes.kinds import ShapeKind
from scene_graph_ros.geometry.shapes.mesh_shape import MeshShape
from scene_graph_ros.geometry.spatial.sums import determinant

__all__ = ["coordinates_of_file", "texture_coordinates"]

_CAPACITY = 1024
_KNOWN = ("obj", "dae", *GLTF_TYPES)

Coordinates = NDArray[np.float64]

_coordinates: BuildCache[Coordinates] = BuildCache(_CAPACITY)


def texture_coordinates(shape: MeshShape) -> Coordinates:
    """Return (u, v) of the corners of a Mesh's triangles ``(m, 3, 2)``.

    They are in the order of ``load_surface``. Raises MeshError, naming the mesh, where it has none
    or has none for a triangle, and as ``load_surface`` does.
    """
    name = _name(shape)
    if shape.kind != ShapeKind.MESH:
        raise MeshError(f"{name}: a hull has no texture coordinates")
    found = coordinates_of_file(shape)
    lacking = ~np.isfinite(found).all(axis=(1, 2))
    if lacking.all():
        raise MeshError(f"{name} has no texture coordinates")
    if lacking.any():
        raise MeshError(f"{name}: triangle {int(lacking.argmax())} has no texture coordinates")
    # A mirroring scale turns the corners round, see load_surface.
    return found[:, ::-1] if np.prod(shape.scale) < 0.0 else found


def coordinates_of_file(shape: MeshShape) -> Coordinates:
    """Return the same as ``texture_coordinates``, for scale 1, with NaN where the file has none.

    Raises MeshError for files that can't have any, and as ``load_surface`` does.
    """
    return _coordinates.get(shape.source_key, lambda: _read(shape, _name(shape)))


def _name(shape: MeshShape) -> str:
    return f"mesh file {str(shape.path)!r}" if shape.path is not None else f"{shape!r}"


def _read(shape: MeshShape, name: str) -> Coordinates:
    count = len(load_surface(shape)[1])
    contents = read_file(shape.path) if shape.path is not None else shape.contents
    if contents is None or shape.file_type not in _KNOWN:
        raise MeshError(
            f"{name} has no texture coordinates; files of type {', '.join(_KNOWN)} may have some"
        )
    if shape.file_type == "obj":
        found = _of_obj(contents, name)
    elif shape.file_type == "dae":
        found = dae_coordinates(contents, name)
    else:
        found = _of_gltf(contents, shape.file_type)
    if len(found) != count:
        raise MeshError(f"{name} has changed since it was read")
    return found


def _of_obj(contents: bytes, name: str) -> Coordinates:
    """Return coordinates of the triangles of ``parse_obj``, NaN for none."""
    points, corners = array("d"), array("q")
    for number, line in enumerate(obj_lines(contents), start=1):
        words = line.split(b"#", 1)[0].split()
        try:
            if words[:1] == [b"vt"]:
                if len(words) < 2:
                    raise ValueError("a point of a texture needs a number")
                points.extend((float(words[1]), float(words[2]) if len(words) > 2 else 0.0))
            elif words[:1] == [b"f"]:
                corners.extend([_index(word, len(points) // 2) for word in words[1:]])
        except ValueError as error:
            raise MeshError(f"{name}: line {number}: {error}") from error
    table = np.append(np.frombuffer(points, np.float64), (np.nan, np.nan)).reshape(-1, 2)
    rows = np.frombuffer(corners, np.int64)[obj_faces(contents, name, [])[2]]
    rows = np.where((rows >= 0) & (rows < len(table) - 1), rows, len(table) - 1)
    return table[rows]


def _index(word: bytes, count: int) -> int:
    """Return a corner's row among the points so far, -1 for one that has none."""
    parts = word.split(b"/")
    if len(parts) < 2 or not parts[1]:
        return -1
    index = int(parts[1])
    if abs(index) > 3 * MAX_CORNERS:
        return -1
    return index - 1 if index > 0 else count + index if index < 0 else -1


def _of_gltf(contents: bytes, file_type: str) -> Coordinates:
    """Return the coordinates of all bodies, in the order in which ``io`` puts them together."""
    import trimesh

    plain = without_images(plain_gltf(contents, file_type, "glTF"), "glb")
    with np.errstate(all="ignore"):
        scene = trimesh.load(io.BytesIO(plain), file_type="glb", process=False, force="scene")
    parts = [np.zeros((0, 3, 2))]
    for node in scene.graph.nodes_geometry:
        transform, key = scene.graph[node]
        body = scene.geometry[key]
        faces = np.asarray(getattr(body, "faces", np.zeros((0, 3))), np.int64)
        if determinant(np.asarray(transform)[:3, :3]) < 0.0:
            faces = faces[:, ::-1]
        uv = getattr(getattr(body, "visual", None), "uv", None)
        if uv is None or len(uv) != len(body.vertices):
            parts.append(np.full((len(faces), 3, 2), np.nan))
        else:
            parts.append(np.asarray(uv, np.float64)[:, :2][faces])
    return np.concatenate(parts)
