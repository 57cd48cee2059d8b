"""Numbers of lanes, kept in the machine's stack, each line of the processor's cache a vector.

Such an array is gone when the kernel that asked for it returns: it must not be returned.
"""

from llvmlite import ir
from numba.core import cgutils, types
import numba.core.config as numba_config
from numba.extending import intrinsic
from numba.np.arrayobj import make_array, populate_array
import numpy as np

__all__ = ["LANES", "LANE_ROWS", "LINE", "answer_numbers", "lane_numbers"]

LANES = 32
"""How many answers to points are computed at once, a few in each of the processor's registers."""

LINE = 8
"""Numbers of a line of the cache, 64 bytes: what the widest registers hold."""

LANE_ROWS = LINE
"""For so many rows answers in lanes are kept before they are put into results."""

_LANE_NUMBERS = 22
"""Numbers of a lane, in ``lanes``."""

_ANSWER_NUMBERS = 8 * LANE_ROWS

_BYTES = 8

if numba_config.DISABLE_JIT:

    def lane_numbers():
        """Return an uninitialized array of 22 numbers for each lane."""
        return np.empty(_LANE_NUMBERS * LANES)

    def answer_numbers():
        """Return an uninitialized array of the answers of all lanes about ``LANE_ROWS`` rows."""
        return np.empty(_ANSWER_NUMBERS * LANES)

else:
    _NUMBERS = types.Array(types.float64, 1, "C")

    def _lowered(count):
        def lower(context, builder, signature, arguments):
            size = ir.Constant(ir.IntType(64), count)
            data = cgutils.alloca_once(builder, ir.DoubleType(), size=size)
            data.align = _BYTES * LINE
            array = make_array(_NUMBERS)(context, builder)
            populate_array(
                array,
                data=data,
                shape=[context.get_constant(types.intp, count)],
                strides=[context.get_constant(types.intp, _BYTES)],
                itemsize=_BYTES,
                meminfo=None,
            )
            return array._getvalue()

        return lower

    @intrinsic
    def lane_numbers(typing_context):
        """Return an uninitialized array of 22 numbers for each lane."""
        return _NUMBERS(), _lowered(_LANE_NUMBERS * LANES)

    @intrinsic
    def answer_numbers(typing_context):
        """Return an uninitialized array of the answers of all lanes about ``LANE_ROWS`` rows."""
        return _NUMBERS(), _lowered(_ANSWER_NUMBERS * LANES)
