"""Let meshio unpack no more than a mesh may have.

Its reader of .vtu files calls ``zlib.decompress`` and ``lzma.decompress``, which know no limit: a
file of a megabyte can unpack to a gigabyte with the one, and to many with the other. It gets
stand-ins for both modules that count.
"""

from __future__ import annotations

from collections.abc import Iterator
import contextlib
import lzma
import threading
from typing import Any
import zlib

from scene_graph_ros.geometry.files import MAX_MESH_BYTES

__all__ = ["MAX_UNPACKED", "limited_inflate"]

MAX_UNPACKED = MAX_MESH_BYTES
"""Bytes, of all blocks of a file: as many as one may have that is not packed."""

_budget = threading.local()


class _Limited:
    """Stands in for a module with ``decompress``; everything else is the module's."""

    def __init__(self, module: Any, make: Any) -> None:
        self._module, self._make = module, make

    def __getattr__(self, name: str) -> Any:
        return getattr(self._module, name)

    def decompress(self, data: bytes) -> bytes:
        """Unpack a block. Raises ValueError where it is cut short, or beyond the limit."""
        left = getattr(_budget, "left", MAX_UNPACKED)
        unpacker = self._make()
        result: bytes = unpacker.decompress(data, left + 1)
        if len(result) > left:
            raise ValueError(f"it unpacks to more than {MAX_UNPACKED} bytes")
        if not unpacker.eof:
            raise ValueError("a block ends too early")
        _budget.left = left - len(result)
        return result


_STAND_INS = {
    "zlib": _Limited(zlib, zlib.decompressobj),
    "lzma": _Limited(lzma, lzma.LZMADecompressor),
}


@contextlib.contextmanager
def limited_inflate() -> Iterator[None]:
    """Count the bytes that this thread unpacks with meshio inside, from the start."""
    from meshio.vtu import _vtu

    for name, stand_in in _STAND_INS.items():
        setattr(_vtu, name, stand_in)
    _budget.left = MAX_UNPACKED
    yield
