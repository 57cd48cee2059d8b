"""Arrays of fixed size, kept in the machine's stack so that kernels allocate nothing.

Such an array is gone when the kernel that asked for it returns: it must not be returned.
"""

from __future__ import annotations

from collections.abc import Callable
import math
from typing import Any

from llvmlite import ir
import numba
from numba.core import cgutils, types
import numba.core.config as numba_config
from numba.extending import intrinsic
from numba.np.arrayobj import make_array, populate_array
import numpy as np

__all__ = ["stack_array"]


def stack_array(
    shape: tuple[int, ...], kind: Any = np.float64, *, alignment: int | None = None
) -> Callable[[], Any]:
    """Return an intrinsic for an uninitialized array of numbers.

    It begins at a multiple of ``alignment`` bytes, if that is given and something is compiled.
    """
    if numba_config.DISABLE_JIT:
        return lambda: np.empty(shape, kind)
    array_type = types.Array(numba.from_dtype(np.dtype(kind)), len(shape), "C")
    itemsize = np.dtype(kind).itemsize
    strides = [itemsize * math.prod(shape[axis + 1 :]) for axis in range(len(shape))]

    def lower(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        number = context.get_value_type(array_type.dtype)
        size = ir.Constant(ir.IntType(64), math.prod(shape))
        data = cgutils.alloca_once(builder, number, size=size)
        if alignment is not None:
            data.align = alignment
        array = make_array(array_type)(context, builder)
        populate_array(
            array,
            data=data,
            shape=[context.get_constant(types.intp, length) for length in shape],
            strides=[context.get_constant(types.intp, stride) for stride in strides],
            itemsize=itemsize,
            meminfo=None,
        )
        return array._getvalue()

    def typed(typing_context: Any) -> Any:
        return array_type(), lower

    result: Callable[[], Any] = intrinsic(typed)
    return result
