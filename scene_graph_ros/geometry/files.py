"""The door for files that others name: where they may lie, and how much of them is read.

A name may be that of a device, a pipe, a file of 40 GB or on a server that is gone, or a secret of
the user's. All of them are refused with ``OSError``, whose ``strerror`` says why.
``test/tools/test_files_of_others.py`` lists each place that opens a file otherwise, with its
reason.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass
import errno
import os
from pathlib import Path
import stat
import tempfile
import threading
from typing import NamedTuple, TypeVar

__all__ = [
    "MAX_MESH_BYTES",
    "MAX_TEXT_BYTES",
    "FileMark",
    "Reach",
    "find_file",
    "make_private",
    "package_folder",
    "read_limited",
    "read_marked",
    "read_part",
    "read_private",
]

MAX_MESH_BYTES = 256 * 2**20
"""A binary STL of five million triangles has this size."""

MAX_TEXT_BYTES = 32 * 2**20
"""Of scenes and robot descriptions. Those of whole factories have some megabytes."""

MAX_SECONDS = 20.0
"""How long a file may take to be found, and then to be read. A dead network mount has no end."""

Result = TypeVar("Result")
PathLike = str | os.PathLike[str]

_MANIFESTS = ("package.xml", "model.config")
"""What says that a folder is a package, of ROS or of Gazebo."""


@dataclass(frozen=True)
class Reach:
    """Which files somebody may name, and how much of a text messages may repeat.

    A user's own call may name any file. A request comes from the network: it names files with the
    endings that such files have, below some folders, and messages repeat no line of a file that is
    none of its kind. Nor do they tell whether there is a file elsewhere.
    """

    folders: tuple[Path, ...] | None = None
    """None: wherever the process may read."""

    @property
    def is_anywhere(self) -> bool:
        """Whether the user names the files, and may read all that messages say."""
        return self.folders is None

    def checked(self, path: Path, endings: tuple[str, ...]) -> Path:
        """Return the path without ``..``, if it may be named; whether it exists is not looked at.

        Without ``endings`` it is a mesh or a picture, whose reader looks at these. A link below a
        folder leads anywhere its owner wants. Raises OSError.
        """
        if self.folders is None:
            return path
        plain = _plain(path)
        if endings and plain.suffix.lower() not in endings:
            message = f"a request may name files that end with {' or '.join(endings)} here"
            raise PermissionError(errno.EACCES, message, str(path))
        if not self.includes(plain):
            message = (
                "lies in none of the folders whose files a request may name; the node's parameter"
                " resource_folders names more"
            )
            raise PermissionError(errno.EACCES, message, str(path))
        return plain

    def includes(self, path: Path) -> bool:
        """Tell whether a path, of a file or a folder, may be looked at."""
        if self.folders is None:
            return True
        return any(_plain(path).is_relative_to(folder) for folder in self._spellings())

    def _spellings(self) -> set[Path]:
        """Return the folders as they are given and with links followed."""
        given = [_plain(folder) for folder in self.folders or ()]
        return {*given, *(Path(os.path.realpath(folder)) for folder in given)}


def _plain(path: Path) -> Path:
    return Path(os.path.normpath(path.absolute()))


def package_folder(path: PathLike) -> Path:
    """Return the folder of the package that a file lies in, else the file's own folder."""
    folder = Path(os.path.normpath(Path(path).absolute())).parent
    for above in (folder, *folder.parents):
        if any((above / name).is_file() for name in _MANIFESTS):
            return above
    return folder


class FileMark(NamedTuple):
    """The identity of a file that was read, also among others in its place."""

    place: str
    """Its path without links, as it was when it was read."""
    owner: int
    device: int
    inode: int
    size: int
    changed: int
    """In ns."""


def find_file(path: PathLike) -> os.stat_result:
    """Return the status of a regular file.

    Raises OSError for anything else, IsADirectoryError for a folder.
    """
    return _in_time(_status, path)


def read_limited(path: PathLike, limit: int) -> bytes:
    """Return the bytes of a regular file of at most ``limit`` bytes. Raises OSError."""
    return read_marked(path, limit)[0]


def read_marked(path: PathLike, limit: int) -> tuple[bytes, FileMark]:
    """Do as ``read_limited``, and return with it which file that was."""
    return _in_time(lambda path: _read(path, limit), path)


def read_part(mark: FileMark, start: int, count: int) -> bytes:
    """Return up to ``count`` bytes of a file from ``start`` on, as it was when it was marked.

    Raises OSError where another file is in its place, be it by a link, or it has changed.
    """
    return _in_time(lambda path: _read_part(path, mark, start, count), mark.place)


def read_private(path: PathLike, below: PathLike, limit: int) -> bytes:
    """Do as ``read_limited`` with a file that the process's user alone may read.

    With links followed it lies below the folder ``below``. Raises OSError for any other,
    FileNotFoundError where there is none.
    """
    return _in_time(lambda path: _read_private(path, below, limit), path)


