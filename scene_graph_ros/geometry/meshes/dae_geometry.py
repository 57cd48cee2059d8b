"""The triangles of a COLLADA file's geometries, as their elements of polygons and strips say."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.errors import MeshError
from scene_graph_ros.geometry.meshes.dae_document import Document, integers_of
from scene_graph_ros.geometry.meshes.polygons import triangles_of_polygons
from scene_graph_ros.geometry.meshes.solids.mesh_report import Repair
from scene_graph_ros.geometry.quoting import quoted

__all__ = ["Body", "Input", "bodies_of"]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

_FACES = ("polygons", "polylist", "triangles", "trifans", "tristrips")
_NO_SURFACE = ("asset", "extra", "lines", "linestrips", "source", "vertices")


class Input(NamedTuple):
    """What one of the indices of a corner is of."""

    semantic: str
    source: str | None
    """The address of a source."""
    offset: int
    """Which of a corner's indices it is."""
    number: str
    """Which of the inputs of the same semantic."""


class Body(NamedTuple):
    """One element of triangles, polygons or strips."""

    points: FloatArray
    """(v, 3): the positions of its source."""
    rows: IntArray
    """(c, k): the indices of all corners."""
    inputs: list[Input]
    offset: int
    """Which of a corner's indices is that of its position."""
    cut: IntArray
    """(m, 3): the corners of triangles, counter-clockwise seen from outside."""
    material: str | None
    """The symbol that a scene binds to a material."""
    document: Document
    """As it is seen from within the geometry."""


def bodies_of(geometry: Any, document: Document, name: str, repairs: list[Repair]) -> list[Body]:
    """Return the bodies of a geometry in their order; lines have no surface.

    ``repairs`` gets the repairs. Raises MeshError for polygons with holes and what is no mesh,
    ValueError for numbers that don't fit together.
    """
    document = document.within(geometry)
    mesh, called = geometry.find("mesh"), quoted(geometry.get("id"))
    if mesh is None:
        kinds = [child.tag for child in geometry if child.tag not in ("asset", "extra", "spline")]
        if kinds:
            raise MeshError(
                f"{name}: geometry {called} is of the kind {quoted(kinds[0])}, which is not read:"
                " export triangles"
            )
        return []
    result = []
    for element in mesh:
        if element.tag in _FACES:
            result.append(_body(element, document, name, repairs))
        elif element.tag not in _NO_SURFACE:
            raise MeshError(f"{name}: geometry {called} has {quoted(element.tag)}, not read")
    return result


def _body(element: Any, document: Document, name: str, repairs: list[Repair]) -> Body:
    inputs = list(_inputs(element, document))
    position = next((one for one in inputs if one.semantic == "POSITION"), None)
    if position is None:
        raise ValueError(f"{element.tag} without vertices")
    width = 1 + max(one.offset for one in inputs)
    points = document.source(position.source, "XYZ")
    if element.find("ph") is not None:
        raise MeshError(f"{name}: polygons with holes are not read: export triangles")
    texts = [integers_of(one) for one in element.findall("p")]
    if any(len(text) % width for text in texts):
        raise ValueError(f"{element.tag} with indices that are not {width} for each corner")
    rows = np.concatenate([np.zeros((0, width), np.int64), *(t.reshape(-1, width) for t in texts)])
    sizes = np.array([len(text) // width for text in texts], dtype=np.int64)
    corners = rows[:, position.offset]
    wrong = (corners < 0) | (corners >= len(points))
    if wrong.any():
        raise ValueError(f"a face refers to vertex {corners[wrong][0]}, there are {len(points)}")
    if element.tag in ("trifans", "tristrips"):
        cut = _of_strips(element.tag, sizes)
    else:
        if element.tag == "triangles":
            sizes = np.full(_stated(element, len(rows) // 3), 3)
        elif element.tag == "polylist":
            counts = element.find("vcount")
            sizes = np.zeros(0, np.int64) if counts is None else integers_of(counts)
            _stated(element, len(sizes))
        if len(rows) != sizes.sum() or sizes.min(initial=0) < 0:
            raise ValueError(f"{len(rows)} corners of {element.tag} that have {sizes.sum()}")
        cut = _of_polygons(points, corners, sizes, name, repairs)
    return Body(points, rows, inputs, position.offset, cut, element.get("material"), document)


def _inputs(element: Any, document: Document) -> Iterator[Input]:
    """Yield the inputs of an element; vertices stand for inputs of their own."""
    for one in element.findall("input"):
        offset, number = int(one.get("offset", 0)), one.get("set", "")
        if offset < 0:
            raise ValueError(f"an input has the offset {offset}")
        if one.get("semantic") == "VERTEX":
            for own in document.target(one.get("source"), "vertices").findall("input"):
                yield Input(own.get("semantic", ""), own.get("source"), offset, "")
        else:
            yield Input(one.get("semantic", ""), one.get("source"), offset, number)


def _stated(element: Any, found: int) -> int:
    """Return the number of faces. Raises ValueError where the element says another one."""
    stated = int(element.get("count", found))
    if stated != found:
        raise ValueError(f"{found} of {stated} {element.tag} that it states")
    return found


def _of_polygons(
    points: FloatArray, corners: IntArray, sizes: IntArray, name: str, repairs: list[Repair]
) -> IntArray:
    """Return (m, 3) places among the corners; what has less than three corners is no face."""
    if (sizes == 3).all():
        return np.arange(len(corners)).reshape(-1, 3)
    is_face = sizes > 2
    kept = np.flatnonzero(np.repeat(is_face, sizes))
    return kept[triangles_of_polygons(points, corners[kept], sizes[is_face], name, repairs)]


def _of_strips(kind: str, sizes: IntArray) -> IntArray:
    """Return (m, 3) places among the corners of strips or fans, one behind another."""
    found = [np.zeros((0, 3), np.int64)]
    for start, size in zip(np.cumsum(sizes) - sizes, sizes, strict=True):
        i = np.arange(max(size - 2, 0))
        first, turn = (0 * i, 0 * i) if kind == "trifans" else (i, i % 2)
        found.append(start + np.stack([first, i + 1 + turn, i + 2 - turn], axis=1))
    return np.concatenate(found)
