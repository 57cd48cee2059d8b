"""Where compiled kernels are kept between processes.

Numba's own cache does not notice when a helper in *another* file changes, nor a change of
``NUMBA_BOUNDSCHECK``; it is bound to the path of the sources, and where its folder can't be
written it writes beside the sources. Here the kernels of a module are kept in a folder whose name
is a digest of its source, of the sources of all modules of ours that it imports, of this
folder's as far as they decide machine code, of numba's version and of the flags. So a stale
kernel can't be loaded, a copied or moved installation finds its kernels, and a change of one file
compiles only what depends on it. This folder counts for all, since a kernel may be called with
lanes that its module does not import; of named tuples the fields are part of what a kernel is
kept by.

An installation may bring kernels along (`kernel_packs`); all others come from the user's
cache. Where that can't be written, or others may write to it, kernels are compiled anew in each
process, and a damaged one is compiled anew once, with one warning.

Set ``SCENE_GRAPH_ROS_KERNEL_CACHE`` to place the cache elsewhere than the user's cache folder.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
import contextlib
import functools
import hashlib
import os
from pathlib import Path
import tempfile
from typing import Any
import warnings

from numba.core import caching, serialize, sigutils
from numba.core.types import containers

from scene_graph_ros.geometry.compiled import kernel_packs
from scene_graph_ros.geometry.compiled.claims import claim, give_up
from scene_graph_ros.geometry.compiled.kernel_files import (
    KernelFiles,
    make_folder,
    why_not_trusted,
)
from scene_graph_ros.geometry.compiled.kernel_packs import Pack, PackError
from scene_graph_ros.geometry.compiled.lean_code import (
    lean_callee,
    lean_code,
    rebuild,
    rebuild_callee,
)
from scene_graph_ros.geometry.compiled.sources import (
    digest_of_everything,
    files_of,
    FLAGS,
    folder_of,
    IMPORTED,
    is_of_package,
)

__all__ = [
    "FLAGS",
    "KernelCache",
    "KernelCacheWarning",
    "cache_problem",
    "cache_root",
    "digest_of_everything",
    "folder_of",
    "is_for_callers",
    "name_by_what_it_holds",
    "packed_groups",
    "written_behind",
]


_CALLEE = "for callers"
"""Marks the keys of kernels without machine code."""


def is_for_callers(key: Any) -> bool:
    """Tell whether a key is of bitcode alone, without the machine code that Python asks for."""
    return bool(key[-1] == _CALLEE)


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
    """Name a cache's folder that may hold others' code, which would run as the user."""
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


def packed_groups() -> dict[str, str]:
    """Return the groups of kernels that the installation brings along, with their digests."""
    pack = _pack()
    return {} if pack is None else dict(pack.groups())


@functools.cache
def _pack() -> Pack | None:
    """Return the installation's pack of kernels, None where there is none that fits."""
    try:
        return kernel_packs.open_pack(kernel_packs.FOLDER)
    except (PackError, OSError) as error:
        _warn_once(str(error))
        return None


