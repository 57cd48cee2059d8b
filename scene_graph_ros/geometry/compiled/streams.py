"""Write lines of numbers past the processor's caches.

A result of many megabytes is not read again soon. Written in the ordinary way, each line of it is
first read from memory; written past the caches it is not, which takes a third of the time. The
numbers are the same.
"""

from llvmlite import ir
from numba.core import types
import numba.core.config as numba_config
from numba.extending import intrinsic

__all__ = ["LINE", "finish_streams", "numbers_to_line"]

LINE = 8
"""Numbers of a line of the cache, 64 bytes: what the widest registers hold."""

_BYTES = 8

if numba_config.DISABLE_JIT:

    def numbers_to_line(target):
        """Return 0: there are no lines."""
        return 0

    def finish_streams():
        """Do nothing: there are no streams."""

else:

    @intrinsic
    def numbers_to_line(typing_context, target):
        """Return the count of numbers of a float64 array before the first line's start."""

        def lower(context, builder, signature, arguments):
            word = ir.IntType(64)
            array = context.make_array(signature.args[0])(context, builder, arguments[0])
            address = builder.ptrtoint(array.data, word)
            before = builder.and_(builder.neg(address), ir.Constant(word, _BYTES * LINE - 1))
            return builder.lshr(before, ir.Constant(word, 3))

        return types.int64(target), lower

    @intrinsic
    def finish_streams(typing_context):
        """Let everything written so far be there for whoever reads after us."""

        def lower(context, builder, signature, arguments):
            builder.fence("seq_cst")
            return context.get_dummy_value()

        return types.void(), lower
