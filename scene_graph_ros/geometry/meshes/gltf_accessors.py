"""Numbers of a glTF document: accessors as arrays, as the standard reads them."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.errors import MeshError
from scene_graph_ros.geometry.meshes.gltf_file import binary_part, data_of

__all__ = ["Accessors", "entry"]

_TYPES = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}


def _packed(shape: tuple[int, int], dtype: np.dtype[Any], length: int) -> int:
    """Return the stride of rows without one: that of their numbers.

    Rows of a vertex's numbers begin at multiples of four bytes, as the standard demands: where
    the data is as long as that takes, it is so.
    """
    size = shape[1] * dtype.itemsize
    aligned = -4 * (-size // 4)
    return aligned if shape[1] > 1 and shape[0] * aligned == length else size


def entry(tree: dict[str, Any], key: str, index: Any) -> Any:
    """Return an entry of one of a document's lists. Raises ValueError where it has none."""
    entries = tree.get(key, ())
    if type(index) is not int or not 0 <= index < len(entries):
        raise ValueError(f"there is no entry {index!r} of its {key}")
    return entries[index]


class Accessors:
    """The accessors of a document, read when asked for; errors name the one that is wrong."""

    def __init__(self, tree: dict[str, Any], contents: bytes, file_type: str, name: str) -> None:
        """Take a document and the file that it is of; ``name`` is the mesh's in messages."""
        self._tree, self._name = tree, name
        self._contents, self._file_type = contents, file_type
        self._buffers: dict[int, bytes] = {}

    def numbers(self, index: Any) -> NDArray[np.float64]:
        """Return (n, k) numbers; integers that are normalized as the standard's fractions."""
        raw = self.raw(index)
        values = raw.astype(np.float64)
        if self._accessor(index).get("normalized") and raw.dtype.kind in "iu":
            values = np.maximum(values / np.iinfo(raw.dtype).max, -1.0)
        return values

    def indices(self, index: Any) -> NDArray[np.int64]:
        """Return (n,) whole numbers."""
        raw = self.raw(index)
        if raw.dtype.kind != "u" or raw.shape[1] != 1:
            raise MeshError(f"{self._name}: accessor {index}: indices must be unsigned integers")
        return raw[:, 0].astype(np.int64)

    def raw(self, index: Any) -> NDArray[Any]:
        """Return (n, k) numbers as they are written, sparse ones in their places."""
        accessor = self._accessor(index)
        where = f"{self._name}: accessor {index}"
        count, width = accessor["count"], _WIDTHS.get(accessor["type"])
        if width is None or accessor["componentType"] not in _TYPES:
            raise MeshError(
                f"{where}: {accessor['type']!r} of {accessor['componentType']!r} is not read"
            )
        dtype = np.dtype(_TYPES[accessor["componentType"]])
        if "bufferView" in accessor:
            start = accessor.get("byteOffset", 0)
            result = self._view(accessor["bufferView"], start, (count, width), dtype, where)
        else:
            result = np.zeros((count, width), dtype)
        sparse = accessor.get("sparse")
        return result if sparse is None else self._with_sparse(result, sparse, where)

    def _accessor(self, index: Any) -> dict[str, Any]:
        found: dict[str, Any] = entry(self._tree, "accessors", index)
        return found

    def _with_sparse(self, values: NDArray[Any], sparse: Any, where: str) -> NDArray[Any]:
        count, at, new = sparse["count"], sparse["indices"], sparse["values"]
        kind = np.dtype(_TYPES[at["componentType"]])
        rows = self._view(at["bufferView"], at.get("byteOffset", 0), (count, 1), kind, where)[:, 0]
        if kind.kind != "u" or (count and int(rows.max()) >= len(values)):
            raise MeshError(f"{where}: a sparse index is not below its count {len(values)}")
        shape = (count, values.shape[1])
        start = new.get("byteOffset", 0)
        result = values.copy()
        result[rows] = self._view(new["bufferView"], start, shape, values.dtype, where)
        return result

    def _view(
        self, index: int, start: int, shape: tuple[int, int], dtype: np.dtype[Any], where: str
    ) -> NDArray[Any]:
        """Return numbers of a view of a buffer, one row after another or at its stride."""
        view = entry(self._tree, "bufferViews", index)
        extensions = view.get("extensions", {})
        data = self.buffer_view(index)
        stride = view.get("byteStride") or _packed(shape, dtype, len(data) - start)
        needed = start + (shape[0] - 1) * stride + shape[1] * dtype.itemsize if shape[0] else 0
        if min(start, stride, shape[0]) < 0 or needed > len(data) or not stride:
            told = f", which {' and '.join(extensions)} should unpack" if extensions else ""
            raise MeshError(f"{where}: it reaches beyond buffer view {index}{told}")
        strides = (stride, dtype.itemsize)
        if not shape[0]:
            return np.zeros(shape, dtype)
        return np.ndarray(shape, dtype, data, start, strides).copy()

    def buffer_view(self, index: Any) -> bytes:
        """Return the bytes of a view of a buffer. Raises MeshError for one beyond its buffer."""
        view = entry(self._tree, "bufferViews", index)
        data = self._buffer(view["buffer"])
        start, length = view.get("byteOffset", 0), view["byteLength"]
        if min(start, length) < 0 or start + length > len(data):
            raise MeshError(f"{self._name}: buffer view {index} reaches beyond its buffer")
        return data[start : start + length]

    def _buffer(self, index: int) -> bytes:
        if index not in self._buffers:
            buffer = entry(self._tree, "buffers", index)
            data = data_of(buffer["uri"]) if "uri" in buffer else None
            if data is None and index == 0 and "uri" not in buffer:
                data = binary_part(self._contents, self._file_type)
            if data is None:
                raise MeshError(f"{self._name}: buffer {index} has no data in the file")
            self._buffers[index] = data
        return self._buffers[index]
