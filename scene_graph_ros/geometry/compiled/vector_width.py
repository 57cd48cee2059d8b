"""Let the compiler compute as many numbers in step as the processor's widest registers hold.

For processors that have them, the compiler prefers registers of half the width, which were faster
in programs with little such code. Values that do not fit into the registers wait on the stack.
That begins anywhere, by a whim of the process, and a register that is kept across two lines of the
cache takes twice as long to write and read; so its part of the stack begins with a line.
"""

from numba.core import types
import numba.core.config as numba_config
from numba.extending import intrinsic

__all__ = ["use_widest_vectors"]

# llvmlite knows the names of attributes without a value only.
_ATTRIBUTES = '"prefer-vector-width"="512"', "alignstack(64)"

if numba_config.DISABLE_JIT:

    def use_widest_vectors():
        """Do nothing: nothing is compiled."""

else:

    @intrinsic
    def use_widest_vectors(typing_context):
        """Have the loops of the kernel that calls this computed with the widest registers.

        It takes next to no time. The kernels that it calls have to ask for themselves.
        """

        def lower(context, builder, signature, arguments):
            for attribute in _ATTRIBUTES:
                set.add(builder.function.attributes, attribute)
            return context.get_dummy_value()

        return types.void(), lower
