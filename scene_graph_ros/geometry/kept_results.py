"""Results that took long to find, kept in the user's cache by all that they were made of.

A file holds arrays and no code, after a digest of its bytes: one that was cut short or changed is
found again and replaced. Files, or folders, that somebody else can write are neither read nor
written. The least recently used files go where all take more than ``MAX_BYTES``. Of processes and
threads that want the same at once, one finds it.

Set ``SCENE_GRAPH_ROS_MESH_CACHE`` to place the folder elsewhere than the user's cache folder.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
import contextlib
import functools
import hashlib
import io
import os
from pathlib import Path
import tempfile
import warnings

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.compiled.claims import claim, give_up
from scene_graph_ros.geometry.compiled.kernel_files import make_folder, why_not_trusted
from scene_graph_ros.geometry.files import find_file, read_limited

__all__ = ["MAX_BYTES", "KeptResultsWarning", "kept", "results_root"]

Arrays = Mapping[str, NDArray]

MAX_BYTES = 2**30
"""Of all files of one kind together."""

_MAX_FILE = 2**28
_DIGEST_BYTES = 16


class KeptResultsWarning(UserWarning):
    """Results can't be kept, or are damaged: finding them anew takes long."""


def results_root() -> Path:
    """Return the folder below which results are kept. Raises RuntimeError without a home."""
    override = os.environ.get("SCENE_GRAPH_ROS_MESH_CACHE")
    if override:
        return Path(override)
    base = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(base) / "scene_graph_ros" / "meshes"


def kept(kind: str, name: str, find: Callable[[], Arrays]) -> Arrays:
    """Return the value kept under a name, or find and keep it.

    Args:
        kind: a folder for results of one kind.
        name: a digest of all that the result depends on, in hexadecimal digits.
        find: the function to call where nothing is kept; its errors are raised.

    """
    folder = _folder(kind)
    if folder is None:
        return find()
    path = folder / f"{name}.npz"
    found = _read(path)
    if found is not None:
        return found
    with _claimed(folder, name):
        found = _read(path)  # another process may have kept it meanwhile
        if found is None:
            found = find()
            _write(path, found)
    return found


@contextlib.contextmanager
def _claimed(folder: Path, name: str) -> Iterator[None]:
    """Wait while others find a result, then keep them from it; for minutes at most."""
    handle = None
    with contextlib.suppress(OSError):
        handle = claim(folder.with_suffix(".claims"), name.encode())
    try:
        yield
    finally:
        if handle is not None:
            give_up(handle)


def _folder(kind: str) -> Path | None:
    """Make a folder, and return it if nobody else can have written its files."""
    try:
        root = results_root()
        folder = root / kind
        make_folder(root, folder)
        for each in (root, folder):
            problem = why_not_trusted(each.stat())
            if problem:
                _warn_once(
                    f"results are neither read nor kept, as {each} {problem}: remove it, or let"
                    " SCENE_GRAPH_ROS_MESH_CACHE name a folder of your own"
                )
                return None
    except (OSError, RuntimeError) as error:  # RuntimeError: there is no home folder
        _warn_once(f"results can't be kept: {error}")
        return None
    return folder


def _read(path: Path) -> Arrays | None:
    """Return the arrays of a file, None where there is none that is whole and the user's own."""
    try:
        problem = why_not_trusted(find_file(path))
        if problem:
            _warn_once(f"{path} is not read: it {problem}")
            return None
        content = read_limited(path, _MAX_FILE)
    except FileNotFoundError:
        return None
    except OSError as error:
        _warn_once(f"{path} can't be read: {error.strerror}")
        return None
    digest, content = content[:_DIGEST_BYTES], content[_DIGEST_BYTES:]
    if _digest(content) != digest:
        _warn_once(f"{path} is damaged, and found again")
        return None
    with contextlib.suppress(OSError):
        os.utime(path)  # it was used now
    with np.load(io.BytesIO(content), allow_pickle=False) as arrays:
        return {key: arrays[key] for key in arrays.files}


def _write(path: Path, arrays: Arrays) -> None:
    """Replace a file as a whole; where that can't be done, say so once and go on without."""
    packed = io.BytesIO()
    np.savez(packed, **dict(arrays))  # type: ignore[arg-type]
    content = packed.getvalue()
    if len(content) + _DIGEST_BYTES > _MAX_FILE:
        return
    try:
        handle, fresh = tempfile.mkstemp(dir=path.parent, suffix=".tmp")
        try:
            with os.fdopen(handle, "wb") as file:
                file.write(_digest(content))
                file.write(content)
            Path(fresh).replace(path)
        except OSError:
            Path(fresh).unlink(missing_ok=True)
            raise
        _forget_oldest(path.parent)
    except OSError as error:
        _warn_once(f"results can't be kept in {path.parent}: {error.strerror}")


def _forget_oldest(folder: Path) -> None:
    """Remove the files not used for longest, where files together are larger than MAX_BYTES."""
    files = []
    for path in folder.iterdir():
        with contextlib.suppress(FileNotFoundError):  # another process tidies up, too
            status = path.lstat()
            files.append((status.st_mtime_ns, status.st_size, path))
    total = sum(size for _, size, _ in files)
    for _, size, path in sorted(files):
        if total <= MAX_BYTES:
            return
        path.unlink(missing_ok=True)
        total -= size


def _digest(content: bytes) -> bytes:
    return hashlib.blake2b(content, digest_size=_DIGEST_BYTES).digest()


@functools.cache
def _warn_once(problem: str) -> None:
    warnings.warn(f"{problem}; finding them anew takes long", KeptResultsWarning, stacklevel=2)
