"""Read the vertices, faces and objects of a Wavefront OBJ file."""

from __future__ import annotations

from array import array
from collections.abc import Iterator
import io
import re

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.errors import MeshError
from scene_graph_ros.geometry.meshes.polygons import triangles_of_polygons
from scene_graph_ros.geometry.meshes.promises import MAX_CORNERS
from scene_graph_ros.geometry.meshes.solids.mesh_report import Repair
from scene_graph_ros.geometry.quoting import quoted

__all__ = ["obj_faces", "obj_lines", "obj_objects", "parse_obj"]

_CONTINUED = re.compile(rb"^([^#\n]*)\\\n", re.MULTILINE)
"""A comment may end with a backslash, as that of a folder does."""

Arrays = tuple[NDArray[np.float64], NDArray[np.int64]]


def parse_obj(contents: bytes, name: str, repairs: list[Repair]) -> Arrays:
    """Return vertices (n, 3) and triangles (m, 3); see ``obj_faces``."""
    vertices, corners, cut = obj_faces(contents, name, repairs)
    return vertices, corners[cut]


def obj_faces(
    contents: bytes, name: str, repairs: list[Repair]
) -> tuple[*Arrays, NDArray[np.int64]]:
    """Return vertices (n, 3), the corners (c,) of all faces, and triangles of these (m, 3).

    The triangles are places among the corners, face after face; the rest of the file is skipped.
    ``repairs`` gets the repairs.

    Raises MeshError with the line for entries that are no number or no index of a vertex, or more
    than MAX_CORNERS of either.
    """
    coordinates, corners, sizes = array("d"), array("q"), array("q")
    for number, line in enumerate(obj_lines(contents), start=1):
        words = line.split(b"#", 1)[0].split()
        if not words or words[0] not in (b"v", b"f"):
            continue
        try:
            if words[0] == b"v":
                _add_vertex(words, coordinates)
            else:
                sizes.append(_add_face(words, len(coordinates) // 3, corners))
            if max(len(coordinates) // 3, len(corners) - 2 * len(sizes)) > MAX_CORNERS:
                raise ValueError(f"more than {MAX_CORNERS} vertices or triangles")
        except ValueError as error:
            text = quoted(line.strip().decode(errors="replace"))
            raise MeshError(f"{name}: line {number}: {error}: {text}") from error
    vertices = np.frombuffer(coordinates, dtype=np.float64)
    vertices = vertices.reshape(-1, 3)
    places = np.frombuffer(corners, dtype=np.int64)
    _check_indices(places, len(vertices), name)
    cut = triangles_of_polygons(vertices, places, np.frombuffer(sizes, np.int64), name, repairs)
    return vertices, places, cut


def obj_objects(contents: bytes) -> NDArray[np.int64]:
    """Return the object (m,) of each triangle of ``parse_obj``, counted from 0.

    Objects are told by their names, wherever in the file these are. They are those of ``o`` lines,
    or of ``g`` lines in a file without any ``o``; faces before the first are one more.
    """
    names: dict[bytes, dict[bytes, int]] = {b"o": {}, b"g": {}}
    rows: dict[bytes, list[int]] = {b"o": [], b"g": []}
    now = {b"o": -1, b"g": -1}
    sizes = []
    for line in obj_lines(contents):
        words = line.split(b"#", 1)[0].split(maxsplit=1)
        if not words or words[0] not in (b"o", b"g", b"f"):
            continue
        if words[0] == b"f":
            sizes.append(len(words[1].split()) - 2)
            for key, kept in rows.items():
                kept.append(now[key])
            continue
        known = names[words[0]]
        name = b" ".join(words[1].split()) if len(words) > 1 else b""
        now[words[0]] = known.setdefault(name, len(known))
    found = np.array(rows[b"o" if names[b"o"] else b"g"], dtype=np.int64)
    return np.repeat(found, np.array(sizes, dtype=np.int64)) - int(found.min(initial=0))


def _check_indices(corners: NDArray[np.int64], count: int, name: str) -> None:
    wrong = np.flatnonzero((corners < 0) | (corners >= count))
    if len(wrong):
        index = int(corners[wrong[0]])
        raise MeshError(f"{name}: a face refers to vertex {index + 1}, there are {count}")


def obj_lines(contents: bytes) -> Iterator[bytes]:
    """Yield the lines of an OBJ or MTL file one by one: all at once take many times its memory."""
    if b"\r" in contents:
        contents = contents.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    if b"\\\n" in contents:
        contents = _CONTINUED.sub(rb"\1 ", contents)
    return iter(io.BytesIO(contents))


def _add_vertex(words: list[bytes], coordinates: array[float]) -> None:
    if len(words) < 4:
        raise ValueError("a vertex needs three numbers")
    coordinates.extend([float(word) for word in words[1:4]])


def _add_face(words: list[bytes], count: int, corners: array[int]) -> int:
    """Append a face's corners; return how many."""
    if len(words) < 4:
        raise ValueError("a face needs three corners")
    corners.extend([_index(word, count) for word in words[1:]])
    return len(words) - 1


def _index(word: bytes, count: int) -> int:
    """Turn a corner such as ``7/1/2`` or ``-1`` into an index from 0."""
    index = int(word.split(b"/", 1)[0])
    if index == 0 or index < -count or index > 3 * MAX_CORNERS:
        raise ValueError(f"there is no vertex {index}")
    return index - 1 if index > 0 else count + index
