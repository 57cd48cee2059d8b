"""Read the vertices, faces and colours of a PLY file, in words or binary."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.errors import MeshError
from scene_graph_ros.geometry.meshes.polygons import triangles_of_polygons
from scene_graph_ros.geometry.meshes.promises import MAX_CORNERS
from scene_graph_ros.geometry.meshes.solids.mesh_report import Repair
from scene_graph_ros.geometry.quoting import quoted

__all__ = ["parse_ply"]

_NUMBERS = {
    "char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1", "short": "i2", "int16": "i2",
    "ushort": "u2", "uint16": "u2", "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4",
    "float": "f4", "float32": "f4", "double": "f8", "float64": "f8",
}  # fmt: skip
_ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
_INDICES = ("vertex_indices", "vertex_index")
_MAX_LIST = 100_000
"""Entries of one list; more are no face of anything."""


class _Property(NamedTuple):
    name: str
    kind: str
    count_kind: str | None
    """The type of a list's length; None for a number."""


class _Element(NamedTuple):
    name: str
    rows: int
    properties: list[_Property]


class _Table(NamedTuple):
    """Rows of an element."""

    columns: dict[str, NDArray[Any]]
    """Numbers (n,), by name."""
    lists: dict[str, tuple[NDArray[np.int64], NDArray[Any]]]
    """Lists by name: how long each is (n,), and their entries one after another."""


def parse_ply(
    contents: bytes, name: str, repairs: list[Repair]
) -> tuple[NDArray[np.float64], NDArray[np.int64], NDArray[np.float64] | None]:
    """Return vertices (n, 3), triangles (m, 3) and their colours (m, 3), 0 to 1, or None.

    A triangle has the colour of its face, or else the mean of its corners'. ``repairs`` gets the
    repairs.

    Raises:
        MeshError: the file is not PLY, ends too early or is longer than its header says, or a face
            refers to a vertex that is not there.

    """
    try:
        elements, order, body = _header(contents)
        tables = _body(elements, order, body)
        return _mesh(tables, name, repairs)
    except (ArithmeticError, LookupError, TypeError, ValueError) as error:
        if isinstance(error, MeshError):
            raise
        raise MeshError(f"{name}: unreadable ply: {quoted(error)}") from error


def _header(contents: bytes) -> tuple[list[_Element], str, bytes]:
    head, found, body = contents.partition(b"end_header")
    lines = [line.split() for line in head.decode("latin-1").splitlines()]
    if not found or not lines or lines[0] != ["ply"]:
        raise ValueError("it does not begin with ply and a header")
    elements: list[_Element] = []
    order = None
    for words in lines[1:]:
        match words:
            case ["format", kind, _] if kind in _ORDERS:
                order = _ORDERS[kind]
            case ["element", label, count]:
                if not count.isdecimal():
                    raise ValueError(f"an element of {count[:60]!r} rows")
                elements.append(_Element(label, int(count), []))
            case ["property", "list", count_kind, kind, label]:
                one = _Property(label, _NUMBERS[kind], _NUMBERS[count_kind])
                elements[-1].properties.append(one)
            case ["property", kind, label]:
                elements[-1].properties.append(_Property(label, _NUMBERS[kind], None))
            case [] | ["comment" | "obj_info", *_]:
                pass
            case _:
                raise ValueError(f"no line of a header: {' '.join(words)[:60]!r}")
    if order is None:
        raise ValueError("its header names no format")
    # The line ends as the file's do: a carriage return, a line feed or both.
    ending = 2 if body[:2] == b"\r\n" else 1
    return elements, order, body[ending:]


def _body(elements: list[_Element], order: str, body: bytes) -> dict[str, _Table]:
    tables: dict[str, _Table] = {}
    if order:
        at = 0
        for element in elements:
            tables[element.name], at = _binary_table(element, order, body, at)
        return tables
    numbers = np.array(body.split(), dtype=np.float64)
    row = 0
    for element in elements:
        tables[element.name], row = _text_table(element, numbers, row)
    if row != len(numbers):
        raise ValueError(f"it has {len(numbers) - row} numbers more than its header says")
    return tables


def _binary_table(element: _Element, order: str, body: bytes, at: int) -> tuple[_Table, int]:
    """Read an element where all lists are as long as in the first row; else row by row."""
    sizes, fields, offset = {}, [], at
    for number, one in enumerate(element.properties):
        if one.count_kind is not None:
            kind = np.dtype(order + one.count_kind)
            size = int(np.frombuffer(body, kind, 1, offset)[0]) if element.rows else 0
            _check_list(size)
            sizes[one.name] = size
            fields += [(f"#{number}", kind), (one.name, np.dtype(order + one.kind), (size,))]
            offset += kind.itemsize + size * np.dtype(one.kind).itemsize
        else:
            fields.append((one.name, np.dtype(order + one.kind)))
            offset += np.dtype(one.kind).itemsize
    record = np.dtype(fields)
    if at + record.itemsize * element.rows <= len(body):
        rows = np.frombuffer(body, record, element.rows, at)
        lists = {k: one for k, one in enumerate(element.properties) if one.count_kind is not None}
        if all((rows[f"#{k}"] == sizes[one.name]).all() for k, one in lists.items()):
            columns = {p.name: rows[p.name] for p in element.properties if p.count_kind is None}
            entries = {
                one.name: (np.full(element.rows, sizes[one.name]), rows[one.name].reshape(-1))
                for one in lists.values()
            }
            return _Table(columns, entries), at + record.itemsize * element.rows
    return _uneven_table(element, _Bytes(body, at, order))


