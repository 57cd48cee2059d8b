"""The files in which compiled kernels are kept: each is whole and the user's own, or absent.

Files that are read here are unpickled and run, so a byte that a power cut, a bad disk or somebody
else changed would crash the process or take it over. Each file of machine code is named by a
digest of its bytes, and the index that leads there begins with a digest of its own. Files are
synced before they replace others, so that a power cut leaves the old one or the new one.
"""

from __future__ import annotations

import fcntl
import glob
import hashlib
import os
from pathlib import Path
import pickle
from typing import Any

from numba.core import serialize

__all__ = ["KernelFiles", "make_folder", "why_not_trusted"]

_DIGEST_BYTES = 16
_OTHERS_MAY_WRITE = 0o022


def why_not_trusted(status: os.stat_result) -> str:
    """Say why a file or folder may hold somebody else's code; "" where it can't.

    Root could change the user's programs in any case.
    """
    if status.st_uid not in (0, os.geteuid()):
        return f"belongs to another user, {status.st_uid}"
    if status.st_mode & _OTHERS_MAY_WRITE:
        return "can be written by other users"
    return ""


def make_folder(root: Path, folder: Path) -> None:
    """Make a folder below ``root``, and the root for the user alone. Raises OSError."""
    root.mkdir(parents=True, exist_ok=True, mode=0o700)
    folder.mkdir(parents=True, exist_ok=True, mode=0o755)


class KernelFiles:
    """The files of one function: an index that leads from types to files of machine code.

    Beside a file of machine code (``.nbc``) is one that is read less often (``.nbb``). Each key
    of the index is pickled for itself: types of one module that is no more, or that only another
    checkout has, would make all of it unreadable otherwise.
    """

    def __init__(self, folder: str, base: str, stamp: Any) -> None:
        """Read and write files of names that begin with ``base``.

        ``stamp`` is the source's; None reads files of any source.
        """
        self._folder, self._base, self._stamp = Path(folder), base, stamp
        self._index = self._folder / f"{base}.nbi"

    def load(self, key: Any) -> Any:
        """Return the value kept for a key, None without one.

        Raises ValueError for files that are not as written, OSError for unreadable ones, and
        any error of unpickling.
        """
        try:
            names = self._names().get(key)
            return None if names is None else pickle.loads(self._data(names[0]))  # noqa: S301
        except FileNotFoundError:
            return None

    def load_beside(self, key: Any) -> bytes | None:
        """Return the bytes that are kept beside the value of `load`; raises as `load` does."""
        try:
            names = self._names().get(key)
            return None if names is None else self._data(names[1])
        except FileNotFoundError:
            return None

    def discard(self, key: Any) -> None:
        """Remove the entry of a key that could not be loaded, or the index if it can't be read."""
        try:
            names = self._names().get(key, ())
            paths = [self._folder / name for name in names]
        except Exception:  # noqa: BLE001 - whatever is wrong with it
            paths = [self._index]
        for path in paths:
            path.unlink(missing_ok=True)

    def save(self, key: Any, data: Any, beside: bytes = b"") -> None:
        """Keep machine code: its files first, then the index, which leads to whole files only.

        No other process saves a kernel of the same module meanwhile: both would begin with the
        same index, and one entry would be lost.
        """
        packed_data = serialize.dumps(data)
        contents = {
            f"{self._base}.{_digest(content).hex()}{suffix}": content
            for content, suffix in ((packed_data, ".nbc"), (beside, ".nbb"))
        }
        with (self._folder / ".lock").open("w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            for name, content in contents.items():
                _write(self._folder / name, content)
            entries = {**self._entries_to_keep(key), serialize.dumps(key): tuple(contents)}
            self._save_index(entries)
            kept = {name for names in entries.values() for name in names}
            for old in self._folder.glob(f"{glob.escape(self._base)}.*.nb[cb]"):
                if old.name not in kept:
                    old.unlink(missing_ok=True)

    def packed(self) -> dict[bytes, bytes]:
        """Return all that is kept, by pickled keys; raises as `load` does."""
        return {key: self._data(names[0]) for key, names in self._entries().items()}

    def _entries_to_keep(self, key: Any) -> dict[bytes, tuple[str, ...]]:
        """Return all entries of other keys, none where the index can't be read."""
        try:
            entries = self._entries()
        except (OSError, ValueError):
            return {}
        return {packed: names for packed, names in entries.items() if _unpacked(packed) != key}

    def _save_index(self, entries: dict[bytes, tuple[str, ...]]) -> None:
        content = pickle.dumps((self._stamp, entries))
        _write(self._index, _digest(content) + content)

    def _entries(self) -> dict[bytes, tuple[str, ...]]:
        """Return the names of files by pickled keys, also of those that can't be unpickled."""
        content = _read(self._index)
        digest, content = content[:_DIGEST_BYTES], content[_DIGEST_BYTES:]
        if _digest(content) != digest:
            raise ValueError(f"{self._index} is damaged")
        stamp, entries = pickle.loads(content)  # noqa: S301 - checked
        return entries if self._stamp in (None, stamp) else {}

    def _names(self) -> dict[Any, tuple[str, ...]]:
        names = {_unpacked(packed): name for packed, name in self._entries().items()}
        names.pop(None, None)
        return names

    def _data(self, name: str) -> bytes:
        content = _read(self._folder / name)
        if name != f"{self._base}.{_digest(content).hex()}{Path(name).suffix}":
            raise ValueError(f"{self._folder / name} is damaged")
        return content


def _unpacked(key: bytes) -> Any:
    """Return a key of the index, None for one of types that are not there."""
    try:
        return pickle.loads(key)  # noqa: S301 - part of an index that was checked
    except Exception:  # noqa: BLE001 - a module that is no more, or that raises
        return None


def _digest(content: bytes) -> bytes:
    return hashlib.blake2b(content, digest_size=_DIGEST_BYTES).digest()


def _read(path: Path) -> bytes:
    """Read a file that is the user's own or root's. Raises OSError, ValueError for others'."""
    with path.open("rb") as file:
        problem = why_not_trusted(os.fstat(file.fileno()))
        if problem:
            raise ValueError(f"{path} {problem}")
        return file.read()


def _write(path: Path, content: bytes) -> None:
    """Replace a file as a whole, also where the power fails meanwhile. Raises OSError."""
    fresh = path.with_name(f"{path.name}.tmp")
    handle = os.open(fresh, os.O_WRONLY | os.O_CREAT | os.O_TRUNC | os.O_CLOEXEC, 0o644)
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(content)
            file.flush()
            os.fsync(handle)
        fresh.replace(path)
    except OSError:
        fresh.unlink(missing_ok=True)
        raise
