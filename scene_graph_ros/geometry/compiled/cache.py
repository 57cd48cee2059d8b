"""Where compiled kernels are kept between processes.

Numba's own cache does not notice when a helper in *another* file changes, nor a change of
``NUMBA_BOUNDSCHECK``; it is bound to the path of the sources, and where its folder can't be
written it writes beside the sources. Here the kernels of a module are kept in a folder whose name
is a digest of its source, of the sources of all modules of ours that it imports, of this
folder's, of numba's version and of the flags. So a stale kernel can't be loaded, a copied or
moved installation finds its kernels, and a change of one file compiles only what depends on it.
This folder counts for all, since a kernel may be called with lanes that its module does not
import; of named tuples the fields are part of what a kernel is kept by. Where the cache can't be
written, or others may write to it, kernels are compiled anew in each process, and what is damaged
in it is compiled anew once, with one warning.

Set ``SCENE_GRAPH_ROS_KERNEL_CACHE`` to place the cache elsewhere than the user's cache folder.
"""

from __future__ import annotations

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
from numba.core import caching, serialize, sigutils
import numba.core.config as numba_config
from numba.core.types import containers

from scene_graph_ros.geometry.compiled.kernel_files import (
    KernelFiles,
    make_folder,
    why_not_trusted,
)

__all__ = [
    "FLAGS",
    "KernelCache",
    "KernelCacheWarning",
    "cache_problem",
    "cache_root",
    "digest_of_everything",
    "name_by_what_it_holds",
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
_WITH_KERNELS = ("convex", "geometry", "planning", "robots", "trajectories", "warmup")
"""Folders of the package in which kernels are, and what says which of them belong together."""
_IMPORT = re.compile(
    rf"^\s*(?:from|import)\s+({re.escape(_PACKAGE)}[\w.]*)(?:\s+import\s+(\([^)]*\)|.*))?", re.M
)


class KernelCacheWarning(UserWarning):
    """Compiled kernels can't be kept, or are damaged: compiling them anew takes minutes."""


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
        make_folder(root, root)
        problem = _why_not_trusted(root)
        if not problem:
            tempfile.TemporaryFile(dir=root).close()
    except (OSError, RuntimeError) as error:  # RuntimeError: there is no home folder
        return f"compiled kernels can't be kept: {error}"
    return problem


def _why_not_trusted(*folders: Path) -> str:
    """Say which of the cache's folders may hold others' code, which would run as the user."""
    for folder in folders:
        try:
            problem = why_not_trusted(folder.stat())
        except FileNotFoundError:
            continue
        if problem:
            return (
                f"compiled kernels are neither read nor kept, as {folder} {problem}: remove it, "
                "or let SCENE_GRAPH_ROS_KERNEL_CACHE name a folder of your own"
            )
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
        if not _source(function.__module__):
            # Not this package's, so the digest says nothing of it.
            folder = str(Path("others", folder) / self.get_suitable_cache_subpath(file))
        self._folder = folder

    def get_cache_path(self) -> str:
        """Return the folder in which the function's machine code is kept."""
        try:
            return str(cache_root() / self._folder)
        except RuntimeError as error:
            _warn_of(error)
            return os.devnull

    def ensure_cache_path(self) -> None:
        """Make the folder. Raises OSError."""
        make_folder(cache_root(), Path(self.get_cache_path()))

    @classmethod
    def from_function(cls, function: Any, file: str) -> Any:
        """Return the one locator, whether or not its folder can be written."""
        return cls(function, file)


def _fields(given: Any) -> list[Any]:
    """List the fields of all named tuples in a signature.

    A kernel reads them by their place. Its module need not import that of the tuple, whose fields
    may have changed places since: to numba it is the same type by its name.
    """
    if isinstance(given, containers.BaseNamedTuple):
        return [given.fields, *map(_fields, given)]
    if isinstance(given, containers.BaseTuple | tuple):
        return [found for each in given if (found := _fields(each))]
    return []


def _held_by(function: Any) -> list[Any]:
    """List what a function holds of the function around it: kernels and other values.

    Numba pickles that, and a pickled kernel is another one in each process. Here a kernel is told
    by its name, by what its module depends on, which the other's need not import, and by what it
    holds itself.
    """
    held: list[Any] = []
    for cell in function.__closure__ or ():
        value = cell.cell_contents
        made_of = getattr(value, "py_func", None)
        if made_of is None:
            held.append(hashlib.blake2b(serialize.dumps(value)).hexdigest())
        else:
            module, name = made_of.__module__, made_of.__qualname__
            held.append((module, name, _digest(module), _held_by(made_of)))
    return held


def name_by_what_it_holds(function: Any) -> None:
    """Give a function that holds something a name of its own among those made as it was.

    The name is that of its machine code, in which a number tells functions of one name apart. Two
    processes may give the same number to two of them, and a third loads both.
    """
    if function.__closure__:
        held = repr(_held_by(function)).encode()
        function.__qualname__ += f"_{hashlib.blake2b(held, digest_size=8).hexdigest()}"


class KernelCache(caching.FunctionCache):
    """The cache of one kernel's machine code, for every combination of types."""

    class _impl_class(caching.CompileResultCacheImpl):  # noqa: N801 - numba's name for it
        _locator_classes = (_Locator,)

    def __init__(self, function: Any) -> None:
        super().__init__(function)
        self._cache_file = KernelFiles(
            self._cache_path, self._impl.filename_base, self._impl.locator.get_source_stamp()
        )

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep machine code; where that can't be done, say so once and go on without."""
        try:
            self._impl.locator.ensure_cache_path()
            if self._is_trusted():
                super().save_overload(sig, data)
        except (OSError, RuntimeError) as error:
            _warn_of(error)

    def _load_overload(self, sig: Any, target_context: Any) -> Any:
        """Load machine code, or return None where there is none that can be read."""
        key = self._index_key(sig, target_context.codegen())
        try:
            data = self._cache_file.load(key) if self._is_trusted() else None
            return None if data is None else self._impl.rebuild(target_context, data)
        except OSError as error:
            _warn_of(error)
        except Exception:  # noqa: BLE001 - what is damaged may raise anything
            self._discard(key)
        return None

    def _discard(self, key: Any) -> None:
        """Remove an entry that can't be loaded, so that it is compiled anew."""
        _warn_once(f"some of the compiled kernels in {cache_root()} are damaged, and removed")
        try:
            self._cache_file.discard(key)
        except OSError as error:
            _warn_of(error)

    def _is_trusted(self) -> bool:
        """Tell whether nobody else can have written what is in the folder; warn if not."""
        try:
            problem = _why_not_trusted(cache_root(), Path(self._cache_path))
        except RuntimeError as error:  # there is no home folder
            _warn_of(error)
            return False
        if problem:
            _warn_once(problem)
        return not problem

    def _index_key(self, sig: Any, codegen: Any) -> Any:
        arguments, _ = sigutils.normalize_signature(sig)
        code = hashlib.sha256(self._py_func.__code__.co_code).hexdigest()
        held = repr(_held_by(self._py_func))
        return (sig, codegen.magic_tuple(), code, held, repr(_fields(arguments)))


def _warn_of(error: Exception) -> None:
    reason = getattr(error, "strerror", None) or error
    _warn_once(cache_problem() or f"compiled kernels can't be kept in {cache_root()}: {reason}")


@functools.cache
def _warn_once(problem: str) -> None:
    """Warn of each problem once, however many kernels have it."""
    warnings.warn(
        f"{problem}; they are compiled anew, which takes minutes", KernelCacheWarning, stacklevel=2
    )


@functools.cache
def _source(name: str) -> bytes:
    """Return the source of one of the package's modules, nothing for what is none of them."""
    if not f"{name}.".startswith(f"{_PACKAGE}."):
        return b""
    base = _PACKAGE_FOLDER.joinpath(*name.split(".")[len(_PACKAGE.split(".")) :])
    for candidate in (base.with_suffix(".py"), base / "__init__.py"):
        if candidate.is_file():
            return candidate.read_bytes()
    return b""


@functools.cache
def _imported_modules(name: str) -> frozenset[str]:
    """Name the package's modules that the source of module ``name`` imports."""
    found = set()
    for module, names in _IMPORT.findall(_source(name).decode()):
        found.add(module)
        found.update(f"{module}.{part}" for part in re.findall(r"\w+", names))
    return frozenset(module for module in found if _source(module))


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
        digest.update(name.encode())
        digest.update(_source(name))
    digest.update(_environment())
    return digest.hexdigest()


def _environment() -> bytes:
    versions = (numba.__version__, sys.version_info[:3])
    flags = (bool(numba_config.BOUNDSCHECK), sorted(FLAGS.items()))
    return repr((*versions, *flags)).encode()
