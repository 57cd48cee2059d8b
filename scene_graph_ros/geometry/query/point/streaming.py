"""Write long runs of numbers past the processor's caches.

A result of many megabytes is not read again soon. Written in the ordinary way, each line of it is
first read from memory; written past the caches it is not, which takes a third of the time. The
numbers are the same.
"""

from llvmlite import ir
from numba.core import types
import numba.core.config as numba_config
from numba.extending import intrinsic

from scene_graph_ros.geometry.jit import lean_kernel
from scene_graph_ros.geometry.spatial.places import LAST_PLACE

__all__ = ["copy", "finish_streams", "stream"]

_LINE = 8
"""Numbers of a line of the cache, 64 bytes."""

if numba_config.DISABLE_JIT:

    def _numbers_to_line(target):
        return 0

    def _stream_line(target, at, source, first):
        target[at : at + _LINE] = source[first : first + _LINE]

    def finish_streams():
        """Do nothing: there are no streams."""

else:

    def _data(context, builder, array_type, array):
        return context.make_array(array_type)(context, builder, array).data

    @intrinsic
    def _numbers_to_line(typing_context, target):
        """Return how many numbers of a float64 array come before the first line's start."""

        def lower(context, builder, signature, arguments):
            word = ir.IntType(64)
            data = _data(context, builder, signature.args[0], arguments[0])
            address = builder.ptrtoint(data, word)
            before = builder.and_(builder.neg(address), ir.Constant(word, 8 * _LINE - 1))
            return builder.lshr(before, ir.Constant(word, 3))

        return types.int64(target), lower

    @intrinsic
    def _stream_line(typing_context, target, at, source, first):
        """Write numbers of ``source`` from ``first`` on into the line of ``target`` at ``at``."""
        line = ir.VectorType(ir.DoubleType(), _LINE)

        def place(context, builder, array_type, array, at):
            data = _data(context, builder, array_type, array)
            return builder.bitcast(builder.gep(data, [at]), line.as_pointer())

        def lower(context, builder, signature, arguments):
            kinds, (target, at, source, first) = signature.args, arguments
            numbers = builder.load(place(context, builder, kinds[2], source, first), align=8)
            to = place(context, builder, kinds[0], target, at)
            written = builder.store(numbers, to, align=8 * _LINE)
            one = builder.module.add_metadata([ir.Constant(ir.IntType(32), 1)])
            written.set_metadata("nontemporal", one)
            return context.get_dummy_value()

        return types.void(target, at, source, first), lower

    @intrinsic
    def finish_streams(typing_context):
        """Let everything written so far be there for whoever reads after us."""

        def lower(context, builder, signature, arguments):
            builder.fence("seq_cst")
            return context.get_dummy_value()

        return types.void(), lower


@lean_kernel
def copy(target, at, source, first, count):
    """Copy ``count`` numbers from one flat float64 array into another."""
    for k in range(count):
        target[(at + k) & LAST_PLACE] = source[(first + k) & LAST_PLACE]


@lean_kernel
def stream(target, at, source, first, count):
    """Copy as ``copy`` does, past the caches. Nobody may read before ``finish_streams``."""
    head = min((_numbers_to_line(target) - at) & (_LINE - 1), count)
    last = head + ((count - head) & ~(_LINE - 1))
    copy(target, at, source, first, head)
    for k in range(head, last, _LINE):
        _stream_line(target, at + k, source, first + k)
    copy(target, at + last, source, first + last, count - last)
