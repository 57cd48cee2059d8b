"""Numbers among bytes, at any place, in this machine's byte order.

``data`` are ``bytes``, ``place`` is the first of those to read, which is not checked.
"""

import struct

from llvmlite import ir
from numba.core import types
import numba.core.config as numba_config
from numba.extending import intrinsic

__all__ = ["number_at", "seconds_at", "word_at"]


def _reader(kind, result, widen):
    """Return an intrinsic that reads ``kind``, unaligned bytes, and makes ``result`` of it."""

    def read(typing_context, data, place):
        def lower(context, builder, signature, arguments):
            array = context.make_array(signature.args[0])(context, builder, arguments[0])
            start = builder.gep(array.data, [arguments[1]])
            value = builder.load(builder.bitcast(start, kind.as_pointer()), align=1)
            return widen(builder, value)

        return result(data, types.intp), lower

    return intrinsic(read)


def _plain_reader(kind):
    return lambda data, place: struct.unpack_from(f"={kind}", data, place)[0]


if numba_config.DISABLE_JIT:
    number_at, seconds_at, word_at = (_plain_reader(kind) for kind in "diI")
else:
    _WORD, _WIDE = ir.IntType(32), ir.IntType(64)
    number_at = _reader(ir.DoubleType(), types.float64, lambda builder, value: value)
    seconds_at = _reader(_WORD, types.int64, lambda builder, value: builder.sext(value, _WIDE))
    word_at = _reader(_WORD, types.int64, lambda builder, value: builder.zext(value, _WIDE))
