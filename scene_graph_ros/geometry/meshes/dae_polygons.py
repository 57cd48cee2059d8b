"""Polygons of COLLADA files as triangles, before a library makes fans of them."""

from __future__ import annotations

from typing import Any
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.errors import MeshError
from scene_graph_ros.geometry.meshes.polygons import triangles_of_polygons
from scene_graph_ros.geometry.meshes.solids.mesh_report import Repair
from scene_graph_ros.geometry.quoting import quoted

__all__ = ["with_triangles"]


def with_triangles(contents: bytes, name: str, repairs: list[Repair]) -> bytes:
    """Return a COLLADA file with ``triangles`` in place of polygons of more than three corners.

    Raises MeshError for polygons with holes, and indices that are not there. The file has passed
    ``check_promises``, which refuses entities and depth. ``repairs`` gets the repairs.
    """
    if b"polylist" not in contents and b"polygons" not in contents:
        return contents
    try:
        root = ElementTree.fromstring(contents)  # noqa: S314
        space = root.tag.partition("}")[0] + "}" if root.tag.startswith("{") else ""
        changed = False
        for mesh in root.iter(f"{space}mesh"):
            for kind in ("polylist", "polygons"):
                for element in mesh.findall(space + kind):
                    changed = _replace(element, mesh, space, name, repairs) or changed
    except (ElementTree.ParseError, LookupError, TypeError, ValueError) as error:
        if isinstance(error, MeshError):
            raise
        raise MeshError(f"{name}: unreadable dae: {quoted(error)}") from error
    if not changed:
        return contents
    if space:
        ElementTree.register_namespace("", space[1:-1])
    result: bytes = ElementTree.tostring(root)
    return result


def _replace(element: Any, mesh: Any, space: str, name: str, repairs: list[Repair]) -> bool:
    """Turn an element of polygons into one of triangles; tell whether it had to be."""
    kind = element.tag.removeprefix(space)
    inputs = element.findall(f"{space}input")
    width = 1 + max((int(one.get("offset", 0)) for one in inputs), default=0)
    if kind == "polygons":
        if element.find(f"{space}ph") is not None:
            raise ValueError("polygons with holes are not read: export triangles")
        texts = [_ints(p.text) for p in element.findall(f"{space}p")]
        sizes = np.array([len(text) // width for text in texts], dtype=np.int64)
        rows = np.concatenate([np.zeros(0, np.int64), *texts])
    else:
        counts = element.find(f"{space}vcount")
        sizes = _ints(None if counts is None else counts.text)
        found = element.find(f"{space}p")
        rows = _ints(None if found is None else found.text)
    if kind == "polylist" and (sizes == 3).all():
        return False
    if len(rows) != width * sizes.sum() or (sizes < 0).any():
        raise ValueError(f"{len(rows)} indices of {int(sizes.sum())} corners, {width} each")
    rows = rows.reshape(-1, width)
    is_face = sizes > 2
    rows, sizes = rows[np.repeat(is_face, sizes)], sizes[is_face]
    offset, vertices = _positions(inputs, mesh, space)
    corners = rows[:, offset]
    if len(corners) and not 0 <= corners.min() <= corners.max() < len(vertices):
        raise ValueError(f"a polygon refers to vertex {int(corners.max())} of {len(vertices)}")
    cut = triangles_of_polygons(vertices, corners, sizes, name, repairs)
    for child in list(element):
        if child.tag in (f"{space}vcount", f"{space}p"):
            element.remove(child)
    element.tag = f"{space}triangles"
    element.set("count", str(len(cut)))
    place = ElementTree.SubElement(element, f"{space}p")
    place.text = " ".join(map(str, rows[cut].reshape(-1).tolist()))
    return True


def _ints(text: str | None) -> NDArray[np.int64]:
    return np.array((text or "").split(), dtype=np.int64)


def _positions(inputs: Any, mesh: Any, space: str) -> tuple[int, NDArray[np.float64]]:
    """Return the offset of the vertices' index, and the vertices (n, 3)."""
    vertex = next(one for one in inputs if one.get("semantic") == "VERTEX")
    ids = {one.get("id"): one for one in mesh.iter() if one.get("id") is not None}
    named = ids[vertex.get("source").removeprefix("#")]
    position = next(
        one for one in named.findall(f"{space}input") if one.get("semantic") == "POSITION"
    )
    source = ids[position.get("source").removeprefix("#")]
    numbers = np.array((source.find(f"{space}float_array").text or "").split(), dtype=np.float64)
    accessor = source.find(f"{space}technique_common/{space}accessor")
    stride = 3 if accessor is None else int(accessor.get("stride", 3))
    start = 0 if accessor is None else int(accessor.get("offset", 0))
    numbers = numbers[start:]
    count = len(numbers) // stride
    return int(vertex.get("offset", 0)), numbers[: count * stride].reshape(-1, stride)[:, :3]
