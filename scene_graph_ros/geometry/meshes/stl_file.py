"""Read the triangles of an STL file, in words or binary."""

from __future__ import annotations

from array import array
import re

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.errors import MeshError
from scene_graph_ros.geometry.meshes.promises import MAX_CORNERS
from scene_graph_ros.geometry.quoting import quoted

__all__ = ["parse_stl"]

_HEAD = 84
_RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
_VERTEX = re.compile(rb"\bvertex\b", re.IGNORECASE)
_FACET = re.compile(rb"\bfacet\b(.*?)\bendfacet\b", re.DOTALL | re.IGNORECASE)
_BEGINS = re.compile(rb"\bfacet\s+normal\b", re.IGNORECASE)


def parse_stl(contents: bytes, name: str) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Return vertices (3 m, 3) and triangles (m, 3), each with vertices of its own.

    A file is binary where it is as long as its count says, or longer, and does not begin with
    ``solid``; case, comments before it and bytes after the last triangle do not matter.

    Raises:
        MeshError: the file ends too early, or a vertex is no three numbers.

    """
    count = int.from_bytes(contents[80:84], "little")
    if len(contents) == _HEAD + _RECORD.itemsize * count or not _is_text(contents):
        corners = _binary(contents, count, name)
    else:
        corners = _text(contents, name)
    if len(corners) > MAX_CORNERS:
        raise MeshError(f"{name}: more than {MAX_CORNERS} vertices or triangles")
    triangles = np.arange(3 * len(corners), dtype=np.int64).reshape(-1, 3)
    return corners.reshape(-1, 3), triangles


def _is_text(contents: bytes) -> bool:
    """Tell whether a file has triangles in words: it begins with ``solid``, or has vertices."""
    head = contents[:4096].lower()
    if head.removeprefix(b"\xef\xbb\xbf").lstrip().startswith(b"solid") and b"\0" not in head:
        return True
    return b"\0" not in head and _VERTEX.search(contents) is not None


def _binary(contents: bytes, count: int, name: str) -> NDArray[np.float64]:
    if len(contents) < _HEAD + _RECORD.itemsize * count or len(contents) < _HEAD:
        if b"\0" not in contents[:4096]:
            raise MeshError(
                f"{name}: unreadable stl: it has no facets in words, and is too short for a binary"
                " one"
            )
        raise MeshError(
            f"{name}: unreadable stl: it ends before its last triangle, of {count} that it states"
        )
    records = np.frombuffer(contents, _RECORD, count, _HEAD)
    return records["corners"].astype(np.float64)


def _text(contents: bytes, name: str) -> NDArray[np.float64]:
    """Return (m, 3, 3) corners; lines may end anywhere."""
    numbers, facets = array("d"), 0
    for facet in _FACET.finditer(contents):
        facets += 1
        words = facet[1].lower().split()
        first = words.index(b"vertex") if b"vertex" in words else 0
        corners, rest = words[first : first + 12], words[first + 12 :]
        if corners[::4] != [b"vertex"] * 3 or len(corners) < 12 or rest not in ([], [b"endloop"]):
            raise MeshError(
                f"{name}: unreadable stl: facet {facets} does not have three vertices of three"
                " numbers"
            )
        try:
            numbers.extend([float(word) for k, word in enumerate(corners) if k % 4])
        except ValueError as error:
            raise MeshError(f"{name}: unreadable stl: facet {facets}: {quoted(error)}") from error
    if sum(1 for _ in _BEGINS.finditer(contents)) > facets:
        raise MeshError(f"{name}: unreadable stl: it ends within facet {facets + 1}")
    return np.frombuffer(numbers, dtype=np.float64).reshape(-1, 3, 3)
