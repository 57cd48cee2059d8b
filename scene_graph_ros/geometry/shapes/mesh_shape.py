"""The common part of Convex and Mesh: the source of their data, and their scale.

The data is one of: a file, the content of a file held in memory, or arrays. It is looked at here
only as far as it needs no parser; the mesh layer reads it when a geometry is registered for
proximity.
"""

from __future__ import annotations

from collections.abc import Hashable
import hashlib
import os
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scene_graph_ros.geometry.errors import InvalidShapeError
from scene_graph_ros.geometry.files import find_file
from scene_graph_ros.geometry.one_line import cut
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.real_arrays import real_array, whole_array
from scene_graph_ros.geometry.shapes.mesh_pieces import MeshPieces
from scene_graph_ros.geometry.shapes.shape import Shape
from scene_graph_ros.geometry.tolerances import MAX_SHAPE_SIZE, MIN_SCALE

__all__ = ["REPAIR_TOLERANCE", "MeshShape"]

REPAIR_TOLERANCE = 1e-6
"""Relative to a mesh's size: gaps and offsets up to this one are repaired unless a property says
otherwise. Files of single precision are off by a tenth of it."""

Scale = float | tuple[float, float, float] | ArrayLike


class MeshShape(Shape):
    """A shape given by vertices and triangles in frame G before scaling, units of metres."""

    __slots__ = (
        "_key",
        "contents",
        "faces",
        "file_type",
        "path",
        "pieces",
        "repair_tolerance",
        "scale",
        "vertices",
    )

    _key: Hashable

    path: Path | None
    """The absolute path of the file, or None."""
    contents: bytes | None
    """The content of a file held in memory, or None."""
    file_type: str
    """Lower-case extension without a dot, e.g. ``"obj"``; empty for arrays."""
    vertices: NDArray[np.float64] | None
    """(n, 3), read-only, or None."""
    faces: NDArray[np.int64] | None
    """(m, 3) indices, counter-clockwise seen from outside, read-only, or None."""
    scale: tuple[float, float, float]
    """Factor per axis of G; negative factors mirror."""
    repair_tolerance: float
    """Relative to the size: how large gaps are repaired. The proximity role says it."""
    pieces: MeshPieces | None
    """How a mesh is taken apart; None: it is one piece. The proximity role says it, too."""

    def __init__(
        self,
        path: str | os.PathLike[str] | None = None,
        scale: Scale = 1.0,
        *,
        vertices: ArrayLike | None = None,
        faces: ArrayLike | None = None,
        contents: bytes | str | None = None,
        file_type: str | None = None,
    ) -> None:
        """Describe a mesh by a file, by arrays or by a file's content.

        Raises InvalidShapeError for a file that cannot be read, arrays that are no mesh, or a
        scale that is not finite or smaller in magnitude than MIN_SCALE.
        """
        name = type(self).__name__
        if sum(source is not None for source in (path, vertices, contents)) != 1:
            raise InvalidShapeError(f"{name}: give exactly one of path, vertices or contents")
        if faces is not None and vertices is None:
            raise InvalidShapeError(f"{name}: faces come with vertices, not with a file")
        if file_type is not None and contents is None:
            raise InvalidShapeError(f"{name}: file_type {file_type!r} comes with contents")
        put = object.__setattr__
        put(self, "path", None)
        put(self, "contents", None)
        put(self, "file_type", "")
        put(self, "vertices", None)
        put(self, "faces", None)
        put(self, "scale", _checked_scale(name, scale))
        put(self, "repair_tolerance", REPAIR_TOLERANCE)
        put(self, "pieces", None)
        if path is not None:
            absolute = _checked_path(name, path)
            put(self, "path", absolute)
            put(self, "file_type", absolute.suffix.lower().lstrip("."))
            put(self, "_key", _file_key(name, absolute))
            return
        if contents is not None:
            put(self, "contents", _checked_contents(name, contents))
            put(self, "file_type", _checked_file_type(name, file_type))
        else:
            points = _checked_vertices(name, vertices)
            put(self, "vertices", points)
            if faces is not None:
                put(self, "faces", _checked_faces(name, faces, len(points)))
        put(self, "_key", self._digest_of_data())

    def _digest_of_data(self) -> str:
        digest = hashlib.blake2b(digest_size=16)
        for array in (self.vertices, self.faces):
            if array is not None:
                digest.update(array.tobytes())
                digest.update(b"|%d|" % len(array))
        digest.update(self.contents or b"")
        return f"{self.file_type}:{digest.hexdigest()}"

    @property
    def source_key(self) -> Hashable:
        """The identity of the unscaled data: equal keys mean equal vertices and faces.

        That of a file was taken when the shape was made: its path, size and time of change.
        """
        return self._key

    @property
    def filename(self) -> str:
        """The absolute path as text; empty for data in memory."""
        return "" if self.path is None else str(self.path)

    @property
    def extension(self) -> str:
        """The file type with its dot, e.g. ``".obj"``; empty for arrays."""
        return f".{self.file_type}" if self.file_type else ""

    def with_scale(self, scale: Scale) -> MeshShape:
        """Return the same data with another scale."""
        return self._with("scale", _checked_scale(self.type_name, scale))

    def with_repair_tolerance(self, tolerance: float) -> MeshShape:
        """Return the same data, repaired where gaps are up to ``tolerance`` of the size."""
        return self._with("repair_tolerance", tolerance)

    def with_pieces(self, pieces: MeshPieces | None) -> MeshShape:
        """Return the same data, taken apart another way."""
        return self._with("pieces", pieces)

    def _with(self, name: str, value: Any) -> MeshShape:
        result = object.__new__(type(self))
        for slot in MeshShape.__slots__:
            object.__setattr__(result, slot, getattr(self, slot))
        object.__setattr__(result, name, value)
        return result

    def __setattr__(self, name: str, value: Any) -> None:
        raise AttributeError(f"{self.type_name} is immutable: cannot set {name!r}")

    def __delattr__(self, name: str) -> None:
        raise AttributeError(f"{self.type_name} is immutable: cannot delete {name!r}")

    def __eq__(self, other: object) -> bool:
        if type(other) is not type(self):
            return NotImplemented
        return self._key == other._key and self._made_of_it() == other._made_of_it()

    def __hash__(self) -> int:
        return hash((type(self), self._key, self._made_of_it()))

    def _made_of_it(self) -> tuple[Any, ...]:
        return self.scale, self.repair_tolerance, self.pieces

    def __reduce__(self) -> tuple[Any, ...]:
        return _restore, (type(self), [getattr(self, slot) for slot in MeshShape.__slots__])

    def __repr__(self) -> str:
        if self.path is not None:
            source = repr(str(self.path))
        elif self.contents is not None:
            source = f"contents=<{len(self.contents)} bytes>, file_type={self.file_type!r}"
        else:
            source = "" if self.vertices is None else f"vertices=<{len(self.vertices)}>"
            if self.faces is not None:
                source += f", faces=<{len(self.faces)}>"
        scale = self.scale if len(set(self.scale)) > 1 else self.scale[0]
        return cut(f"{self.type_name}({source}, scale={scale!r})")


