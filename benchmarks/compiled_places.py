"""Where compiled kernels are in this process, as LLVM keeps it for debuggers.

Each object that LLVM puts into memory is entered into a list, with its table of symbols, where a
debugger that stops the process looks for it: GDB's interface for compilers in a process. We read
that list from within. It works on Linux, on 64-bit processors.
"""

from __future__ import annotations

from collections.abc import Iterator
import ctypes
import mmap
from pathlib import Path
import struct
from typing import NamedTuple

__all__ = ["Place", "compiled_places"]

_LIST = b"__jit_debug_descriptor"
_SECTION = struct.Struct("<IIQQQQIIQQ")
_SYMBOL = struct.Struct("<IBBHQQ")
_SYMBOLS, _FUNCTION, _DATA = 2, 2, 1
"""The type of a section, and of symbols."""
_FIRST_SPECIAL = 0xFF00
"""Numbers of sections from here on are none."""


class Place(NamedTuple):
    """A function of machine code."""

    start: int
    size: int
    name: str
    """Of the module and the function, as far as they can be told from the symbol."""


class _Symbol(NamedTuple):
    start: int
    size: int
    name: bytes


def _symbols(elf: bytes | mmap.mmap, kind: int, wanted: bytes = b"") -> Iterator[_Symbol]:
    """Yield the symbols of a kind of an ELF file, or the wanted one only."""
    (table,) = struct.unpack_from("<Q", elf, 40)
    width, count = struct.unpack_from("<HH", elf, 58)
    sections = [_SECTION.unpack_from(elf, table + width * k) for k in range(count)]
    for section in sections:
        if section[1] != _SYMBOLS:
            continue
        first, size, names_at = section[4], section[5], sections[section[6]][4]
        for found in _SYMBOL.iter_unpack(elf[first : first + size]):
            name_at, info, _, index, value, length = found
            if info & 15 != kind or not 0 < index < _FIRST_SPECIAL:
                continue
            at = names_at + name_at
            if wanted and elf[at : at + len(wanted) + 1] != wanted + b"\0":
                continue
            # In memory, some addresses count from the section's beginning.
            base = sections[index][3]
            start = base + value if value < base else value
            yield _Symbol(start, length, bytes(elf[at : elf.find(b"\0", at)]))


def _library() -> tuple[int, Path]:
    """Return where llvmlite's library begins, and its file."""
    for line in Path("/proc/self/maps").read_text().splitlines():
        fields = line.split()
        if fields[-1].endswith("libllvmlite.so") and int(fields[2], 16) == 0:
            return int(fields[0].split("-")[0], 16), Path(fields[-1])
    raise RuntimeError("no kernel was compiled or loaded in this process")


def _list_address() -> int:
    base, path = _library()
    with path.open("rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as elf:
        for symbol in _symbols(elf, _DATA, _LIST):
            return base + symbol.start
    raise RuntimeError(f"{path} has no symbol {_LIST.decode()}: it was stripped")


def _name(symbol: bytes) -> str:
    """Return the parts of a symbol that numba wrote as lengths and names: module and function."""
    if not symbol.startswith(b"_ZN"):
        return symbol.decode()
    parts, at = [], 3
    while symbol[at : at + 1].isdigit():
        end = at
        while symbol[end : end + 1].isdigit():
            end += 1
        at = end + int(symbol[at:end])
        parts.append(symbol[end:at].decode())
    return ".".join(parts)


def compiled_places() -> list[Place]:
    """Return all functions that LLVM compiled or loaded in this process, by where they start.

    Raises RuntimeError where nothing was compiled yet, or the library tells nothing.
    """
    places = []
    (entry,) = struct.unpack("<Q", ctypes.string_at(_list_address() + 16, 8))
    while entry:
        entry, _, elf_at, size = struct.unpack("<QQQQ", ctypes.string_at(entry, 32))
        found = _symbols(ctypes.string_at(elf_at, size), _FUNCTION)
        places += [Place(symbol.start, symbol.size, _name(symbol.name)) for symbol in found]
    return sorted(place for place in places if place.size)
