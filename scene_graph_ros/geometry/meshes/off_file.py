"""Read the vertices and faces of an OFF file."""

from __future__ import annotations

import re

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.errors import MeshError
from scene_graph_ros.geometry.meshes.polygons import triangles_of_polygons
from scene_graph_ros.geometry.meshes.promises import MAX_CORNERS
from scene_graph_ros.geometry.meshes.solids.mesh_report import Repair
from scene_graph_ros.geometry.quoting import quoted

__all__ = ["parse_off"]

_HEADER = re.compile(rb"(ST)?C?N?OFF(?=\d|$)")
"""Some files have no space between it and the counts."""


def parse_off(
    contents: bytes, name: str, repairs: list[Repair]
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Return vertices (n, 3) and triangles (m, 3); normals, colours and edges are skipped.

    ``repairs`` gets the repairs.

    Raises:
        MeshError: the file is not OFF in words of three dimensions, ends too early, or a face
            refers to a vertex that is not there; names the line.

    """
    lines = [
        (number, words)
        for number, line in enumerate(contents.splitlines(), start=1)
        if (words := line.split(b"#", 1)[0].split())
    ]
    header = _HEADER.match(lines[0][1][0]) if lines else None
    if header is None or lines[0][1][1:2] == [b"BINARY"]:
        raise MeshError(f"{name}: unreadable off: it does not begin with OFF, in words")
    number, words = lines[0]
    glued = words[0][header.end() :]
    rest = [glued, *words[1:]] if glued else words[1:]
    lines = [(number, rest), *lines[1:]] if rest else lines[1:]
    try:
        number, words = lines[0]
        count, faces = int(words[0]), int(words[1])
        if not 0 <= count <= MAX_CORNERS or not 0 <= faces <= MAX_CORNERS:
            raise ValueError(f"{count} vertices and {faces} faces")
        if len(lines) < 1 + count + faces:
            raise ValueError(f"the file ends before its last face, of {faces} that it states")
        if len(lines) > 1 + count + faces:
            number = lines[1 + count + faces][0]
            raise ValueError(f"the file goes on after its last face, of {faces} that it states")
        vertices = np.zeros((count, 3))
        for row in range(count):
            number, words = lines[1 + row]
            vertices[row] = float(words[0]), float(words[1]), float(words[2])
        corners, sizes = [], []
        for number, words in lines[1 + count : 1 + count + faces]:  # noqa: B007
            size = int(words[0])
            places = [int(word) for word in words[1 : 1 + size]]
            if not 0 <= size <= len(places) or (
                places and not 0 <= min(places) <= max(places) < count
            ):
                raise ValueError(f"a face refers to {places}, there are {count} vertices")
            if size > 2:
                corners += places
                sizes.append(size)
    except (IndexError, ValueError) as error:
        raise MeshError(f"{name}: line {number}: unreadable off: {quoted(error)}") from error
    flat = np.array(corners, dtype=np.int64)
    cut = triangles_of_polygons(vertices, flat, np.array(sizes, dtype=np.int64), name, repairs)
    return vertices, flat[cut]