def _check_list(size: float) -> None:
    if not 0 <= size <= _MAX_LIST or size % 1:
        raise ValueError(f"a list of {size:.15g} entries")


class _Bytes:
    """Numbers of binary rows, one after another."""

    def __init__(self, body: bytes, at: int, order: str) -> None:
        self._body, self.at, self._order = body, at, order

    def take(self, kind: str, count: int) -> NDArray[Any]:
        dtype = np.dtype(self._order + kind)
        if self.at + count * dtype.itemsize > len(self._body):
            raise ValueError("it ends before its last row")
        result = np.frombuffer(self._body, dtype, count, self.at)
        self.at += count * dtype.itemsize
        return result


class _Words:
    """Numbers of rows in words, one after another."""

    def __init__(self, numbers: NDArray[np.float64], at: int) -> None:
        self._numbers, self.at = numbers, at

    def take(self, kind: str, count: int) -> NDArray[Any]:
        del kind
        if self.at + count > len(self._numbers):
            raise ValueError("it ends before its last row")
        self.at += count
        return self._numbers[self.at - count : self.at]


def _uneven_table(element: _Element, source: _Bytes | _Words) -> tuple[_Table, int]:
    numbers: dict[str, list[Any]] = {p.name: [] for p in element.properties}
    sizes: dict[str, list[int]] = {p.name: [] for p in element.properties if p.count_kind}
    for _ in range(element.rows):
        for one in element.properties:
            size = 1
            if one.count_kind is not None:
                stated = float(source.take(one.count_kind, 1)[0])
                _check_list(stated)
                size = int(stated)
                sizes[one.name].append(size)
            numbers[one.name].append(source.take(one.kind, size))
    joined = {key: np.concatenate([np.zeros(0), *values]) for key, values in numbers.items()}
    columns = {key: values for key, values in joined.items() if key not in sizes}
    lists = {key: (np.array(values, np.int64), joined[key]) for key, values in sizes.items()}
    return _Table(columns, lists), source.at


def _text_table(element: _Element, numbers: NDArray[Any], row: int) -> tuple[_Table, int]:
    """Read rows without lists at once, others one by one."""
    if any(one.count_kind is not None for one in element.properties):
        return _uneven_table(element, _Words(numbers, row))
    width = len(element.properties)
    end = row + element.rows * width
    if end > len(numbers):
        raise ValueError("it ends before its last row")
    rows = numbers[row:end].reshape(element.rows, width)
    return _Table({one.name: rows[:, k] for k, one in enumerate(element.properties)}, {}), end


def _mesh(
    tables: dict[str, _Table], name: str, repairs: list[Repair]
) -> tuple[NDArray[np.float64], NDArray[np.int64], NDArray[np.float64] | None]:
    if "tristrips" in tables:
        raise ValueError("strips of triangles are not read: export it with faces")
    points = tables["vertex"].columns
    vertices = np.stack([points[axis].astype(np.float64) for axis in "xyz"], axis=1)
    faces = tables.get("face", _Table({}, {}))
    named = next((key for key in _INDICES if key in faces.lists), None)
    if named is None or max(len(vertices), len(faces.lists[named][1])) > 3 * MAX_CORNERS:
        if named is not None:
            raise ValueError(f"more than {MAX_CORNERS} vertices or triangles")
        return vertices, np.zeros((0, 3), dtype=np.int64), None
    sizes, entries = faces.lists[named]
    wrong = ~((entries >= 0) & (entries < len(vertices)) & (entries == np.floor(entries)))
    if wrong.any():
        index = entries[wrong.argmax()]
        raise ValueError(f"a face refers to vertex {float(index):.15g}, there are {len(vertices)}")
    corners = entries.astype(np.int64)
    # What has less than three corners is no face.
    is_face = sizes > 2
    corners = corners[np.repeat(is_face, sizes)]
    cut = triangles_of_polygons(vertices, corners, sizes[is_face], name, repairs)
    triangles = corners[cut]
    of_faces, of_vertices = _colors(faces.columns), _colors(points)
    if of_faces is not None:
        return vertices, triangles, np.repeat(of_faces[is_face], sizes[is_face] - 2, axis=0)
    colors = None if of_vertices is None else of_vertices[triangles].mean(axis=1)
    return vertices, triangles, colors


def _colors(columns: dict[str, NDArray[Any]]) -> NDArray[np.float64] | None:
    """Return red, green and blue (n, 3), 0 to 1; None without them."""
    if not {"red", "green", "blue"} <= columns.keys():
        return None
    rgb = np.stack([columns[key] for key in ("red", "green", "blue")], axis=1).astype(np.float64)
    is_fraction = columns["red"].dtype.kind == "f" and rgb.max(initial=0.0) <= 1.0
    return np.clip(rgb if is_fraction else rgb / 255.0, 0.0, 1.0)