def _restore(cls: type[MeshShape], values: list[Any]) -> MeshShape:
    result = object.__new__(cls)
    for slot, value in zip(MeshShape.__slots__, values, strict=True):
        if isinstance(value, np.ndarray):
            value.setflags(write=False)
        object.__setattr__(result, slot, value)
    return result


def _checked_scale(name: str, scale: Any) -> tuple[float, float, float]:
    array = real_array(scale, f"{name}: scale must be one or three numbers", InvalidShapeError)
    if array.shape not in ((), (3,)):
        raise InvalidShapeError(f"{name}: scale must be one or three numbers, not {quoted(scale)}")
    factors = np.broadcast_to(array, 3)
    if not np.isfinite(factors).all() or np.abs(factors).max() > MAX_SHAPE_SIZE:
        raise InvalidShapeError(
            f"{name}: scale must be finite and at most {MAX_SHAPE_SIZE:g}, not {quoted(scale)}"
        )
    if np.abs(factors).min() < MIN_SCALE:
        raise InvalidShapeError(
            f"{name}: scale must be at least {MIN_SCALE:g} in magnitude, not {quoted(scale)}"
        )
    return (float(factors[0]), float(factors[1]), float(factors[2]))


def _checked_path(name: str, path: str | os.PathLike[str]) -> Path:
    if not isinstance(path, (str, os.PathLike)):
        raise InvalidShapeError(f"{name}: path must be a file's path, not {quoted(path)}")
    # Not resolved: a link keeps its name, which tells the file type and appears in markers.
    return Path(os.path.normpath(Path.cwd() / path))


def _file_key(name: str, path: Path) -> Hashable:
    try:
        status = find_file(path)
    except OSError as error:
        raise InvalidShapeError(
            f"{name}: cannot read file {quoted(str(path))}: {error.strerror}"
        ) from error
    if not os.access(path, os.R_OK):
        raise InvalidShapeError(f"{name}: cannot read file {quoted(str(path))}: permission denied")
    return (str(path), status.st_mtime_ns, status.st_size)


def _checked_contents(name: str, contents: Any) -> bytes:
    data = contents.encode() if isinstance(contents, str) else contents
    if not isinstance(data, (bytes, bytearray, memoryview)) or len(data) == 0:
        raise InvalidShapeError(
            f"{name}: contents must be the bytes of a file, not {quoted(contents)}"
        )
    return bytes(data)


def _checked_file_type(name: str, file_type: Any) -> str:
    if not isinstance(file_type, str) or not file_type.strip(" ."):
        raise InvalidShapeError(
            f'{name}: contents need a file_type such as "obj", not {quoted(file_type)}'
        )
    return file_type.strip(" .").lower()


def _checked_vertices(name: str, vertices: Any) -> NDArray[np.float64]:
    array = real_array(vertices, f"{name}: vertices must be (n, 3) numbers", InvalidShapeError)
    if array.ndim != 2 or array.shape[1] != 3 or len(array) == 0:
        raise InvalidShapeError(f"{name}: vertices must be (n, 3) with n > 0, not {array.shape}")
    bad = ~(np.isfinite(array) & (np.abs(array) <= MAX_SHAPE_SIZE)).all(axis=1)
    if bad.any():
        row = int(bad.argmax())
        raise InvalidShapeError(
            f"{name}: vertices[{row}] must be finite and within {MAX_SHAPE_SIZE:g} m,"
            f" not {array[row].tolist()}"
        )
    array.setflags(write=False)
    return array


def _checked_faces(name: str, faces: Any, vertex_count: int) -> NDArray[np.int64]:
    raw = whole_array(faces, f"{name}: faces must be (m, 3) integers", InvalidShapeError)
    kind = np.asarray(faces).dtype
    if raw.ndim != 2 or raw.shape[1] != 3 or len(raw) == 0 or kind.kind not in "iu":
        raise InvalidShapeError(
            f"{name}: faces must be (m, 3) integers with m > 0, not {raw.shape} {kind}"
        )
    bad = ((raw < 0) | (raw >= vertex_count)).any(axis=1)
    if bad.any():
        row = int(bad.argmax())
        raise InvalidShapeError(
            f"{name}: faces[{row}] must index the {vertex_count} vertices, not {raw[row].tolist()}"
        )
    raw.setflags(write=False)
    return raw
