"""Small arrays of fixed size, kept in the machine's stack so that kernels allocate nothing.

Such an array is gone when the kernel that asked for it returns: it must not be returned.
"""

from llvmlite import ir
from numba.core import cgutils, types
import numba.core.config as numba_config
from numba.extending import intrinsic
from numba.np.arrayobj import make_array, populate_array
import numpy as np

from scene_graph_ros.geometry.meshes.bvh import MAX_DEPTH

__all__ = [
    "POLYGON_CORNERS",
    "STACK_SIZE",
    "polygon_buffer",
    "traversal_stack",
]

STACK_SIZE = 2 * MAX_DEPTH + 2
"""Entries of a stack: enough for a walk through two trees of the largest depth at once."""

POLYGON_CORNERS = 8
"""A quadrilateral cut by a quadrilateral has no more corners."""

_WORD_BYTES = 8


def _lowered(array_type, shape):
    """Return the code generator of an array of 8-byte words in the machine's stack."""

    def lower(context, builder, signature, arguments):
        size = int(np.prod(shape))
        word = context.get_value_type(array_type.dtype)
        data = cgutils.alloca_once(builder, word, size=ir.Constant(ir.IntType(64), size))
        strides = [_WORD_BYTES * int(np.prod(shape[k + 1 :])) for k in range(len(shape))]
        array = make_array(array_type)(context, builder)
        populate_array(
            array,
            data=data,
            shape=[context.get_constant(types.intp, n) for n in shape],
            strides=[context.get_constant(types.intp, n) for n in strides],
            itemsize=_WORD_BYTES,
            meminfo=None,
        )
        return array._getvalue()

    return lower


if numba_config.DISABLE_JIT:

    def traversal_stack():
        """Return an uninitialized array of ``STACK_SIZE`` int64."""
        return np.empty(STACK_SIZE, np.int64)

    def polygon_buffer():
        """Return an uninitialized array of ``(2, POLYGON_CORNERS, 3)`` float64."""
        return np.empty((2, POLYGON_CORNERS, 3))

else:
    _STACK = types.Array(types.int64, 1, "C")
    _BUFFER = types.Array(types.float64, 3, "C")

    @intrinsic
    def traversal_stack(typing_context):
        """Return an uninitialized array of ``STACK_SIZE`` int64."""
        return _STACK(), _lowered(_STACK, (STACK_SIZE,))

    @intrinsic
    def polygon_buffer(typing_context):
        """Return an uninitialized array of ``(2, POLYGON_CORNERS, 3)`` float64."""
        return _BUFFER(), _lowered(_BUFFER, (2, POLYGON_CORNERS, 3))
