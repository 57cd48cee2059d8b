"""The one place that configures numba: compiler flags and the cache of compiled kernels.

Numba's own cache does not notice when a helper in *another* file changes, nor a change of
``NUMBA_BOUNDSCHECK``. Here the kernels of a module are cached in a folder whose name is a digest
of its source, of the sources of all modules of the core that it imports, of numba's version and
of the flags, so a stale kernel can't be loaded.

Set ``SCENE_GRAPH_ROS_KERNEL_CACHE`` to place the cache elsewhere than the user's cache folder.
"""

from __future__ import annotations

from collections.abc import Callable
import contextlib
import fcntl
import functools
import hashlib
import os
from pathlib import Path
import re
import sys
from typing import Any

import numba
from numba import types
import numba.core.config as numba_config

__all__ = [
    "cache_root",
    "compilation_count",
    "digest_of_everything",
    "inlined_kernel",
    "kernel",
    "kernel_count",
    "lean_kernel",
    "merged_kernel",
]

# Flags that are not given are inherited from the caller that happens to trigger the compilation,
# so all that matter are given.
_FLAGS: dict[str, Any] = {
    "nogil": True,
    "error_model": "numpy",
    "fastmath": False,
    "forceinline": False,
    "_nrt": True,
    # Nobody passes kernels to C, so nobody needs their entry points for it.
    "no_cfunc_wrapper": True,
}
_PACKAGE = "scene_graph_ros.geometry"
_PACKAGE_FOLDER = Path(__file__).parent
_IMPORT = re.compile(
    rf"^\s*(?:from|import)\s+({re.escape(_PACKAGE)}[\w.]*)(?:\s+import\s+(\([^)]*\)|.*))?", re.M
)
_dispatchers: list[Any] = []


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
    """Name the core's modules that the source of module ``name`` imports."""
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
    closure, pending = set(), {module}
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
    flags = (bool(numba_config.BOUNDSCHECK), sorted(_FLAGS.items()))
    return repr((*versions, *flags)).encode()


def digest_of_everything() -> str:
    """Hash the sources of the whole core: while it is the same, so is every cached kernel."""
    digest = hashlib.blake2b(_environment(), digest_size=8)
    for path in sorted(_PACKAGE_FOLDER.rglob("*.py")):
        digest.update(path.read_bytes())
    return digest.hexdigest()


def _forget_literals(dispatcher: Any) -> None:
    """Make calls from other kernels compile for the types of constants, not for their values.

    Numba compiles a callee anew for every literal it is called with; the optimizer propagates
    constants into what it inlines in any case, so that costs minutes and gains nothing.
    """
    resolve = dispatcher.get_call_template

    def get_call_template(args: Any, kws: Any) -> Any:
        return resolve(
            tuple(types.unliteral(arg) for arg in args),
            {name: types.unliteral(arg) for name, arg in dict(kws).items()},
        )

    dispatcher.get_call_template = get_call_template


def cache_root() -> Path:
    """Return the folder below which compiled kernels are kept."""
    override = os.environ.get("SCENE_GRAPH_ROS_KERNEL_CACHE")
    if override:
        return Path(override)
    base = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(base) / "scene_graph_ros" / "kernels"


def kernel(function: Callable[..., Any]) -> Any:
    """Compile ``function`` on its first call, or load it from the cache.

    Kernels release the GIL, follow IEEE arithmetic strictly and divide by zero as numpy does.
    With ``NUMBA_DISABLE_JIT=1`` the plain Python function is returned.
    """
    return _compiled(function, _FLAGS)


def inlined_kernel(function: Callable[..., Any]) -> Any:
    """Compile like ``kernel``, and let the machine code always be inlined into its callers.

    For functions that take a tuple of arrays, such as a shape table: a call that is not inlined
    copies every pointer, shape and stride to the stack, which takes longer than most answers.
    """
    return _compiled(function, {**_FLAGS, "forceinline": True, "_nrt": False})


def merged_kernel(function: Callable[..., Any]) -> Any:
    """Make a lean kernel whose source is compiled as part of its callers, not on its own.

    Every layer of calls optimizes all layers below it once more, so a thin layer above a deep one
    costs seconds of compilation; merged, it costs none. Its callers must be lean.
    """
    return _compiled(function, {**_FLAGS, "_nrt": False, "inline": "always"})


def lean_kernel(function: Callable[..., Any]) -> Any:
    """Compile like ``kernel`` a function that creates no arrays, without counting references.

    Each count is an atomic operation; a hot function that only reads and writes the arrays it is
    given, and calls no function that returns an array, does without.
    """
    return _compiled(function, {**_FLAGS, "_nrt": False})


def _save_one_at_a_time(dispatcher: Any) -> None:
    """Let no other process save a kernel of the same function meanwhile.

    Numba picks a free file name from an index that it read before. Two processes that compile
    the same function for different types would pick the same name, and the index of the one
    would lead to the machine code of the other.
    """
    file = dispatcher._cache._cache_file
    save = file.save

    def save_locked(key: Any, data: Any) -> None:
        folder = Path(dispatcher._cache.cache_path)
        with contextlib.ExitStack() as stack:
            with contextlib.suppress(OSError):  # not writable: then save() says so, if need be
                lock = stack.enter_context((folder / ".lock").open("w"))
                fcntl.flock(lock, fcntl.LOCK_EX)
            save(key, data)

    file.save = save_locked


def _compiled(function: Callable[..., Any], flags: dict[str, Any]) -> Any:
    if numba_config.DISABLE_JIT:
        return function
    dispatcher = numba.njit(**flags)(function)
    _forget_literals(dispatcher)
    outer = numba_config.CACHE_DIR
    numba_config.CACHE_DIR = str(cache_root() / _digest(function.__module__))
    try:
        dispatcher.enable_caching()
    finally:
        numba_config.CACHE_DIR = outer
    _save_one_at_a_time(dispatcher)
    _dispatchers.append(dispatcher)
    return dispatcher


def compilation_count() -> int:
    """Count the kernels compiled by this process; loads from the cache do not count."""
    return sum(sum(d.stats.cache_misses.values()) for d in _dispatchers)


def kernel_count() -> int:
    """Count the kernels that were declared so far, compiled or not."""
    return len(_dispatchers)
