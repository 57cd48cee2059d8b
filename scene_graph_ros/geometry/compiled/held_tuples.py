"""Tuples of arrays that are handed to a kernel as one array, not as thirty.

A call from Python looks at the type of every array that it hands over, and the tuples they are
in, which takes eight microseconds. Where a tuple changes seldom, the places of its arrays are
written down once, in the form in which compiled code has them.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numba
from numba.core import types
import numba.core.config as numba_config
from numba.extending import intrinsic
import numpy as np

from scene_graph_ros.geometry.compiled.kernel import lean_kernel

__all__ = ["borrower", "compiled_type", "write_down"]


def compiled_type(value: Any) -> Any:
    """Return the type of a value to compiled code: arrays' element types, axes and order."""
    return numba.typeof(value)


@intrinsic
def _size(typing_context, described):
    """Return the number of bytes that describe a tuple's arrays."""

    def lower(context, builder, signature, arguments):
        kind = context.get_value_type(signature.args[0])
        return context.get_constant(types.intp, context.get_abi_sizeof(kind))

    return types.intp(described), lower


@intrinsic
def _store(typing_context, described, places):
    """Write the description of a tuple's arrays into an array."""

    def lower(context, builder, signature, arguments):
        data = context.make_array(signature.args[1])(context, builder, arguments[1]).data
        kind = context.get_value_type(signature.args[0])
        builder.store(arguments[0], builder.bitcast(data, kind.as_pointer()), align=8)
        return context.get_dummy_value()

    return types.void(described, places), lower


@lean_kernel
def _count_words(described):
    return (_size(described) + 7) // 8


@lean_kernel
def _write(described, places):
    _store(described, places)


def write_down(value: Any) -> Any:
    """Return the addresses of a tuple's arrays, (words,) int64: right as long as these live.

    Where nothing is compiled it is the tuple.
    """
    if numba_config.DISABLE_JIT:
        return value
    places = np.zeros(_count_words(value), np.int64)
    _write(value, places)
    return places


def borrower(kind: Callable[[], Any]) -> Any:
    """Return an intrinsic that gives a kernel the tuple of a type that was written down.

    For lean kernels only: a borrowed tuple is not counted as a reference.
    """
    if numba_config.DISABLE_JIT:
        return lambda places: places

    def typed(typing_context: Any, places: Any) -> Any:
        def lower(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            data = context.make_array(signature.args[0])(context, builder, arguments[0]).data
            described = context.get_value_type(signature.return_type)
            return builder.load(builder.bitcast(data, described.as_pointer()), align=8)

        return kind()(places), lower

    return intrinsic(typed)
