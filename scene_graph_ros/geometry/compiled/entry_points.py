"""Kernels that are called by their address, so that callers are compiled without them.

A call puts the code of the callee into the caller, and optimizes it there once more. For code that
is large and takes long to run, the optimizer gains nothing by that, and each caller takes as long
to compile as the callee. Called by an address, which it gets with its arguments, it is compiled
once for all.
"""

from __future__ import annotations

from collections.abc import Callable
import functools
from typing import Any, NamedTuple

import numba
from numba.core import types
import numba.core.config as numba_config
from numba.core.errors import TypingError
from numba.extending import intrinsic

from scene_graph_ros.geometry.compiled.kernel import lean_kernel

__all__ = ["EntryPoint", "entry_point"]


class EntryPoint(NamedTuple):
    """A kernel that is compiled on its own."""

    call: Any
    """For kernels: ``call(address, arguments)``, a tuple."""
    address: Callable[[], int]
    """Compiles the kernel or loads it; good as long as this process lives."""


def entry_point(function: Callable[..., Any], example: tuple[Any, ...]) -> EntryPoint:
    """Make a lean kernel of a function, for arguments of the example's types, called by address.

    Calls with other types do not compile.
    """
    if numba_config.DISABLE_JIT:
        return EntryPoint(lambda address, arguments: function(*arguments), lambda: 0)
    dispatcher = lean_kernel(function)

    wanted = tuple(map(numba.typeof, example))

    @functools.cache
    def compiled() -> Any:
        dispatcher.compile(wanted)
        return dispatcher.overloads[wanted]

    @functools.cache
    def address() -> int:
        result = compiled()
        place: int = result.library.get_pointer_to_function(result.fndesc.llvm_func_name)
        return place

    def typed(typing_context: Any, address: Any, arguments: Any) -> Any:
        given = tuple(arguments)
        if given != wanted:
            raise TypingError(f"{function.__name__} takes {wanted}, not {given}")
        result = compiled().signature.return_type

        def lower(context: Any, builder: Any, signature: Any, values: Any) -> Any:
            convention = context.call_conv
            kind = convention.get_function_type(result, wanted).as_pointer()
            callee = builder.inttoptr(values[0], kind)
            parts = [builder.extract_value(values[1], i) for i in range(len(wanted))]
            status, value = convention.call_function(builder, callee, result, wanted, parts)
            with builder.if_then(status.is_error, likely=False):
                convention.return_status_propagate(builder, status)
            return value

        return result(types.int64, arguments), lower

    return EntryPoint(intrinsic(typed), address)
