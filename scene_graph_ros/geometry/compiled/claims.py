"""A kernel is compiled by one process at a time: others that need it wait until it is kept.

The set-up compiles in several processes, and tests do, whose kernels call the same ones. A claim
is a lock on one byte of a file, which the system takes back from a process that ends.
"""

from __future__ import annotations

import fcntl
import hashlib
import os
from pathlib import Path
import struct
import time

__all__ = ["claim", "give_up"]

PATIENCE = 120.0
"""Seconds after which a process compiles a kernel that another one has not kept by then, such as
one that is stopped in a debugger."""
_POLL = 0.02
_FORMAT = "hhqqi4x"  # C's struct flock
_LOCK = getattr(fcntl, "F_OFD_SETLK", None)


_held: set[int] = set()


def _leave_to_parent() -> None:
    # A lock is held as long as any process has its file open.
    while _held:
        os.close(_held.pop())


os.register_at_fork(after_in_child=_leave_to_parent)


def give_up(handle: int) -> None:
    """End a claim."""
    if handle in _held:
        _held.remove(handle)
        os.close(handle)


def claim(file: Path, name: bytes) -> int | None:
    """Return a handle that claims a name until the process gives it up, or ends.

    None where the system has no such locks, or another process keeps its claim for too long. The
    folder has to be there. Raises OSError.
    """
    if _LOCK is None:
        return None
    place = int.from_bytes(hashlib.blake2b(name, digest_size=7).digest(), "little")
    request = struct.pack(_FORMAT, fcntl.F_WRLCK, os.SEEK_SET, place, 1, 0)
    handle = os.open(file, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
    end = time.monotonic() + PATIENCE
    while True:
        try:
            fcntl.fcntl(handle, _LOCK, request)
        except (BlockingIOError, PermissionError):
            if time.monotonic() > end:
                os.close(handle)
                return None
            time.sleep(_POLL)
        except OSError:
            os.close(handle)
            raise
        else:
            _held.add(handle)
            return handle
