"""Kernels that an installation brings along, compiled for a baseline of the processor.

A wheel has a pack for each of the levels x86-64-v2, -v3 and -v4 (System V ABI for AMD64, section
3.1.1). A pack is one file, mapped into memory: a line with the digest of its head, the head, which
has its platform and where each function's kernels are, and the kernels, each with a digest.
There is no bitcode in it (`lean_code`).

A pack is trusted as the code beside it is: a wheel's record has its digest, and it belongs to
root, to the user or to whoever owns this file. Where others may write it, it is not read.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
import functools
import grp
import hashlib
import json
import mmap
import os
from pathlib import Path
import pickle
import platform
import pwd
import stat
import sys
from typing import Any, NamedTuple

import numba
from numba.core import codegen
import numba.core.config as numba_config

from scene_graph_ros.geometry.compiled.kernel_files import why_not_trusted

__all__ = [
    "BASELINES",
    "FOLDER",
    "Pack",
    "PackError",
    "Place",
    "baselines_here",
    "digest_of",
    "first_line",
    "made_for",
    "open_pack",
]

FOLDER = Path(__file__).parents[2] / "kernels"
"""Where an installation has its packs, ``<baseline>.pack``; a checkout has none."""

_V2 = ("cx16", "sahf", "popcnt", "sse3", "ssse3", "sse4.1", "sse4.2")
_V3 = (*_V2, "avx", "avx2", "bmi", "bmi2", "f16c", "fma", "lzcnt", "movbe", "xsave")
_V4 = (*_V3, "avx512f", "avx512bw", "avx512cd", "avx512dq", "avx512vl")
BASELINES = {"x86-64-v4": _V4, "x86-64-v3": _V3, "x86-64-v2": _V2}
"""Features of processors, as LLVM names them, by level: the best first."""

_MAGIC = b"scene_graph_ros kernels 1"
_DIGEST_SIZE = 16
_LONGEST_FIRST_LINE = 100


class PackError(ValueError):
    """A pack can't be used; the message says why, and the remedy."""


class Place(NamedTuple):
    """Bytes of a pack, and their digest."""

    start: int
    length: int
    digest: str


def made_for() -> dict[str, str]:
    """Return the platform of this process's kernels, beside the processor."""
    return {
        "numba": numba.__version__,
        "Python": "{}.{}".format(*sys.version_info),
        "system": f"{sys.platform} {platform.machine()}",
    }


def baselines_here() -> list[str]:
    """List the baselines that this processor runs, the best first."""
    features = dict.fromkeys(_features(), True)
    return [name for name, needed in BASELINES.items() if all(map(features.get, needed))]


def _features() -> list[str]:
    """List the features that kernels may use here: numba may be told not to use AVX."""
    flat = codegen.get_host_cpu_features().split(",")
    return [feature[1:] for feature in flat if feature.startswith("+")]


def open_pack(folder: Path) -> Pack | None:
    """Return the pack of the best baseline; None where there are none, or the user asks for none.

    Whoever sets NUMBA_CPU_NAME to another processor than a baseline gets kernels compiled for it.
    Raises PackError.
    """
    there = [name for name in BASELINES if (folder / f"{name}.pack").exists()]
    if not there or numba_config.BOUNDSCHECK or numba_config.CPU_FEATURES:
        return None
    asked = numba_config.CPU_NAME
    fitting = [name for name in baselines_here() if name in there and asked in (None, name)]
    if fitting:
        return Pack(folder / f"{fitting[0]}.pack")
    if asked is not None:
        return None
    lacking = sorted({*BASELINES[there[-1]]} - {*_features()})
    raise PackError(
        f"the kernels of this installation are for x86-64 processors with {', '.join(lacking)}, "
        "which this one has not: wheels for other processors are made by `make wheels` on one"
    )


