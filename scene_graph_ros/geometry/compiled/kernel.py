"""Compile functions of plain arrays: the decorators that every kernel is made with."""

from __future__ import annotations

from collections.abc import Callable
import functools
from typing import Any

from numba import types
import numba.core.config as numba_config
from numba.core.registry import CPUDispatcher

from scene_graph_ros.geometry.compiled.cache import (
    FLAGS,
    KernelCache,
    name_by_what_it_holds,
)
from scene_graph_ros.geometry.compiled.callee_code import Callees, Kept, link_environments
from scene_graph_ros.geometry.compiled.lazy_dispatcher import LazyDispatcher
from scene_graph_ros.geometry.compiled.lean_code import has_bitcode
from scene_graph_ros.geometry.compiled.signal_shield import shielded
from scene_graph_ros.geometry.compiled.slice_errors import with_short_slice_errors

__all__ = [
    "compilation_count",
    "compile_for_callers",
    "inlined_kernel",
    "kernel",
    "lean_kernel",
    "merged_kernel",
]

_dispatchers: list[Any] = []
"""Of kernels that were used."""


def _prepare_for_callers(dispatcher: Any, cache: KernelCache) -> None:
    """Have calls from other kernels compiled with `Callees`, for the types of constants.

    Numba compiles a callee anew for every literal it is called with; the optimizer propagates
    constants into inlined code in any case, so that costs minutes and gains nothing.
    """
    kept = Kept(has_bitcode, cache.load_callee, cache.save_callee, cache.release)
    callees = dispatcher.callees = Callees(dispatcher, kept)

    def get_call_template(args: Any, kws: Any) -> Any:
        return callees.call_template(
            tuple(types.unliteral(arg) for arg in args),
            {name: types.unliteral(arg) for name, arg in dict(kws).items()},
        )

    dispatcher.get_call_template = get_call_template
    dispatcher.get_overload = callees.entry_point


def _prepare_for_python(dispatcher: Any, cache: KernelCache) -> None:
    """Have calls from Python compiled by one process at a time, in spite of signals."""
    add, compile_for = dispatcher.add_overload, dispatcher.compile

    def add_overload(result: Any) -> None:
        link_environments(result)
        add(result)

    def compile_alone(sig: Any) -> Any:
        try:
            return compile_for(sig)
        finally:
            cache.release()

    compiler = dispatcher._compiler
    compiler.compile = with_short_slice_errors(compiler.compile)
    dispatcher._cache = cache  # as numba's enable_caching, with a cache of ours
    dispatcher.add_overload, dispatcher.compile = add_overload, shielded(compile_alone)


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
    return LazyDispatcher(function, functools.partial(_initialize, flags=flags))


def _initialize(dispatcher: Any, flags: dict[str, Any]) -> None:
    """Do as ``numba.njit`` does, and have our cache used."""
    options = {**flags, "nopython": True, "boundscheck": None}
    CPUDispatcher.__init__(dispatcher, dispatcher.py_func, targetoptions=options)
    cache = KernelCache(dispatcher.py_func)
    _prepare_for_callers(dispatcher, cache)
    _prepare_for_python(dispatcher, cache)
    _dispatchers.append(dispatcher)


def compile_for_callers(kernel: Any, types_of_arguments: tuple[Any, ...]) -> None:
    """Compile a kernel, or load it, as other kernels call it with arguments of numba's types."""
    kernel.callees.require(types_of_arguments)


def compilation_count() -> int:
    """Count the kernels compiled by this process; loads from the cache do not count."""
    return sum(sum(d.stats.cache_misses.values()) for d in _dispatchers)
