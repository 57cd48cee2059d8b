"""The stack of a walk through a tree, kept in the machine's stack so that nothing is allocated."""

import numba.core.config as numba_config
import numpy as np
from llvmlite import ir
from numba.core import cgutils, types
from numba.extending import intrinsic
from numba.np.arrayobj import make_array, populate_array

from scene_graph_ros.geometry.meshes.bvh import MAX_DEPTH

__all__ = ["STACK_SIZE", "traversal_stack"]

STACK_SIZE = 2 * MAX_DEPTH + 2
"""Entries of a stack: enough for a walk through two trees of the largest depth at once."""

_ARRAY = types.Array(types.int64, 1, "C")


def _lower_stack(context, builder, signature, arguments):
    word = ir.IntType(64)
    data = cgutils.alloca_once(builder, word, size=ir.Constant(word, STACK_SIZE))
    array = make_array(_ARRAY)(context, builder)
    populate_array(
        array,
        data=data,
        shape=[context.get_constant(types.intp, STACK_SIZE)],
        strides=[context.get_constant(types.intp, _ARRAY.dtype.bitwidth // 8)],
        itemsize=_ARRAY.dtype.bitwidth // 8,
        meminfo=None,
    )
    return array._getvalue()


if numba_config.DISABLE_JIT:

    def traversal_stack():
        """Return an uninitialized array of ``STACK_SIZE`` int64."""
        return np.empty(STACK_SIZE, np.int64)

else:

    @intrinsic
    def traversal_stack(typing_context):
        """Return an uninitialized array of ``STACK_SIZE`` int64, gone when the caller returns."""
        return _ARRAY(), _lower_stack
