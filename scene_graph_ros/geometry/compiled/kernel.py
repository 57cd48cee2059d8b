"""Compile functions of plain arrays: the decorators that every kernel is made with."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numba
from numba import types
import numba.core.config as numba_config

from scene_graph_ros.geometry.compiled.cache import (
    FLAGS,
    KernelCache,
    name_by_what_it_holds,
)
from scene_graph_ros.geometry.compiled.lean_code import make_linkable
from scene_graph_ros.geometry.compiled.signal_shield import shielded

__all__ = [
    "compilation_count",
    "inlined_kernel",
    "kernel",
    "kernel_count",
    "lean_kernel",
    "merged_kernel",
]

_dispatchers: list[Any] = []


def _prepare_for_callers(dispatcher: Any) -> None:
    """Make calls from other kernels compile for the types of constants, not for their values.

    Numba compiles a callee anew for every literal it is called with; the optimizer propagates
    constants into inlined code in any case, so that costs minutes and gains nothing. A kernel
    loaded without its bitcode for callers gets that first.
    """
    resolve = dispatcher.get_call_template

    def get_call_template(args: Any, kws: Any) -> Any:
        found = resolve(
            tuple(types.unliteral(arg) for arg in args),
            {name: types.unliteral(arg) for name, arg in dict(kws).items()},
        )
        make_linkable(dispatcher, tuple(found[2]))
        return found

    dispatcher.get_call_template = get_call_template


def kernel(function: Callable[..., Any]) -> Any:
    """Compile ``function`` on its first call, or load it from the cache.

    Kernels release the GIL, follow IEEE arithmetic strictly and divide by zero as numpy does.
    With ``NUMBA_DISABLE_JIT=1`` the plain Python function is returned.
    """
    return _compiled(function, FLAGS)


def inlined_kernel(function: Callable[..., Any]) -> Any:
    """Compile like ``kernel``, and let the machine code always be inlined into its callers.

    For functions that take a tuple of arrays, such as a shape table: a call that is not inlined
    copies every pointer, shape and stride to the stack, which takes longer than most answers.
    """
    return _compiled(function, {**FLAGS, "forceinline": True, "_nrt": False})


def merged_kernel(function: Callable[..., Any]) -> Any:
    """Make a lean kernel whose source is compiled as part of its callers, not on its own.

    Every layer of calls optimizes all layers below it once more, so a thin layer above a deep one
    costs seconds of compilation; merged, it costs none. Its callers must be lean.
    """
    return _compiled(function, {**FLAGS, "_nrt": False, "inline": "always"})


def lean_kernel(function: Callable[..., Any]) -> Any:
    """Compile like ``kernel`` a function that creates no arrays, without counting references.

    Each count is an atomic operation; a hot function that only reads and writes the arrays it is
    given, and calls no function that returns an array, does without.
    """
    return _compiled(function, {**FLAGS, "_nrt": False})


def _compiled(function: Callable[..., Any], flags: dict[str, Any]) -> Any:
    if numba_config.DISABLE_JIT:
        return function
    name_by_what_it_holds(function)
    dispatcher = numba.njit(**flags)(function)
    _prepare_for_callers(dispatcher)
    dispatcher._cache = KernelCache(function)  # as numba's enable_caching, with a cache of ours
    dispatcher.compile = shielded(dispatcher.compile)
    _dispatchers.append(dispatcher)
    return dispatcher


def compilation_count() -> int:
    """Count the kernels compiled by this process; loads from the cache do not count."""
    return sum(sum(d.stats.cache_misses.values()) for d in _dispatchers)


def kernel_count() -> int:
    """Count the kernels that were declared so far, compiled or not."""
    return len(_dispatchers)