class Pack:
    """The kernels of a pack. Raises PackError where it is not for this process, or damaged."""

    def __init__(self, path: Path) -> None:
        """Read the head."""
        self._path = path
        self.is_damaged = False
        with path.open("rb") as file:
            for status, each in (
                (path.parent.stat(), path.parent),
                (os.fstat(file.fileno()), path),
            ):
                problem = _why_not_trusted(status)
                if problem:
                    remedy = f"chmod -R go-w {path.parent}"
                    raise PackError(f"{each} {problem}, so its kernels are not run: {remedy}")
            try:
                self._map = mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)
                line = self._map[: self._map.find(b"\n", 0, _LONGEST_FIRST_LINE) + 1]
                magic, digest, length = line.rsplit(maxsplit=2)
                head = self._bytes(Place(len(line), int(length), digest.decode()))
                self._head: dict[str, Any] = json.loads(head)
            except (ValueError, OSError) as error:  # a file without a byte can't be mapped
                raise self._damaged() from error
        self._start = len(line) + len(head)
        if magic != _MAGIC:
            raise self._damaged()
        self._require_fit()

    def _damaged(self) -> PackError:
        self.is_damaged = True
        return PackError(f"{self._path} is damaged: `pip install --force-reinstall` puts it right")

    def _require_fit(self) -> None:
        here = made_for()
        for what, wanted in self._head["made for"].items():
            if here.get(what) != wanted:
                raise PackError(
                    f"the kernels of this installation are for {what} {wanted}, and this is "
                    f"{here.get(what)}: install the wheel for that, or {what} {wanted}"
                )

    def is_of_other_sources(self, module: str, folder: str) -> bool:
        """Tell whether it has a module's kernels, but of other sources than ``folder`` names."""
        return self._head["modules"].get(module, folder) != folder

    def groups(self) -> Mapping[str, str]:
        """Return the groups whose kernels are all there, with the digest of everything."""
        groups: dict[str, str] = self._head["groups"]
        return groups

    def find(self, folder: str, base: str, key: Any) -> Any:
        """Return a kernel as it was kept; None where there is none. Raises PackError."""
        place = self._head["functions"].get(f"{folder}/{base}")
        if place is None:
            return None
        for packed, kernel in self._unpickled(self._placed(place)):
            if _is_key(packed, key):
                return self._unpickled(self._placed(kernel))
        return None

    def _placed(self, place: Iterable[Any]) -> Place:
        start, length, digest = place
        return Place(self._start + start, length, digest)

    def _unpickled(self, place: Place) -> Any:
        try:
            return pickle.loads(self._bytes(place))  # noqa: S301 - checked
        except Exception as error:
            raise self._damaged() from error

    def _bytes(self, place: Place) -> bytes:
        content = self._map[place.start : place.start + place.length]
        if len(content) != place.length or digest_of(content) != place.digest:
            raise ValueError("other bytes than were written")
        return content


def _is_key(packed: bytes, key: Any) -> bool:
    try:
        return bool(pickle.loads(packed) == key)  # noqa: S301 - part of what was checked
    except (ImportError, AttributeError):  # a type of a module that is not there
        return False


def first_line(head: bytes) -> bytes:
    """Return the line that a pack with this head begins with."""
    return b"%s %s %d\n" % (_MAGIC, digest_of(head).encode(), len(head))


def digest_of(content: bytes) -> str:
    """Return the digest by which bytes of a pack are told."""
    return hashlib.blake2b(content, digest_size=_DIGEST_SIZE).hexdigest()


def _why_not_trusted(status: os.stat_result) -> str:
    """Say why a file or folder of the installation is less to be trusted than its code."""
    fields: list[Any] = list(status[:10])
    if status.st_mode & stat.S_IWGRP and _is_users_own(status.st_gid):
        fields[0] &= ~stat.S_IWGRP
    if status.st_uid == Path(__file__).stat().st_uid:
        fields[4] = os.geteuid()
    return why_not_trusted(os.stat_result(fields))


@functools.cache
def _is_users_own(gid: int) -> bool:
    """Tell whether a group is the user's alone: made with the user, and nobody else's.

    Where each user has such a group, new files can be written by it.
    """
    try:
        user, group = pwd.getpwuid(os.geteuid()), grp.getgrgid(gid)
    except KeyError:
        return False
    return user.pw_gid == gid and group.gr_name == user.pw_name and not group.gr_mem