def make_private(path: PathLike, below: PathLike, data: bytes) -> None:
    """Make a file that the process's user alone may read (mode 0600), as a whole or not at all.

    With links followed its folder is ``below`` or below that. Raises OSError, FileExistsError
    where there is something of that name.
    """
    _in_time(lambda path: _make_private(Path(path), below, data), path)


def _status(path: PathLike) -> os.stat_result:
    try:
        status = Path(path).stat()
    except ValueError as error:  # a NUL byte, or characters that no file name has
        raise OSError(errno.EINVAL, str(error), os.fspath(path)) from error
    return _checked(status, path)


def _checked(status: os.stat_result, path: PathLike) -> os.stat_result:
    if stat.S_ISDIR(status.st_mode):
        raise IsADirectoryError(errno.EISDIR, "is a folder", os.fspath(path))
    if not stat.S_ISREG(status.st_mode):
        raise OSError(errno.EINVAL, "is no regular file", os.fspath(path))
    return status


_FLAGS = os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC | os.O_NOCTTY


def _read(path: PathLike, limit: int) -> tuple[bytes, FileMark]:
    """Read as many bytes as the file's size says: those of /proc always say 0."""
    _status(path)  # before it is opened, which may block or do something
    handle = os.open(path, _FLAGS)
    try:
        mark = _mark(handle, path)
        size = mark.size
        if size > limit:
            raise OSError(errno.EFBIG, f"has {size} bytes, the limit is {limit}", os.fspath(path))
        parts = []
        while size > 0 and (part := os.read(handle, size)):
            parts.append(part)
            size -= len(part)
        return b"".join(parts), mark
    finally:
        os.close(handle)


def _read_part(path: PathLike, mark: FileMark, start: int, count: int) -> bytes:
    # Before it is opened: what took the file's place may be a pipe.
    _checked(os.lstat(path), path)
    handle = os.open(path, _FLAGS | os.O_NOFOLLOW)
    try:
        if _mark(handle, path) != mark:
            raise OSError(errno.ESTALE, "is no longer the file that was read", os.fspath(path))
        return os.pread(handle, count, start)
    finally:
        os.close(handle)


def _read_private(path: PathLike, below: PathLike, limit: int) -> bytes:
    status = _status(path)
    if status.st_uid != os.geteuid():
        message = "is not a file of the user that this process runs as"
        raise PermissionError(errno.EACCES, message, os.fspath(path))
    if status.st_mode & (stat.S_IRWXG | stat.S_IRWXO):
        message = f"others may use it, with mode {stat.S_IMODE(status.st_mode):04o}: chmod 600 it"
        raise PermissionError(errno.EACCES, message, os.fspath(path))
    data, mark = _read(path, limit)
    if (mark.device, mark.inode) != (status.st_dev, status.st_ino):
        raise OSError(errno.ESTALE, "another file took its place meanwhile", os.fspath(path))
    _require_below(Path(mark.place), below, path)
    return data


def _make_private(path: Path, below: PathLike, data: bytes) -> None:
    _require_below(Path(os.path.realpath(path.parent)), below, path)
    handle, unfinished = tempfile.mkstemp(prefix=f".{path.name[:64]}", dir=path.parent)  # 0600
    try:
        try:
            os.write(handle, data)
        finally:
            os.close(handle)
        # Fails where the name is taken, also by something that came just now.
        os.link(unfinished, path)
    finally:
        Path(unfinished).unlink()


def _require_below(place: Path, below: PathLike, path: PathLike) -> None:
    if not place.is_relative_to(os.path.realpath(below)):
        message = f"leads out of the folder {os.fspath(below)!r}"
        raise PermissionError(errno.EACCES, message, os.fspath(path))


def _mark(handle: int, path: PathLike) -> FileMark:
    status = _checked(os.fstat(handle), path)
    try:
        # Where the open file is: the path may lead elsewhere by now.
        place = str(Path(f"/proc/self/fd/{handle}").readlink())
    except OSError:  # no Linux
        place = os.path.realpath(path)
    return FileMark(
        place,
        status.st_uid,
        status.st_dev,
        status.st_ino,
        status.st_size,
        status.st_mtime_ns,
    )


def _in_time(work: Callable[[PathLike], Result], path: PathLike) -> Result:
    """Do work that may block in the kernel in a thread, which is left behind if it does."""
    outcome: Future[Result] = Future()

    def run() -> None:
        try:
            outcome.set_result(work(path))
        except BaseException as error:  # noqa: BLE001 - raised again in the thread that waits
            outcome.set_exception(error)

    threading.Thread(target=run, daemon=True, name="reading a file").start()
    try:
        return outcome.result(MAX_SECONDS)
    except TimeoutError as error:
        message = f"gives no answer within {MAX_SECONDS:g} s"
        raise OSError(errno.ETIMEDOUT, message, os.fspath(path)) from error
