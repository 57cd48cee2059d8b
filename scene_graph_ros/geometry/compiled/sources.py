"""The sources that decide a kernel's machine code, and the digests that tell them."""

from __future__ import annotations

from collections.abc import Iterator
import functools
import hashlib
from pathlib import Path
import re
import sys
import time
from typing import Any

import numba
import numba.core.config as numba_config

__all__ = ["FLAGS", "IMPORTED", "digest_of_everything", "files_of", "folder_of", "is_of_package"]

# Flags that are not given are inherited from the caller that happens to trigger the compilation,
# so all that matter are given.
FLAGS: dict[str, Any] = {
    "nogil": True,
    "error_model": "numpy",
    "fastmath": False,
    "forceinline": False,
    "_nrt": True,
    # Nobody passes kernels to C, so nobody needs their entry points for it.
    "no_cfunc_wrapper": True,
}
_PACKAGE = "scene_graph_ros"
_PACKAGE_FOLDER = Path(__file__).parents[2]
_WITH_KERNELS = ("convex", "geometry", "planning", "robots", "trajectories", "warmup")
"""Folders of the package in which kernels are, and what says which of them belong together."""
_KEEPING = frozenset(
    f"{__name__.rpartition('.')[0]}.{name}"
    for name in (
        "cache",
        "claims",
        "kernel_files",
        "kernel_packs",
        "lazy_dispatcher",
        "lean_code",
        "pack_writer",
        "readiness",
        "signal_shield",
        "sources",
    )
)
"""Modules that decide where code is kept and how it is loaded, not which code."""
_FORMAT = 3
"""Of what is kept: a change of it leaves all that was kept behind."""
IMPORTED = time.time()
"""When this process began to import kernels, s."""
_IMPORT = re.compile(
    rf"^\s*(?:from|import)\s+({re.escape(_PACKAGE)}[\w.]*)(?:\s+import\s+(\([^)]*\)|.*))?", re.M
)


@functools.cache
def digest_of_everything() -> str:
    """Hash all sources with kernels, as they are when first asked for.

    While it is the same, so is every cached kernel.
    """
    digest = hashlib.blake2b(_environment(), digest_size=8)
    keeping = {Path(__file__).parent / f"{name.rpartition('.')[2]}.py" for name in _KEEPING}
    for folder in _WITH_KERNELS:
        for path in sorted((_PACKAGE_FOLDER / folder).rglob("*.py")):
            if path in keeping:
                continue
            digest.update(path.read_bytes())
    return digest.hexdigest()


def is_of_package(module: str) -> bool:
    """Tell whether a module is one of the package's."""
    return _file_of(module) is not None


def files_of(module: str) -> Iterator[Path]:
    """Return the package's files that decide the machine code of a module's kernels."""
    return (path for path in map(_file_of, _closure(module)) if path is not None)


@functools.cache
def _source(name: str) -> bytes:
    """Return the source of one of the package's modules, empty for any other."""
    path = _file_of(name)
    return b"" if path is None else path.read_bytes()


@functools.cache
def _file_of(name: str) -> Path | None:
    """Return the file of one of the package's modules."""
    if not f"{name}.".startswith(f"{_PACKAGE}."):
        return None
    base = _PACKAGE_FOLDER.joinpath(*name.split(".")[len(_PACKAGE.split(".")) :])
    candidates = (base.with_suffix(".py"), base / "__init__.py")
    return next((path for path in candidates if path.is_file()), None)


@functools.cache
def _imported_modules(name: str) -> frozenset[str]:
    """Name the package's modules that the source of module ``name`` imports."""
    found = set()
    for module, names in _IMPORT.findall(_source(name).decode()):
        found.add(module)
        found.update(f"{module}.{part}" for part in re.findall(r"\w+", names))
    return frozenset(module for module in found if _source(module))


@functools.cache
def _closure(module: str) -> frozenset[str]:
    """Name the modules whose sources decide the machine code of a module's kernels."""
    here = __name__.rpartition(".")[0]
    closure = {f"{here}.{file.stem}" for file in Path(__file__).parent.glob("*.py")} - _KEEPING
    pending = {module} | set().union(*map(_imported_modules, closure)) - closure
    pending -= _KEEPING
    while pending:
        name = pending.pop()
        closure.add(name)
        pending |= _imported_modules(name) - closure - _KEEPING
    return frozenset(closure)


@functools.cache
def folder_of(module: str) -> str:
    """Name the folder of a module's kernels: a digest of all that decides their machine code."""
    digest = hashlib.blake2b(digest_size=8)
    for name in sorted(_closure(module)):
        digest.update(name.encode())
        digest.update(_source(name))
    digest.update(_environment())
    return digest.hexdigest()


def _environment() -> bytes:
    versions = (_FORMAT, numba.__version__, sys.version_info[:2])
    flags = (bool(numba_config.BOUNDSCHECK), sorted(FLAGS.items()))
    return repr((*versions, *flags)).encode()
