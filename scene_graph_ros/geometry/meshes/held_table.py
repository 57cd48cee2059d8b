"""A shape table that is handed to a kernel as one array, not as thirty.

A call from Python looks at the type of every array that it hands over, and the tuples they are
in, which takes eight microseconds. A table changes seldom, so the places of its arrays are
written down once, in the form in which compiled code has them.
"""

from __future__ import annotations

import functools
from typing import Any, NamedTuple

import numba
from numba.core import types
import numba.core.config as numba_config
from numba.extending import intrinsic
import numpy as np

from scene_graph_ros.geometry.compiled.kernel import lean_kernel
from scene_graph_ros.geometry.meshes.shape_table import build_shape_table, ShapeTable

__all__ = ["HeldTable", "borrowed_table", "hold"]


class HeldTable(NamedTuple):
    """A table and where its arrays are; these are right as long as the table lives."""

    table: ShapeTable
    places: Any
    """What ``borrowed_table`` takes: (words,) int64, or the table where nothing is compiled."""


@functools.cache
def _table_type() -> Any:
    """Return the type of every table, to compiled code."""
    return numba.typeof(build_shape_table([], []))


def hold(table: ShapeTable) -> HeldTable:
    """Write down where the arrays of a table of ``build_shape_table`` are.

    Raises:
        TypeError: an array has another type, order or number of axes, or is read-only.

    """
    if numba_config.DISABLE_JIT:
        return HeldTable(table, table)
    if numba.typeof(table) != _table_type():
        raise TypeError(f"not a table of build_shape_table: {numba.typeof(table)}")
    places = np.zeros(_count_words(table), np.int64)
    _write(table, places)
    return HeldTable(table, places)


if numba_config.DISABLE_JIT:

    def borrowed_table(places: Any) -> Any:
        """Return the table."""
        return places

else:

    @intrinsic
    def _size(typing_context, table):
        """Return how many bytes a table's arrays take to describe."""

        def lower(context, builder, signature, arguments):
            described = context.get_value_type(signature.args[0])
            return context.get_constant(types.intp, context.get_abi_sizeof(described))

        return types.intp(table), lower

    @intrinsic
    def _store(typing_context, table, places):
        """Write the description of a table's arrays into an array."""

        def lower(context, builder, signature, arguments):
            data = context.make_array(signature.args[1])(context, builder, arguments[1]).data
            described = context.get_value_type(signature.args[0])
            builder.store(arguments[0], builder.bitcast(data, described.as_pointer()), align=8)
            return context.get_dummy_value()

        return types.void(table, places), lower

    @intrinsic
    def borrowed_table(typing_context, places):
        """Return the table that the ``places`` of a HeldTable describe.

        For lean kernels only: what is borrowed is not counted as a reference.
        """

        def lower(context, builder, signature, arguments):
            data = context.make_array(signature.args[0])(context, builder, arguments[0]).data
            described = context.get_value_type(signature.return_type)
            return builder.load(builder.bitcast(data, described.as_pointer()), align=8)

        return _table_type()(places), lower

    @lean_kernel
    def _count_words(table):
        return (_size(table) + 7) // 8

    @lean_kernel
    def _write(table, places):
        _store(table, places)