class _Locator(caching._SourceFileBackedLocatorMixin, caching._CacheLocator):
    """Tells numba the folder of a function's module."""

    def __init__(self, function: Any, file: str) -> None:
        self._py_file, self._lineno = file, function.__code__.co_firstlineno
        folder = folder_of(function.__module__)
        if not is_of_package(function.__module__):
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
    """List the values that a function holds of the function around it: kernels and other values.

    Numba pickles that, and a pickled kernel is another one in each process. Here a kernel is told
    by its name, by its module's dependencies, which the other's need not import, and by those it
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
            held.append((module, name, folder_of(module), _held_by(made_of)))
    return held


def name_by_what_it_holds(function: Any) -> None:
    """Give a function that holds something a name of its own among those made as it was.

    The name is that of its machine code, in which a number tells functions of one name apart. Two
    processes may give the same number to two of them, and a third loads both.
    """
    if function.__closure__:
        held = repr(_held_by(function)).encode()
        function.__qualname__ += f"_{hashlib.blake2b(held, digest_size=8).hexdigest()}"


_writer: list[Callable[[Callable[[], None]], object]] = [lambda write: write()]
"""The last one takes a function that writes a kernel."""


@contextlib.contextmanager
def written_behind() -> Iterator[None]:
    """Write kernels while the next ones are compiled: each waits for the disk to have them.

    For processes that only compile: nothing is found in the cache before it is written. All is
    when this ends.
    """
    with ThreadPoolExecutor(1) as pool:
        _writer.append(pool.submit)
        try:
            yield
        finally:
            _writer.pop()


class KernelCache(caching.FunctionCache):
    """The cache of one kernel's machine code, for every combination of types."""

    class _impl_class(caching.CompileResultCacheImpl):  # noqa: N801 - numba's name for it
        _locator_classes = (_Locator,)

    def __init__(self, function: Any) -> None:
        """Look for nothing before a kernel is asked for: a process declares far more than it runs.

        Not numba's own, which would.
        """
        self._name, self._py_func = repr(function), function
        self._claims: list[int] = []
        self.enable()

    @functools.cached_property
    def _impl(self) -> Any:
        return self._impl_class(self._py_func)

    @functools.cached_property
    def _cache_path(self) -> Any:
        return self._impl.locator.get_cache_path()

    @functools.cached_property
    def _cache_file(self) -> Any:
        stamp = self._impl.locator.get_source_stamp()
        return KernelFiles(self._cache_path, self._impl.filename_base, stamp)

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep machine code; where that can't be done, say so once and go on without."""
        self._save(sig, data, (), lambda: lean_code(self._impl.reduce(data)))

    def save_callee(self, sig: Any, data: Any) -> None:
        """Keep the bitcode of a kernel, for its callers."""
        self._save(sig, data, (_CALLEE,), lambda: lean_callee(data))

    def _save(
        self, sig: Any, data: Any, mark: tuple[str, ...], contents: Callable[[], Any]
    ) -> None:
        try:
            self._impl.locator.ensure_cache_path()
            if self._is_trusted() and self._impl.check_cachable(data):
                key = (*self._key(sig), data.codegen.magic_tuple(), *mark)
                found = contents()
                _writer[-1](functools.partial(self._write, key, *found))
        except (OSError, RuntimeError) as error:
            _warn_of(error)

    def _write(self, key: Any, data: Any, bitcode: bytes) -> None:
        try:
            self._cache_file.save(key, data, bitcode)
        except (OSError, RuntimeError) as error:
            _warn_of(error)

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Load machine code, or return None and have numba ready to compile.

        Numba's own would have it ready in any case.
        """
        found = self._load_overload(sig, target_context)
        if found is None and self._claim(sig):
            found = self._load_kept(sig, target_context)
        if found is None:
            target_context.refresh()
        return found

    def _load_overload(self, sig: Any, target_context: Any) -> Any:
        """Load machine code, or return None where there is none that can be read."""
        found = self._load_packed(sig, target_context)
        return self._load_kept(sig, target_context) if found is None else found

    def _load_packed(self, sig: Any, target_context: Any) -> Any:
        """Load the installation's machine code; None where that can't be."""
        pack = _pack()
        module = self._py_func.__module__
        if pack is None or pack.is_damaged or not is_of_package(module):
            return None
        folder = folder_of(module)
        if pack.is_of_other_sources(module, folder):
            _warn_once(
                f"{module} is not as it was installed, so its kernels are not used: "
                "`pip install --force-reinstall` puts it right"
            )
            return None
        try:
            data = pack.find(folder, self._impl.filename_base, self._key(sig))
            return None if data is None else rebuild(target_context, data)
        except PackError as error:
            _warn_once(str(error))
        return None

    def _load_kept(self, sig: Any, target_context: Any) -> Any:
        """Load machine code of the user's cache, or None."""
        key = (*self._key(sig), target_context.codegen().magic_tuple())
        data = self._read(key, lambda: self._cache_file.load(key))
        return None if data is None else self._read(key, lambda: rebuild(target_context, data))

    def load_callee(self, sig: Any, target_context: Any) -> Any:
        """Load the bitcode that callers are compiled with from the user's cache, or None.

        After None no other process compiles the kernel until `release`.
        """
        found = self._load_callee(sig, target_context)
        if found is None and self._claim(sig, _CALLEE):
            found = self._load_callee(sig, target_context)
        return found

    def _claim(self, sig: Any, *mark: str) -> bool:
        """Wait while another process compiles a kernel, then keep others from it until `release`.

        Tells whether there is any use in looking for it once more.
        """
        try:
            if not self._is_trusted():
                return False
            self._impl.locator.ensure_cache_path()
            name = repr((self._cache_path, self._impl.filename_base, sig, mark)).encode()
            claimed = claim(cache_root() / "claims", name)
        except (OSError, RuntimeError) as error:
            _warn_of(error)
            return False
        if claimed is not None:
            self._claims.append(claimed)
        return True

    def release(self) -> None:
        """Let other processes compile the kernels that this one has claimed, kept or not."""
        while self._claims:
            _writer[-1](functools.partial(give_up, self._claims.pop()))

    def _load_callee(self, sig: Any, target_context: Any) -> Any:
        called = (*self._key(sig), target_context.codegen().magic_tuple())
        for key in ((*called, _CALLEE), called):
            data = self._read(key, functools.partial(self._cache_file.load, key))
            bitcode = data and self._read(
                key, functools.partial(self._cache_file.load_beside, key)
            )
            if bitcode:
                build = functools.partial(rebuild_callee, target_context, data, bitcode)
                return self._read(key, build)
        return None

    def _read(self, key: Any, read: Callable[[], Any]) -> Any:
        """Return the value that ``read`` finds below a key; None where it can't be had."""
        try:
            return read() if self._is_trusted() else None
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
        """Tell whether the folder's files are the user's, and of these sources; warn if not."""
        try:
            problem = _why_not_trusted(cache_root(), Path(self._cache_path))
            problem = problem or _why_not_current(self._py_func)
        except RuntimeError as error:  # there is no home folder
            _warn_of(error)
            return False
        if problem:
            _warn_once(problem)
        return not problem

    def _key(self, sig: Any) -> Any:
        """Return the key of one of the function's kernels, beside the processor."""
        arguments, _ = sigutils.normalize_signature(sig)
        code = hashlib.sha256(self._py_func.__code__.co_code).hexdigest()
        held = repr(_held_by(self._py_func))
        return (sig, code, held, repr(_fields(arguments)))


def _why_not_current(function: Any) -> str:
    """Name a source of a kernel that may be another than the one that this process imported.

    Folders are named by sources as they are when a kernel is first asked for.
    """
    for path in {Path(function.__code__.co_filename), *files_of(function.__module__)}:
        if path.exists() and path.stat().st_ctime > IMPORTED:
            return f"{path} was changed while this process runs, so its kernels are not kept"
    return ""


def _warn_of(error: Exception) -> None:
    reason = getattr(error, "strerror", None) or error
    _warn_once(cache_problem() or f"compiled kernels can't be kept in {cache_root()}: {reason}")


@functools.cache
def _warn_once(problem: str) -> None:
    """Warn of each problem once, however many kernels have it."""
    warnings.warn(
        f"{problem}; they are compiled anew, which takes minutes", KernelCacheWarning, stacklevel=2
    )
