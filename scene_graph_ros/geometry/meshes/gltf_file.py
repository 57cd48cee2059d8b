"""The parts of glTF and GLB files: the document, and the buffers that it names or holds."""

from __future__ import annotations

import base64
import binascii
from collections.abc import Callable, Iterator
import json
from pathlib import PurePosixPath
import struct
from typing import Any
from urllib.parse import unquote, unquote_to_bytes

from scene_graph_ros.geometry.errors import MeshError
from scene_graph_ros.geometry.quoting import quoted

__all__ = [
    "GLTF_TYPES",
    "binary_part",
    "buffers_beside",
    "data_of",
    "document_of",
    "path_of_buffer",
    "with_buffers",
    "with_document",
]

GLTF_TYPES = ("glb", "gltf")

_HEADER, _CHUNK = struct.Struct("<4sII"), struct.Struct("<I4s")


def document_of(contents: bytes, file_type: str) -> Any:
    """Return the document. Raises ValueError for bytes that are no such file."""
    if file_type == "gltf":
        return json.loads(contents)
    start = _HEADER.size + _CHUNK.size
    return json.loads(contents[start : start + _length_of_document(contents)])


def with_document(contents: bytes, file_type: str, tree: Any) -> bytes:
    """Return a file's contents with another document."""
    text = json.dumps(tree).encode()
    if file_type == "gltf":
        return text
    magic, version, _ = _HEADER.unpack_from(contents)
    _, kind = _CHUNK.unpack_from(contents, _HEADER.size)
    text += b" " * (-len(text) % 4)
    rest = contents[_HEADER.size + _CHUNK.size + _length_of_document(contents) :]
    chunks = _CHUNK.pack(len(text), kind) + text + rest
    return _HEADER.pack(magic, version, _HEADER.size + len(chunks)) + chunks


def binary_part(contents: bytes, file_type: str) -> bytes:
    """Return the buffer that a GLB file holds without a name; nothing for another file."""
    start = _HEADER.size + _CHUNK.size + _length_of_document(contents)
    if file_type == "gltf" or contents[start + 4 : start + _CHUNK.size] != b"BIN\0":
        return b""
    length = int.from_bytes(contents[start : start + 4], "little")
    return contents[start + _CHUNK.size :][:length]


def _length_of_document(contents: bytes) -> int:
    return int.from_bytes(contents[_HEADER.size : _HEADER.size + 4], "little")


def data_of(uri: str) -> bytes | None:
    """Return the bytes of a data address; None for another address. Raises ValueError."""
    if not uri.startswith("data:"):
        return None
    head, _, body = uri.partition(",")
    try:
        return base64.b64decode(body) if head.endswith(";base64") else unquote_to_bytes(body)
    except binascii.Error as error:
        raise ValueError(f"an address of data is unreadable: {error}") from error


def buffers_beside(contents: bytes, file_type: str) -> list[str]:
    """Return the addresses of the buffers that are files, as the document writes them."""
    return [buffer["uri"] for buffer in _beside(_document_or_none(contents, file_type))]


def with_buffers(
    contents: bytes, file_type: str, name: str, read: Callable[[str], bytes]
) -> bytes:
    """Return a file's contents with the buffers beside it in its document.

    ``read`` takes a path that is relative to the file. Raises MeshError, naming the mesh and the
    buffer, for one outside the file's folder and one that is shorter than the document says.
    """
    tree = _document_or_none(contents, file_type)
    found = list(_beside(tree))
    for buffer in found:
        uri, length = buffer["uri"], buffer.get("byteLength")
        data = read(path_of_buffer(uri, name))
        if isinstance(length, int) and len(data) < length:
            raise MeshError(f"{name}: buffer {quoted(uri)} has {len(data)} bytes, not {length}")
        held = base64.b64encode(data).decode()
        buffer["uri"] = f"data:application/octet-stream;base64,{held}"
    return with_document(contents, file_type, tree) if found else contents


def path_of_buffer(uri: str, name: str) -> str:
    """Return the path of a buffer, relative to the file of the mesh called ``name``.

    Raises MeshError for one that leads out of that file's folder.
    """
    path = PurePosixPath(unquote(uri))
    if ":" in uri or "\\" in uri or path.is_absolute() or ".." in path.parts:
        raise MeshError(
            f"{name}: buffer {quoted(uri)} is no file in the folder of the mesh's file"
        )
    return str(path)


def _document_or_none(contents: bytes, file_type: str) -> Any:
    """Return the document, None of any other file, which others refuse."""
    try:
        return document_of(contents, file_type)
    except (RecursionError, ValueError):
        return None


def _beside(tree: Any) -> Iterator[dict[str, Any]]:
    buffers = tree.get("buffers") if isinstance(tree, dict) else None
    for buffer in buffers if isinstance(buffers, list) else ():
        uri = buffer.get("uri") if isinstance(buffer, dict) else None
        if isinstance(uri, str) and not uri.startswith("data:"):
            yield buffer
