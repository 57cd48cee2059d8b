"""Where compiled kernels are kept between processes.

Numba's own cache does not notice when a helper in *another* file changes, nor a change of
``NUMBA_BOUNDSCHECK``; it is bound to the path of the sources, and where its folder can't be
written it writes beside the sources. Here the kernels of a module are kept in a folder whose name
is a digest of its source, of the sources of all modules of ours that it imports, of this
folder's, of numba's version and of the flags. So a stale kernel can't be loaded, a copied or
moved installation finds its kernels, and a change of one file compiles only what depends on it.
This folder counts for all, since a kernel may be called with lanes that its module does not
import. Where the cache can't be written, kernels are compiled anew in each process, with one
warning.

Set ``SCENE_GRAPH_ROS_KERNEL_CACHE`` to place the cache elsewhere than the user's cache folder.
"""

from __future__ import annotations

import fcntl
import functools
import hashlib
import os
from pathlib import Path
import re
import sys
import tempfile
from typing import Any
import warnings

import numba
from numba.core import caching
import numba.core.config as numba_config

__all__ = [
    "FLAGS",
    "KernelCache",
    "KernelCacheWarning",
    "cache_problem",
    "cache_root",
    "digest_of_everything",
]

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
_WITH_KERNELS = ("geometry", "planning", "robots", "warmup")
"""Folders of the package in which kernels are, and what says which of them belong together."""
_IMPORT = re.compile(
    rf"^\s*(?:from|import)\s+({re.escape(_PACKAGE)}[\w.]*)(?:\s+import\s+(\([^)]*\)|.*))?", re.M
)


class KernelCacheWarning(UserWarning):
    """Compiled kernels can't be kept, so each process compiles its own, which takes minutes."""


def cache_root() -> Path:
    """Return the folder below which compiled kernels are kept."""
    override = os.environ.get("SCENE_GRAPH_ROS_KERNEL_CACHE")
    if override:
        return Path(override)
    base = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(base) / "scene_graph_ros" / "kernels"


def cache_problem() -> str:
    """Say why kernels can't be kept in the cache's folder; "" where they can."""
    try:
        root = cache_root()
        root.mkdir(parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=root).close()
    except (OSError, RuntimeError) as error:  # RuntimeError: there is no home folder
        return f"compiled kernels can't be kept: {error}"
    return ""


def digest_of_everything() -> str:
    """Hash all sources with kernels: while it is the same, so is every cached kernel."""
    digest = hashlib.blake2b(_environment(), digest_size=8)
    for folder in _WITH_KERNELS:
        for path in sorted((_PACKAGE_FOLDER / folder).rglob("*.py")):
            digest.update(path.read_bytes())
    return digest.hexdigest()


class _Locator(caching._SourceFileBackedLocatorMixin, caching._CacheLocator):
    """Tells numba the folder of a function's module."""

    def __init__(self, function: Any, file: str) -> None:
        self._py_file, self._lineno = file, function.__code__.co_firstlineno
        folder = _digest(function.__module__)
        if _module_file(function.__module__) is None:
            # Not this package's, so the digest says nothing of it.
            folder = str(Path("others", folder) / self.get_suitable_cache_subpath(file))
        self._folder = folder

    def get_cache_path(self) -> str:
        """Return the folder in which the function's machine code is kept."""
        try:
            return str(cache_root() / self._folder)
        except RuntimeError as error:
            _warn_once(str(error))
            return os.devnull

    @classmethod
    def from_function(cls, function: Any, file: str) -> Any:
        """Return the one locator, whether or not its folder can be written."""
        return cls(function, file)


class KernelCache(caching.FunctionCache):
    """The cache of one kernel's machine code, for every combination of types."""

    class _impl_class(caching.CompileResultCacheImpl):  # noqa: N801 - numba's name for it
        _locator_classes = (_Locator,)

    def __init__(self, function: Any) -> None:
        super().__init__(function)
        self._load_index = self._cache_file._load_index
        self._cache_file._load_index = self._load_readable_index
        self._save_file = self._cache_file.save
        self._cache_file.save = self._save_one_at_a_time

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep machine code; where that can't be done, say so once and go on without."""
        try:
            super().save_overload(sig, data)
        except OSError as error:
            _warn_once(error.strerror)

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Load machine code, or return None where there is none that can be read."""
        try:
            return super().load_overload(sig, target_context)
        except OSError as error:
            _warn_once(error.strerror)
            return None

    def _load_readable_index(self) -> Any:
        """Return what is kept, or nothing where it is about types that are no more.

        An index names the types of tuples by their modules. Sources that have not changed may have
        been called with tuples of a module that was moved.
        """
        try:
            return self._load_index()
        except (ImportError, AttributeError):
            return {}

    def _save_one_at_a_time(self, key: Any, data: Any) -> None:
        """Let no other process save a kernel of the same function meanwhile.

        Numba picks a free file name from an index that it read before. Two processes that
        compile the same function for different types would pick the same name, and the index of
        the one would lead to the machine code of the other.
        """
        with (Path(self.cache_path) / ".lock").open("w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            self._save_file(key, data)


@functools.cache
def _warn_once(problem: str) -> None:
    """Warn of each problem once, however many kernels have it."""
    where = cache_problem() or f"compiled kernels can't be kept in {cache_root()}: {problem}"
    warnings.warn(
        f"{where}; each process compiles its own, which takes minutes",
        KernelCacheWarning,
        stacklevel=2,
    )


def _module_file(name: str) -> Path | None:
    if not f"{name}.".startswith(f"{_PACKAGE}."):
        return None
    base = _PACKAGE_FOLDER.joinpath(*name.split(".")[len(_PACKAGE.split(".")) :])
    for candidate in (base.with_suffix(".py"), base / "__init__.py"):
        if candidate.is_file():
            return candidate
    return None


@functools.cache
def _imported_modules(name: str) -> frozenset[str]:
    """Name the package's modules that the source of module ``name`` imports."""
    path = _module_file(name)
    if path is None:
        return frozenset()
    found = set()
    for module, names in _IMPORT.findall(path.read_text()):
        found.add(module)
        found.update(f"{module}.{part}" for part in re.findall(r"\w+", names))
    return frozenset(found)


@functools.cache
def _digest(module: str) -> str:
    """Hash what decides the machine code of a module's kernels: sources, versions and flags."""
    here = __name__.rpartition(".")[0]
    closure = {f"{here}.{file.stem}" for file in Path(__file__).parent.glob("*.py")}
    pending = {module} | set().union(*map(_imported_modules, closure)) - closure
    while pending:
        name = pending.pop()
        closure.add(name)
        pending |= _imported_modules(name) - closure
    digest = hashlib.blake2b(digest_size=8)
    for name in sorted(closure):
        path = _module_file(name)
        if path is not None:
            digest.update(name.encode())
            digest.update(path.read_bytes())
    digest.update(_environment())
    return digest.hexdigest()


def _environment() -> bytes:
    versions = (numba.__version__, sys.version_info[:3])
    flags = (bool(numba_config.BOUNDSCHECK), sorted(FLAGS.items()))
    return repr((*versions, *flags)).encode()
